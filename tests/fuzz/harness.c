/* What the fuzz targets share (harness.h). Left out: anything that a target does not need of a file. */
#include "harness.h"

/* MemorySanitizer notices by itself what was never written. */
#if defined(__has_feature)
#if __has_feature(memory_sanitizer)
#define FILLS 0
#endif
#endif
#ifndef FILLS
#define FILLS 1
#endif

enum { CHECKSUM_AT = 12, FRONT_LENGTH_AT = 16 };

void *fuzz_memory(size_t size, int fill)
{
    void *memory = malloc(size);
    REQUIRE(memory || size == 0, "memory within the limits can be had");
    if (memory && FILLS) memset(memory, fill, size);
    return memory;
}

uint8_t *fuzz_copy(const uint8_t *bytes, size_t size)
{
    uint8_t *copy = fuzz_memory(size, 0);
    if (size > 0) memcpy(copy, bytes, size);
    return copy;
}

ath_limits fuzz_limits(uint64_t memory_bytes)
{
    ath_limits limits;
    ath_default_limits(&limits);
    limits.table_bytes = 1u << 20;
    limits.frames = 1u << 16;
    limits.memory_bytes = memory_bytes;
    return limits;
}

/* ---- checksums that fit ---- */

uint32_t fuzz_u32(const uint8_t *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

void fuzz_put_u32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++) at[i] = (uint8_t)(value >> 8 * i);
}

size_t fuzz_chunks_at(const uint8_t *file, size_t size)
{
    if (size < HEADER) return 0;
    uint64_t at = fuzz_u32(file + FRONT_LENGTH_AT), least = HEADER + 4 * (uint64_t)fuzz_u32(file + CHUNK_COUNT_AT);
    return at >= least && at <= size ? (size_t)at : 0;
}

static void repair_front(uint8_t *file, size_t front)
{
    static const uint8_t fixed[12] = {
        0x89, 'A', 'T', 'H', '\r', '\n', 0x1a, '\n', ATH_FORMAT_MAJOR, ATH_FORMAT_MINOR, ATH_FEATURES, 0};
    memcpy(file, fixed, sizeof fixed);
    fuzz_put_u32(file + CHECKSUM_AT, 0);
    fuzz_put_u32(file + CHECKSUM_AT, ath_crc32c(0, file, front));
}

ath_chunk *fuzz_chunks(uint8_t *file, size_t size, uint32_t *count, uint32_t *vertices)
{
    ath_limits limits = fuzz_limits((uint64_t)1 << 40);
    ath_fault_info fault;
    ath_header header;
    uint64_t needed;
    size_t front = fuzz_chunks_at(file, size);
    if (front == 0) return NULL;
    repair_front(file, front);
    if (ath_read_header(file, size, &limits, &header, &needed, &fault) != ATH_OK) return NULL;
    ath_chunk *chunks = fuzz_memory(header.chunk_count * sizeof *chunks, 0);
    int result = ath_read_tables(file, size, &limits, &header, &needed, chunks, NULL, NULL, NULL, &fault);
    *count = header.chunk_count;
    *vertices = header.vertex_count;
    if (result == ATH_OK || result == ATH_MISSING) return chunks;
    free(chunks);
    return NULL;
}

/* ---- the mesh of a host: the same numbers for every file ---- */

enum { REST_HEAD = 17, IS_HOST = 4 };

float *fuzz_host_mesh(size_t vertices)
{
    float *mesh = fuzz_memory(3 * vertices * sizeof *mesh, 0);
    for (size_t i = 0; i < 3 * vertices; i++) mesh[i] = (float)(i * i % 251) / 8.0f;
    return mesh;
}

/* Checksums of that mesh in a REST chunk that asks for one. */
static void repair_rest(uint8_t *rest, size_t length, size_t vertices)
{
    if (length != REST_HEAD + 8 || rest[0] != IS_HOST || vertices > FUZZ_MESH_VERTICES) return;
    float *mesh = fuzz_host_mesh(vertices);
    size_t size = 3 * vertices * sizeof *mesh;
    uint8_t *backwards = fuzz_copy((const uint8_t *)mesh, size);
    for (size_t i = 0; i < size; i++) backwards[i] = ((const uint8_t *)mesh)[size - 1 - i];
    fuzz_put_u32(rest + REST_HEAD, ath_crc32c(0, (const uint8_t *)mesh, size));
    fuzz_put_u32(rest + REST_HEAD + 4, ath_crc32c(0, backwards, size));
    free(backwards);
    free(mesh);
}

