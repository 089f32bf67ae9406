/* Fuzz target: everything in front of the chunks, as it is and with a checksum that fits, from any prefix. */
#include "harness.h"

enum { FIXED = 1 << 20 }; /* of any file: models, the struct itself */

static void read_front(const uint8_t *bytes, size_t size, const ath_limits *limits)
{
    size_t front = 0, memory = 0, again = 0;
    int result = ath_front(bytes, size, limits, &front, &memory, NULL);
    REQUIRE(strcmp(ath_result_name(result), "UNKNOWN") != 0, "every result has a name");
    if (result == ATH_MISSING) {
        REQUIRE(front > size, "what is missing is more than what is there");
        return;
    }
    if (result != ATH_OK) return;
    uint64_t tables = 4 * (uint64_t)limits->table_bytes + sizeof(double) * limits->frames;
    REQUIRE(memory <= limits->memory_bytes + tables + FIXED, "memory is bounded by the limits");
    for (size_t cut = front; cut-- > 0; cut = cut * 7 / 8) {
        uint8_t *prefix = fuzz_copy(bytes, cut);
        REQUIRE(ath_front(prefix, cut, limits, &again, &memory, NULL) == ATH_MISSING,
                "less than the prelude is too little");
        REQUIRE(again > cut && again <= front, "a prefix asks for more, and never for more than the prelude");
        free(prefix);
    }
}

/* Arrays and metadata that are accepted are bytes of their chunk, and state sizes within their limits. */
static void read_static(const ath_file *file, int32_t chunk_count)
{
    for (int32_t i = 0; i < chunk_count; i++) {
        const ath_chunk *chunk = ath_chunks(file) + i;
        ath_array array;
        if (ath_array_of(file, i, &array, NULL) != ATH_OK) continue;
        uint64_t end = (uint64_t)(array.packed - chunk->bytes) + array.packed_bytes, count = array.item_bytes;
        for (uint32_t d = 0; d < array.dimension_count; d++) count *= array.shape[d];
        REQUIRE(end == chunk->length && (array.bytes > 0) == (array.packed_bytes > 0),
                "an array's frame is in its chunk");
        REQUIRE(array.bytes == count && count <= 1 << 28, "the size of an array is that of its shape");
        REQUIRE((const uint8_t *)array.name + array.name_bytes == array.packed, "a name is in its chunk");
    }
    ath_metadata metadata;
    if (ath_metadata_of(file, &metadata, NULL) != ATH_OK || !metadata.stored) return;
    REQUIRE(metadata.bytes <= 1 << 20, "the size of metadata is within its limit");
    REQUIRE(metadata.is_packed || metadata.bytes == metadata.stored_bytes, "a plain text is stored as it is");
}

static void open_it(const uint8_t *bytes, size_t size, const ath_limits *limits)
{
    fuzz_file opened;
    if (!fuzz_open(&opened, bytes, size, limits, 0xa5)) return;
    ath_info info;
    ath_get_info(opened.file, &info);
    uint64_t end = ath_chunks(opened.file)[0].offset;
    for (int32_t i = 0; i < info.chunk_count; i++) {
        const ath_chunk *chunk = ath_chunks(opened.file) + i;
        REQUIRE(chunk->offset == end, "chunks follow each other without gaps");
        end += chunk->length;
        if (chunk->bytes && chunk->length)
            REQUIRE(chunk->bytes >= bytes && chunk->bytes + chunk->length <= bytes + size,
                    "chunks are bytes of the file");
    }
    REQUIRE(end == info.file_length, "chunks end where the file does");
    read_static(opened.file, info.chunk_count);
    fuzz_close(&opened);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < OPTIONS) return 0;
    const uint8_t *options = data + size - OPTIONS;
    ath_limits limits = fuzz_limits((uint64_t)1 << (12 + options[1] % 12));
    if (options[2] & 1) limits.vertices = options[3];
    if (options[2] & 2) limits.branches = options[4];
    if (options[2] & 4) limits.frames = options[5];
    if (options[2] & 8) limits.chunks = options[6];
    if (options[2] & 16) limits.hierarchy_depth = options[7];
    if (options[2] & 32) limits.chunk_bytes = (uint32_t)options[8] * 16;
    if (options[2] & 64) limits.table_bytes = (uint32_t)options[9] * 16;
    uint8_t *file = fuzz_copy(data, size - OPTIONS);
    if (options[0] & 1) fuzz_repair(file, size - OPTIONS);
    read_front(file, size - OPTIONS, &limits);
    open_it(file, size - OPTIONS, &limits);
    free(file);
    return 0;
}
