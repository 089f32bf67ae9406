/* Fuzz target: the motion streams of every segment at every level of a file whose checksums fit, decoded twice, in one
 * go and in steps, over memory that held other things: the bits have to be the same. Each chunk lies in memory of its
 * own, so that reading beyond it is seen. */
#include "harness.h"

enum { MOST_MEMORY = 8 << 20, MOST_SEGMENTS = 8 };

static void decode_level(fuzz_file *opened, int32_t segment, int32_t level, const uint8_t *options)
{
    ath_segment *whole = fuzz_prepare(opened, segment, level, INT32_MAX, MOST_MEMORY, 0xa5);
    ath_segment *stepped = fuzz_prepare(opened, segment, level, 1 + options[1] % 7, MOST_MEMORY, options[2]);
    REQUIRE((whole != NULL) == (stepped != NULL), "steps decode what one go does");
    if (whole) REQUIRE(fuzz_same(opened->file, whole, stepped), "a level is a function of the file's bytes");
    free(whole);
    free(stepped);
}

static uint8_t **feed_copies(ath_file *file, const uint8_t *bytes, size_t size)
{
    size_t count = (size_t)file->info.chunk_count;
    uint8_t **copies = fuzz_memory(count * sizeof *copies, 0);
    ath_drop(file, 0, file->info.file_length);
    for (size_t i = 0; i < count; i++) {
        const ath_chunk *chunk = ath_chunks(file) + i;
        copies[i] = NULL;
        if (chunk->length == 0 || chunk->offset + chunk->length > size) continue;
        copies[i] = fuzz_copy(bytes + chunk->offset, chunk->length);
        ath_feed(file, copies[i], chunk->offset, chunk->length);
    }
    return copies;
}

static void drop_copies(uint8_t **copies, int32_t count)
{
    for (int32_t i = 0; i < count; i++) free(copies[i]);
    free(copies);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < OPTIONS) return 0;
    const uint8_t *options = data + size - OPTIONS;
    ath_limits limits = fuzz_limits(2 << 20);
    fuzz_file opened;
    uint8_t *file = fuzz_copy(data, size - OPTIONS);
    fuzz_repair(file, size - OPTIONS);
    if (fuzz_open(&opened, file, size - OPTIONS, &limits, 0xa5)) {
        ath_info info;
        ath_get_info(opened.file, &info);
        uint8_t **copies = feed_copies(opened.file, file, size - OPTIONS);
        for (int32_t s = 0; s < ath_min(info.segment_count, MOST_SEGMENTS); s++)
            for (int32_t level = 0; level < info.level_count; level++) decode_level(&opened, s, level, options);
        drop_copies(copies, info.chunk_count);
        fuzz_close(&opened);
    }
    free(file);
    return 0;
}
