/* Times the decoder for decode.py, which says what is measured and why. One thread, no Python in any loop.
 * Prints one JSON object. Hosted C11 over ath.h alone. Judges nothing.
 *
 *     decode FILE.ath once              one whole decode, the second of this process
 *     decode FILE.ath all ROUNDS SEEKS  the rest: medians over ROUNDS, and one round before them */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "ath.h"

enum { LEVELS = 32 };

static const double BETWEEN = 0.37; /* Part of the way to the next frame, so that a blend is shown. */

typedef struct {
    uint8_t *bytes;
    size_t size, open_bytes, build_bytes, work_bytes;
    ath_file *file;
    ath_info info;
    void *work;
} opened;

typedef struct {
    ath_segment **segments;
    float *matrices, *exact;
    double *prepare_ms, *frames_ms, *positions_us, *matrices_us; /* one per round */
    uint32_t crc;
} level_run;

/* ---- helpers ---- */

static void *memory_of(size_t size)
{
    void *memory = aligned_alloc(64, (size + 64) & ~(size_t)63);
    if (!memory) {
        fprintf(stderr, "memory: got none, expected %zu bytes\n", size);
        exit(1);
    }
    return memory;
}

static void expect_ok(const char *what, int result)
{
    if (result == ATH_OK) return;
    fprintf(stderr, "%s: got %s, expected OK\n", what, ath_result_name(result));
    exit(1);
}