void fuzz_repair(uint8_t *file, size_t size)
{
    uint32_t count = 0, vertices = 0;
    ath_chunk *chunks = fuzz_chunks(file, size, &count, &vertices);
    size_t front = fuzz_chunks_at(file, size);
    for (uint32_t i = 0; chunks && i < count; i++)
        if (chunks[i].kind == ATH_REST && chunks[i].offset + chunks[i].length <= size)
            repair_rest(file + chunks[i].offset, chunks[i].length, vertices);
    for (uint32_t i = 0; chunks && i < count; i++)
        if (chunks[i].offset + chunks[i].length <= size)
            fuzz_put_u32(file + front - 4 * (size_t)(count - i),
                         ath_crc32c(0, file + chunks[i].offset, chunks[i].length));
    if (chunks) repair_front(file, front);
    free(chunks);
}

/* ---- a file and its segments ---- */

static int is_refusal(int result)
{
    return (result > ATH_OK && result < ATH_TRAILING_BYTES) || result == ATH_UNSUPPORTED_FEATURE;
}

/* Every refusal says what it is about, in a sentence that the caller's buffer holds. */
static void check_fault(const ath_fault_info *fault, int result)
{
    char text[ATH_FAULT_TEXT];
    REQUIRE(fault->code == result, "a fault has the code of its result");
    if (result == ATH_OK) return;
    REQUIRE(fault->field != ATH_FIELD_NONE, "a refusal names the field");
    size_t length = ath_fault_text(fault, text, sizeof text);
    REQUIRE(length < sizeof text && strlen(text) == length && strstr(text, ": got "), "a fault has a sentence");
}

/* What needs the rest pose says so until it is there. */
static void check_needs_mesh(ath_file *file, int32_t vertices)
{
    ath_fault_info fault;
    size_t size;
    double *rest = fuzz_memory(3 * (size_t)vertices * sizeof *rest, 0);
    REQUIRE(ath_build(file, rest, 0) == ATH_NEEDS_HOST_MESH && ath_refine(file, 0, rest, 0) == ATH_NEEDS_HOST_MESH
                && ath_level_rest(file, 0, ATH_FILE_ORDER, rest, 3 * sizeof *rest) == ATH_NEEDS_HOST_MESH
                && ath_rest_float64(file, ATH_FILE_ORDER, rest, 3 * sizeof *rest) == ATH_NEEDS_HOST_MESH
                && ath_prepare_start(rest, 0, file, 0, 0, rest, 0) == ATH_NEEDS_HOST_MESH,
            "what needs the rest pose asks for the mesh");
    check_fault(&fault, ath_refine_size(file, 0, &size, &fault));
    free(rest);
}

/* Gives a file that asks for one the host's mesh; 0 where it is not of this file. */
static int give_mesh(ath_file *file)
{
    ath_info info;
    ath_fault_info fault;
    ath_get_info(file, &info);
    if (!info.rest_is_host) return 1;
    if (info.vertex_count > FUZZ_MESH_VERTICES) return 0;
    check_needs_mesh(file, info.vertex_count);
    float *mesh = fuzz_host_mesh((size_t)info.vertex_count);
    REQUIRE(ath_set_host_mesh(file, mesh, 12, info.vertex_count - 1, &fault) == ATH_WRONG_HOST_MESH, "vertices count");
    check_fault(&fault, ATH_WRONG_HOST_MESH);
    int result = ath_set_host_mesh(file, mesh, 12, info.vertex_count, &fault);
    check_fault(&fault, result);
    free(mesh);
    return result == ATH_OK;
}

int fuzz_open(fuzz_file *opened, const uint8_t *bytes, size_t available, const ath_limits *limits, int fill)
{
    size_t front = 0, size = 0;
    ath_fault_info fault;
    int result = ath_front(bytes, available, limits, &front, &size, &fault);
    check_fault(&fault, result);
    if (result == ATH_MISSING) REQUIRE(front > available, "what is missing is more than what is there");
    if (result != ATH_OK) {
        REQUIRE(result == ATH_MISSING || is_refusal(result), "ath_front gives a code of ath.h");
        return 0;
    }
    REQUIRE(front <= available, "a prelude that was accepted is there");
    opened->file = fuzz_memory(size, fill);
    result = ath_open(opened->file, size, bytes, available, limits, &fault);
    check_fault(&fault, result);
    if (result != ATH_OK) {
        REQUIRE(is_refusal(result), "ath_open refuses with an error of the file");
        free(opened->file);
        return 0;
    }
    if (!give_mesh(opened->file)) {
        free(opened->file);
        return 0;
    }
    size_t build = ath_build_size(opened->file);
    opened->memory = size + build;
    opened->layer_count = 0;
    opened->bases = fuzz_memory(build, fill);
    REQUIRE(ath_build(opened->file, opened->bases, build) == ATH_OK, "ath_build takes the size it asked for");
    return 1;
}

void fuzz_close(fuzz_file *opened)
{
    free(opened->file);
    free(opened->bases);
    for (int32_t i = 0; i < opened->layer_count; i++) free(opened->layers[i]);
}

int fuzz_refine(fuzz_file *opened, int32_t level, uint64_t most, int fill)
{
    size_t size, left;
    ath_fault_info fault;
    int result = ath_refine_size(opened->file, level, &size, &fault);
    if (result != ATH_OK) {
        check_fault(&fault, result);
        REQUIRE(result == ATH_MISSING || result == ATH_BAD_CHECKSUM || result == ATH_BAD_CHUNK,
                "refining gives its codes");
        REQUIRE(fault.kind == ATH_REFINED_REST && fault.chunk >= 0, "a refusal names its chunk");
        return 0;
    }
    if (size > most) return 0;
    void *memory = fuzz_memory(size, fill);
    REQUIRE(size == 0 || ath_refine(opened->file, level, memory, size - 1) == ATH_NO_MEMORY, "too little is seen");
    REQUIRE(ath_refine(opened->file, level, memory, size) == ATH_OK, "ath_refine takes the size it asked for");
    REQUIRE(ath_refine_size(opened->file, level, &left, NULL) == ATH_OK && left == 0, "what is built is built");
    if (size > 0)
        opened->layers[opened->layer_count++] = memory;
    else
        free(memory);
    return 1;
}

ath_segment *fuzz_prepare(fuzz_file *opened, int32_t segment, int32_t level, int32_t steps, uint64_t most, int fill)
{
    const ath_file *file = opened->file;
    size_t work_size = ath_work_size(file), size = ath_segment_size(file, level);
    if (work_size > most || size > most || !fuzz_refine(opened, level, most, fill)) return NULL;
    void *work = fuzz_memory(work_size, fill), *memory = fuzz_memory(size, fill);
    int64_t left = ath_prepare_steps(file, segment, level);
    int at_once = steps == INT32_MAX;
    int result = at_once ? ath_prepare(work, work_size, file, segment, level, memory, size)
                         : ath_prepare_start(work, work_size, file, segment, level, memory, size);
    if (result == ATH_OK && !at_once) {
        do {
            REQUIRE(left > 0, "preparing takes no more steps than ath_prepare_steps says");
            result = ath_prepare_step((ath_work *)work, steps);
            left -= steps;
        } while (result == ATH_MORE);
    }
    if (result == ATH_BAD_CHECKSUM || result == ATH_BAD_CHUNK) {
        ath_fault_info fault;
        ath_work_fault(work, &fault);
        check_fault(&fault, result);
        REQUIRE(fault.chunk >= 0, "a refusal names its chunk");
        REQUIRE(ath_prepare_step((ath_work *)work, 1) == ATH_BAD_ARGUMENT, "what was refused cannot go on");
    } else {
        REQUIRE(result == ATH_OK || result == ATH_MISSING, "preparing gives its codes");
    }
    free(work);
    REQUIRE((ath_segment_level(memory) == level) == (result == ATH_OK), "only what was prepared says so");
    REQUIRE((ath_segment_index(memory) == segment) == (result == ATH_OK), "only what was prepared says so");
    if (result == ATH_OK) return memory;
    free(memory);
    return NULL;
}

static int run_to_end(int result, void *work)
{
    return result == ATH_OK ? ath_prepare_step((ath_work *)work, INT32_MAX) : result;
}