static void expect_no_fault(const char *what, int result, const ath_fault_info *fault)
{
    char text[ATH_FAULT_TEXT];
    if (result == ATH_OK) return;
    ath_fault_text(fault, text, sizeof text);
    fprintf(stderr, "%s: %s: %s\n", what, ath_result_name(result), text);
    exit(1);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Builds what the layers of precision up to a level share; its bytes, which stay as long as the file. */
static size_t refine(ath_file *file, int32_t level)
{
    size_t size;
    ath_fault_info fault;
    expect_no_fault("ath_refine_size", ath_refine_size(file, level, &size, &fault), &fault);
    expect_ok("ath_refine", ath_refine(file, level, size > 0 ? memory_of(size) : NULL, size));
    return size;
}

/* The value below which `share` of them lie; sorts them. */
static double quantile(double *values, int count, double share)
{
    qsort(values, (size_t)count, sizeof *values, ascending);
    int at = (int)ceil(share * count) - 1;
    return values[at < 0 ? 0 : at];
}

/* Processor time of this process. */
static double now_ms(void) { return (double)clock() * 1e3 / CLOCKS_PER_SEC; }

static double *figures(int count) { return (double *)memory_of((size_t)count * sizeof(double)); }

static double median(double *values, int count) { return quantile(values, count, 0.5); }

/* One name and number of a JSON object, behind what opens it or separates them. */
static void put(const char *before, const char *name, double number)
{
    printf("%s\"%s\": %.15g", before, name, number);
}

/* ---- opening ---- */

static void read_file(const char *path, opened *clip)
{
    FILE *stream = fopen(path, "rb");
    long size = -1;
    if (stream && fseek(stream, 0, SEEK_END) == 0) size = ftell(stream);
    if (size >= 0) {
        clip->size = (size_t)size;
        clip->bytes = (uint8_t *)memory_of(clip->size);
        rewind(stream);
    }
    if (size < 0 || fread(clip->bytes, 1, clip->size, stream) != clip->size) {
        fprintf(stderr, "%s: cannot be read\n", path);
        exit(1);
    }
    fclose(stream);
}

/* Opens the bytes in memory of its own, as a player does once per file. */
static void open_and_build(opened *clip)
{
    size_t front;
    ath_fault_info fault;
    expect_no_fault("ath_front", ath_front(clip->bytes, clip->size, 0, &front, &clip->open_bytes, &fault), &fault);
    clip->file = (ath_file *)memory_of(clip->open_bytes);
    expect_no_fault("ath_open", ath_open(clip->file, clip->open_bytes, clip->bytes, clip->size, 0, &fault), &fault);
    clip->build_bytes = ath_build_size(clip->file);
    expect_ok("ath_build", ath_build(clip->file, memory_of(clip->build_bytes), clip->build_bytes));
    ath_get_info(clip->file, &clip->info);
    clip->build_bytes += refine(clip->file, clip->info.level_count - 1);
    clip->work_bytes = ath_work_size(clip->file);
    clip->work = memory_of(clip->work_bytes);
}

/* ---- decoding ---- */

static void prepare(const opened *clip, int32_t segment, int32_t level, ath_segment *memory)
{
    size_t size = ath_segment_size(clip->file, level);
    int result = ath_prepare(clip->work, clip->work_bytes, clip->file, segment, level, memory, size);
    expect_ok("ath_prepare", result);
}

static void write_frame(const opened *clip, ath_segment *const *segments, int32_t count, double frame, ath_order order,
                        float *xyz)
{
    const ath_segment *const *given = (const ath_segment *const *)segments;
    expect_ok("ath_positions", ath_positions(clip->file, given, count, frame, order, xyz, 3 * sizeof(float)));
}

static void write_matrices(const opened *clip, ath_segment *const *segments, double frame, float *matrices,
                           float *exact)
{
    const ath_segment *const *given = (const ath_segment *const *)segments;
    int32_t count = clip->info.segment_count;
    expect_ok("ath_matrices", ath_matrices(clip->file, given, count, frame, matrices, 12 * sizeof(float)));
    expect_ok("ath_exact", ath_exact(clip->file, given, count, frame, exact, 3 * sizeof(float)));
}

static size_t frame_floats(const opened *clip) { return 3 * (size_t)clip->info.vertex_count; }

/* All frames of a segment in the source's order, at once where that can be. */
static void decode_segment(const opened *clip, int32_t s, ath_segment *segment, float *out)
{
    int32_t first = ath_segment_start(clip->file, s), stop = ath_segment_start(clip->file, s + 1);
    int32_t level = clip->info.level_count - 1;
    ath_work *work = (ath_work *)clip->work;
    expect_ok("ath_prepare_start", ath_prepare_start(work, clip->work_bytes, clip->file, s, level, segment,
                                                     ath_segment_size(clip->file, level)));
    int is_there = !clip->info.is_float64 && ath_prepare_to(work, out + (size_t)first * frame_floats(clip)) == ATH_OK;
    expect_ok("ath_prepare_step", ath_prepare_step(work, INT32_MAX));
    for (int32_t t = first; t < stop && !is_there; t++)
        write_frame(clip, &segment, 1, (double)t, ATH_SOURCE_ORDER, out + (size_t)t * frame_floats(clip));
}

/* Segment by segment in one segment's memory. */
static void decode_all(const opened *clip, ath_segment *segment, float *out)
{
    for (int32_t s = 0; s < clip->info.segment_count; s++) decode_segment(clip, s, segment, out);
}

static uint32_t crc_of(const opened *clip, const float *frames)
{
    size_t bytes = (size_t)clip->info.frame_count * frame_floats(clip) * sizeof(float);
    return ath_crc32c(0, (const uint8_t *)frames, bytes);
}

/* The result's memory has been written before. */
static void once(opened *clip)
{
    size_t bytes = (size_t)clip->info.frame_count * frame_floats(clip) * sizeof(float);
    ath_segment *segment = (ath_segment *)memory_of(ath_segment_size(clip->file, clip->info.level_count - 1));
    float *out = (float *)memory_of(bytes);
    decode_all(clip, segment, out);
    double start = now_ms();
    open_and_build(clip);
    double middle = now_ms();
    decode_all(clip, segment, out);
    double stop = now_ms();
    put("{", "decode_ms", stop - middle);
    put(", ", "opening_ms", middle - start);
    printf("}\n");
}

/* ---- levels ---- */

static void ready_level(const opened *clip, int32_t level, int rounds, level_run *run)
{
    int32_t nodes, vertices, count = clip->info.segment_count;
    ath_cut_size(clip->file, level, 0, &nodes, &vertices);
    run->segments = (ath_segment **)memory_of((size_t)count * sizeof *run->segments);
    for (int32_t s = 0; s < count; s++)
        run->segments[s] = (ath_segment *)memory_of(ath_segment_size(clip->file, level));
    run->matrices = (float *)memory_of(12 * (size_t)nodes * sizeof(float));
    run->exact = (float *)memory_of(3 * (size_t)vertices * sizeof(float));
    run->prepare_ms = figures(rounds + 1);
    run->frames_ms = figures(rounds + 1);
    run->positions_us = figures(rounds + 1);
    run->matrices_us = figures(rounds + 1);
}

static void measure_level(const opened *clip, int32_t level, int round, level_run *run, float *xyz)
{
    int32_t segments = clip->info.segment_count, frames = clip->info.frame_count;
    double start = now_ms();
    for (int32_t s = 0; s < segments; s++) prepare(clip, s, level, run->segments[s]);
    double prepared = now_ms();
    for (int32_t t = 0; t < frames; t++)
        write_frame(clip, run->segments, segments, t, ATH_SOURCE_ORDER, xyz + (size_t)t * frame_floats(clip));
    double written = now_ms();
    if (round == 0) run->crc = crc_of(clip, xyz);
    double playing = now_ms();
    for (int32_t t = 0; t < frames; t++) write_frame(clip, run->segments, segments, t + BETWEEN, ATH_FILE_ORDER, xyz);
    double played = now_ms();
    for (int32_t t = 0; t < frames; t++) write_matrices(clip, run->segments, t + BETWEEN, run->matrices, run->exact);
    double skinned = now_ms();
    run->prepare_ms[round] = prepared - start;
    run->frames_ms[round] = written - prepared;
    run->positions_us[round] = (played - playing) * 1e3 / frames;
    run->matrices_us[round] = (skinned - played) * 1e3 / frames;
}

/* Bytes that a reader fetches to show a level of the whole clip. */
static uint64_t level_bytes(const opened *clip, int32_t level)
{
    const ath_file *file = clip->file;
    int32_t last = clip->info.segment_count - 1, count = ath_ranges(file, level, 0, last, 1, 0, 0);
    ath_range *ranges = (ath_range *)memory_of((size_t)count * sizeof *ranges);
    uint64_t bytes = clip->info.prelude_length;
    ath_ranges(file, level, 0, last, 1, ranges, count);
    for (int32_t i = 0; i < count; i++) bytes += ranges[i].size;
    free(ranges);
    return bytes;
}

static void print_level(const opened *clip, int32_t level, int rounds, const level_run *run)
{
    int32_t nodes, vertices;
    ath_cut_size(clip->file, level, 0, &nodes, &vertices);
    put(level ? ",\n  {" : "\n  {", "level", level);
    put(", ", "nodes", nodes);
    put(", ", "exact_vertices", vertices);
    put(", ", "bytes", (double)level_bytes(clip, level));
    put(", ", "segment_bytes", (double)ath_segment_size(clip->file, level));
    put(",\n   ", "prepare_ms", median(run->prepare_ms + 1, rounds));
    put(", ", "frames_ms", median(run->frames_ms + 1, rounds));
    put(", ", "positions_us", median(run->positions_us + 1, rounds));
    put(", ", "matrices_us", median(run->matrices_us + 1, rounds));
    put(", ", "crc", run->crc);
    printf("}");
}

static void measure_levels(const opened *clip, int rounds, level_run *runs)
{
    int32_t levels = clip->info.level_count;
    float *xyz = (float *)memory_of((size_t)clip->info.frame_count * frame_floats(clip) * sizeof(float));
    for (int32_t level = 0; level < levels; level++) ready_level(clip, level, rounds, runs + level);
    for (int round = 0; round <= rounds; round++)
        for (int32_t level = 0; level < levels; level++) measure_level(clip, level, round, runs + level, xyz);
    printf(",\n \"levels\": [");
    for (int32_t level = 0; level < levels; level++) print_level(clip, level, rounds, runs + level);
    printf("]");
    free(xyz);
}

/* ---- going on ---- */

/* A level of all vertices and one that goes on from it. */
typedef struct {
    int32_t from, to;
    ath_segment *before, *after;
    uint8_t *kept;
    size_t room, kept_bytes;                  /* the latter of all segments */
    double *keeping_ms, *onward_ms, *anew_ms; /* Times of all segments, one per round. */
} pair_run;

static void ready_pair(const opened *clip, int rounds, pair_run *run)
{
    run->before = (ath_segment *)memory_of(ath_segment_size(clip->file, run->from));
    run->after = (ath_segment *)memory_of(ath_segment_size(clip->file, run->to));
    run->room = ath_keep_size(clip->file, run->from) + 16;
    run->kept = (uint8_t *)memory_of(run->room);
    run->keeping_ms = figures(rounds + 1);
    run->onward_ms = figures(rounds + 1);
    run->anew_ms = figures(rounds + 1);
}

static void finish_pair(pair_run *run)
{
    free(run->before);
    free(run->after);
    free(run->kept);
    free(run->keeping_ms);
    free(run->onward_ms);
    free(run->anew_ms);
}

static void prepare_and_keep(const opened *clip, int32_t segment, const pair_run *run)
{
    ath_work *work = (ath_work *)clip->work;
    size_t size = ath_segment_size(clip->file, run->from);
    expect_ok("ath_prepare_start",
              ath_prepare_start(work, clip->work_bytes, clip->file, segment, run->from, run->before, size));
    expect_ok("ath_keep", ath_keep(work, run->kept, run->room));
    expect_ok("ath_prepare_step", ath_prepare_step(work, INT32_MAX));
}

static void go_on(const opened *clip, const pair_run *run)
{
    ath_work *work = (ath_work *)clip->work;
    size_t size = ath_segment_size(clip->file, run->to);
    expect_ok("ath_prepare_onward", ath_prepare_onward(work, clip->work_bytes, clip->file, run->before, run->kept,
                                                       run->to, run->after, size));
    expect_ok("ath_prepare_step", ath_prepare_step(work, INT32_MAX));
}

static void measure_pair(const opened *clip, int round, pair_run *run)
{
    run->kept_bytes = 0;
    run->keeping_ms[round] = run->onward_ms[round] = run->anew_ms[round] = 0.0;
    for (int32_t s = 0; s < clip->info.segment_count; s++) {
        double start = now_ms();
        prepare_and_keep(clip, s, run);
        double before = now_ms();
        go_on(clip, run);
        double after = now_ms();
        prepare(clip, s, run->to, run->after);
        run->anew_ms[round] += now_ms() - after;
        run->onward_ms[round] += after - before;
        run->keeping_ms[round] += before - start;
        run->kept_bytes += ath_kept_size(run->kept);
    }
}

static void print_pair(const pair_run *run, int rounds)
{
    put("\n  {", "from", run->from);
    put(", ", "to", run->to);
    put(", ", "keeping_ms", median(run->keeping_ms + 1, rounds));
    put(", ", "onward_ms", median(run->onward_ms + 1, rounds));
    put(", ", "anew_ms", median(run->anew_ms + 1, rounds));
    put(", ", "kept_bytes", (double)run->kept_bytes);
    printf("}");
}

static void measure_onward(const opened *clip, int rounds)
{
    int32_t first = clip->info.depth_levels - 1, levels = clip->info.level_count;
    printf(",\n \"onward\": [");
    for (int32_t from = first; from < levels - 1; from++)
        for (int32_t to = from + 1; to < levels; to++) {
            pair_run run = {.from = from, .to = to};
            ready_pair(clip, rounds, &run);
            for (int round = 0; round <= rounds; round++) measure_pair(clip, round, &run);
            if (to > first + 1) printf(",");
            print_pair(&run, rounds);
            finish_pair(&run);
        }
    printf("]");
}

/* ---- seeking ---- */

/* Draws frames that are equal in every run and on every machine. */
static int32_t random_frame(uint64_t *state, int32_t frames)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (int32_t)((*state >> 33) % (uint64_t)frames);
}