void fuzz_go_on(fuzz_file *opened, int32_t segment, int32_t level, int32_t deeper, uint64_t most, int fill)
{
    const ath_file *file = opened->file;
    size_t work_size = ath_work_size(file), size = ath_segment_size(file, level), room = ath_keep_size(file, level);
    size_t deeper_size = ath_segment_size(file, deeper);
    if (room < sizeof(uint64_t) * 2) room = sizeof(uint64_t) * 2;
    if (work_size > most || size > most || deeper_size > most || room > most) return;
    if (!fuzz_refine(opened, deeper, most, fill)) return;
    void *work = fuzz_memory(work_size, fill), *from = fuzz_memory(size, fill), *kept = fuzz_memory(room, fill);
    int result = ath_prepare_start(work, work_size, file, segment, level, from, size);
    if (result == ATH_OK) REQUIRE(ath_keep((ath_work *)work, kept, room) == ATH_OK, "there is room to keep");
    result = run_to_end(result, work);
    if (result == ATH_OK && ath_goes_on(file, from, kept, deeper)) {
        void *memory = fuzz_memory(deeper_size, fill);
        REQUIRE(ath_kept_size(kept) <= room, "what is kept is in its memory");
        result = ath_prepare_onward(work, work_size, file, from, kept, deeper, memory, deeper_size);
        result = run_to_end(result, work);
        ath_segment *alone = fuzz_prepare(opened, segment, deeper, INT32_MAX, most, fill);
        REQUIRE((alone != NULL) == (result == ATH_OK), "going on is refused where preparing is");
        if (alone) REQUIRE(fuzz_same(file, alone, memory), "going on gives what preparing does");
        free(alone);
        free(memory);
    }
    free(kept);
    free(from);
    free(work);
}

void fuzz_prepare_to(fuzz_file *opened, int32_t segment, int32_t level, uint64_t most, int fill)
{
    const ath_file *file = opened->file;
    int32_t start = ath_segment_start(file, segment), stop = ath_segment_start(file, segment + 1);
    size_t work_size = ath_work_size(file), size = ath_segment_size(file, level);
    size_t frame = 3 * (size_t)file->info.vertex_count * (file->info.is_float64 ? sizeof(double) : sizeof(float));
    size_t room = frame * (size_t)(stop - start);
    if (work_size > most || size > most || room > most || !fuzz_refine(opened, level, most, fill)) return;
    void *work = fuzz_memory(work_size, fill), *memory = fuzz_memory(size, fill);
    uint8_t *positions = fuzz_memory(room, fill), *wanted = fuzz_memory(frame, 0);
    int result = ath_prepare_start(work, work_size, file, segment, level, memory, size);
    int gone = result == ATH_OK && ath_prepare_to((ath_work *)work, positions) == ATH_OK;
    result = run_to_end(result, work);
    ath_segment *alone = fuzz_prepare(opened, segment, level, INT32_MAX, most, fill);
    REQUIRE((alone != NULL) == (result == ATH_OK), "where positions go decides nothing");
    if (alone) REQUIRE(fuzz_same(file, alone, memory), "where positions go changes nothing");
    for (int32_t t = start; alone && gone && t < stop; t++) {
        if (file->info.is_float64)
            ath_positions_float64(file, (const ath_segment **)&alone, 1, t, ATH_SOURCE_ORDER, (void *)wanted, 24);
        else
            ath_positions(file, (const ath_segment **)&alone, 1, t, ATH_SOURCE_ORDER, (void *)wanted, 12);
        REQUIRE(memcmp(wanted, positions + frame * (size_t)(t - start), frame) == 0, "positions are the caller's");
    }
    free(alone);
    free(wanted);
    free(positions);
    free(memory);
    free(work);
}

int fuzz_same(const ath_file *file, const ath_segment *a, const ath_segment *b)
{
    size_t vertices = (size_t)file->info.vertex_count, size = 3 * vertices * sizeof(double);
    double *first = fuzz_memory(size, 0), *second = fuzz_memory(size, 0xff);
    int32_t start = ath_segment_start(file, a->index), stop = ath_segment_start(file, a->index + 1);
    int same = 1;
    for (int32_t t = start; t < stop && same; t++) {
        REQUIRE(ath_positions_float64(file, &a, 1, t, ATH_SOURCE_ORDER, first, 3 * sizeof(double)) == ATH_OK,
                "it plays");
        REQUIRE(ath_positions_float64(file, &b, 1, t, ATH_SOURCE_ORDER, second, 3 * sizeof(double)) == ATH_OK,
                "it plays");
        same = memcmp(first, second, size) == 0;
    }
    free(first);
    free(second);
    return same;
}