static void measure_seeks(const opened *clip, int seeks)
{
    int32_t deepest = clip->info.level_count - 1;
    ath_segment *segment = (ath_segment *)memory_of(ath_segment_size(clip->file, deepest));
    float *xyz = (float *)memory_of(frame_floats(clip) * sizeof(float));
    double *whole = figures(seeks);
    uint64_t state = 1;
    for (int i = 0; i < seeks; i++) {
        int32_t frame = random_frame(&state, clip->info.frame_count);
        double start = now_ms();
        prepare(clip, ath_segment_of(clip->file, frame), deepest, segment);
        write_frame(clip, &segment, 1, (double)frame, ATH_SOURCE_ORDER, xyz);
        whole[i] = now_ms() - start;
    }
    put(",\n \"seeks\": {", "median_ms", quantile(whole, seeks, 0.5));
    put(", ", "p99_ms", quantile(whole, seeks, 0.99));
    printf("}");
}

/* ---- everything ---- */

static int32_t longest_segment(const ath_file *file, int32_t segments)
{
    int32_t longest = 0;
    for (int32_t s = 0; s < segments; s++) {
        int32_t frames = ath_segment_start(file, s + 1) - ath_segment_start(file, s);
        if (frames > longest) longest = frames;
    }
    return longest;
}

static void print_facts(const opened *clip)
{
    put("{", "vertices", clip->info.vertex_count);
    put(", ", "frames", clip->info.frame_count);
    put(", ", "segments", clip->info.segment_count);
    put(", ", "longest_segment", longest_segment(clip->file, clip->info.segment_count));
    put(",\n ", "file_bytes", (double)clip->size);
    put(", ", "opened_bytes", (double)clip->open_bytes);
    put(", ", "bases_bytes", (double)clip->build_bytes);
    put(", ", "work_bytes", (double)clip->work_bytes);
}

/* Prints one JSON object: facts on the file, and the times of its levels, of going on to deeper ones, and of seeks. */
static void all(opened *clip, int rounds, int seeks)
{
    level_run runs[LEVELS];
    print_facts(clip);
    measure_levels(clip, rounds, runs);
    measure_onward(clip, rounds);
    measure_seeks(clip, seeks);
    printf("}\n");
}

int main(int argc, char **argv)
{
    opened clip;
    if (argc < 3 || (strcmp(argv[2], "once") != 0 && (strcmp(argv[2], "all") != 0 || argc != 5))) {
        fprintf(stderr, "usage: decode FILE.ath once | all ROUNDS SEEKS\n");
        return 2;
    }
    read_file(argv[1], &clip);
    open_and_build(&clip);
    if (strcmp(argv[2], "once") == 0)
        once(&clip);
    else
        all(&clip, atoi(argv[3]), atoi(argv[4]));
    return 0;
}
