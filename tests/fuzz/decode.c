/* Fuzz target: a whole decoder in use. The last bytes of an input say which limits it has, how much of the file is
 * there, and in which order bytes come and go while segments are prepared and played. */
#include "harness.h"

enum { MOST_MEMORY = 8 << 20, HELD = 3, CALLS = 12 };

typedef struct {
    fuzz_file *opened;
    const ath_file *file;
    ath_info info;
    const ath_segment *held[HELD + 1]; /* the last is the one in preparation, which is to be passed over */
    const uint8_t *bytes;
    size_t size;
    void *work, *memory; /* of the preparation that is under way, if any */
} user;

static void prepare(user *u, int32_t argument)
{
    int32_t level = argument % u->info.level_count, segment = argument / 3 % u->info.segment_count;
    ath_segment *made = fuzz_prepare(u->opened, segment, level, 1 + argument, MOST_MEMORY, argument);
    free((void *)(uintptr_t)u->held[argument % HELD]);
    u->held[argument % HELD] = made;
}

static void refine_shown(user *u, int32_t argument)
{
    int32_t least = u->info.depth_levels - 1, levels = u->info.level_count - least;
    if (levels < 2) return;
    int32_t level = least + argument % (levels - 1),
            deeper = level + 1 + argument / 8 % (u->info.level_count - 1 - level);
    fuzz_go_on(u->opened, argument / 3 % u->info.segment_count, level, deeper, MOST_MEMORY, argument);
}

static void prepare_to(user *u, int32_t argument)
{
    int32_t level = u->info.level_count - 1 - argument % 4 % u->info.level_count;
    fuzz_prepare_to(u->opened, argument / 4 % u->info.segment_count, level, MOST_MEMORY, argument);
}

static void feed_or_drop(user *u, int32_t argument)
{
    size_t at = u->size * (size_t)(argument & 15) / 16, size = (u->size - at) * (size_t)(argument >> 4 & 7) / 7;
    if (argument & 128)
        ath_drop((ath_file *)(uintptr_t)u->file, at, size);
    else
        ath_feed((ath_file *)(uintptr_t)u->file, u->bytes + at, at, size);
}

static void abandon(user *u)
{
    free(u->work);
    free(u->memory);
    u->work = u->memory = NULL;
    u->held[HELD] = NULL;
}

/* Begins a preparation that later calls take on, or never. */
static void begin(user *u, int32_t argument)
{
    int32_t level = argument % u->info.level_count, segment = argument / 5 % u->info.segment_count;
    size_t work_size = ath_work_size(u->file), size = ath_segment_size(u->file, level);
    abandon(u);
    if (work_size > MOST_MEMORY || size > MOST_MEMORY || !fuzz_refine(u->opened, level, MOST_MEMORY, 0xff)) return;
    u->work = fuzz_memory(work_size, 0xff);
    u->memory = fuzz_memory(size, 0xff);
    if (ath_prepare_start(u->work, work_size, u->file, segment, level, u->memory, size) != ATH_OK) abandon(u);
    u->held[HELD] = (const ath_segment *)u->memory;
}

/* The bytes of a preparation that is under way stay fed: what reads them here is a copy of the file that stays. */
static void go_on(user *u, int32_t argument)
{
    if (u->work && ath_prepare_step((ath_work *)u->work, argument) != ATH_MORE) abandon(u);
}

static double place(const user *u, int32_t argument)
{
    static const double odd[4] = {-1.0, 1e300, 0.0, 1e-300};
    argument &= 255;
    if (argument >= 252) return odd[argument - 252];
    int32_t clip = argument % u->info.clip_count;
    double seconds = ath_clips(u->file)[clip].duration * argument / 100.0;
    double frame = ath_frame_at(u->file, clip, seconds, (ath_wrap)(argument % 4));
    int32_t first = ath_clips(u->file)[clip].first_frame;
    REQUIRE(frame >= first && frame < first + ath_clips(u->file)[clip].frame_count, "a time is within its clip");
    return frame;
}

static void play(user *u, int32_t argument, int is_float64)
{
    size_t vertices = (size_t)u->info.vertex_count, number = is_float64 ? sizeof(double) : sizeof(float);
    size_t stride = (size_t)(3 + argument % 2) * number;
    ath_order order = argument & 4 ? ATH_SOURCE_ORDER : ATH_FILE_ORDER;
    double at = place(u, argument);
    void *out = fuzz_memory(vertices * stride, 0);
    int result = is_float64 ? ath_positions_float64(u->file, u->held, HELD + 1, at, order, out, stride)
                            : ath_positions(u->file, u->held, HELD + 1, at, order, out, stride);
    REQUIRE(result == ATH_OK || result == ATH_HELD || result == ATH_NOT_PREPARED, "playing gives its codes");
    free(out);
}

static void show_parts(user *u, int32_t argument, int is_float64)
{
    double at = place(u, argument);
    int32_t level = ath_shown_level(u->file, u->held, HELD + 1, at), parts, nodes, exact;
    if (level < 0) return;
    ath_cut_size(u->file, level, &parts, &nodes, &exact);
    size_t number = is_float64 ? sizeof(double) : sizeof(float);
    void *matrices = fuzz_memory((size_t)nodes * 12 * number, 0), *stems = fuzz_memory((size_t)exact * 3 * number, 0);
    ath_part *cut = fuzz_memory((size_t)parts * sizeof *cut, 0);
    ath_cut(u->file, level, cut);
    int32_t next = 0;
    for (int32_t i = 0; i < parts; i++) {
        REQUIRE(cut[i].first == next && cut[i].count > 0, "parts ascend and leave nothing out");
        next += cut[i].count;
    }
    REQUIRE(next == u->info.place_count, "parts hold every place");
    if (is_float64) {
        ath_matrices_float64(u->file, u->held, HELD + 1, at, matrices, 12 * number);
        ath_exact_float64(u->file, u->held, HELD + 1, at, stems, 3 * number);
    } else {
        ath_matrices(u->file, u->held, HELD + 1, at, matrices, 12 * number);
        ath_exact(u->file, u->held, HELD + 1, at, stems, 3 * number);
    }
    free(cut);
    free(stems);
    free(matrices);
}

static void ask(user *u, int32_t argument)
{
    int32_t level = argument % u->info.level_count, segment = argument % u->info.segment_count;
    int32_t count = ath_ranges(u->file, level, 0, segment, argument & 1, NULL, 0);
    ath_range *ranges = fuzz_memory((size_t)count * sizeof *ranges, 0);
    REQUIRE(ath_ranges(u->file, level, 0, segment, argument & 1, ranges, count) == count, "ranges are counted alike");
    for (int32_t i = 0; i < count; i++)
        REQUIRE(ranges[i].size > 0 && ranges[i].offset + ranges[i].size <= u->info.file_length
                    && (i == 0 || ranges[i].offset > ranges[i - 1].offset + ranges[i - 1].size),
                "ranges ascend");
    free(ranges);
    int32_t ready = ath_ready_level(u->file, segment);
    REQUIRE(ready >= -1 && ready < u->info.level_count, "a ready level is one of the file's");
    if (ready >= 0)
        REQUIRE(ath_ranges(u->file, ready, segment, segment, 0, NULL, 0) == 0, "what is ready lacks nothing");
    ath_measure measure = (ath_measure)(argument % ATH_MEASURES);
    REQUIRE(ath_level_error(u->file, level, argument & 2 ? segment : 0, segment, measure) >= 0.0, "errors are lengths");
    level =
        ath_level_for(u->file, argument & 4 ? segment : 0, segment, measure, argument, 0.02 * argument, 1080.0, 1.0);
    REQUIRE(level >= 0 && level < u->info.level_count, "a distance asks for a level that there is");
    for (int32_t i = 0; i < u->info.chunk_count; i += 1 + argument) ath_check_chunk(u->file, i, NULL);
    int32_t last = u->info.place_count - 1;
    REQUIRE(ath_vertex_source(u->file)[last] < u->info.vertex_count, "vertices are those of the source");
    REQUIRE(ath_branch_source(u->file)[u->info.branch_count - 1] < u->info.branch_count, "so are branches");
    const ath_clip *clip = ath_clips(u->file) + argument % u->info.clip_count;
    const double *times = ath_times(u->file) + clip->first_frame;
    REQUIRE(ath_branches(u->file)[0].parent == -1, "the first branch is a root");
    REQUIRE(times[0] <= times[clip->frame_count - 1], "times ascend");
    REQUIRE(ath_clip_named(u->file, clip->name) == argument % u->info.clip_count, "a clip is found by its name");
    REQUIRE(ath_seam_error(u->file, argument % u->info.clip_count, level) >= 0.0, "seams have errors");
}

/* Memory that is too small or not aligned, and levels and segments that there are not. */
static int refuses(const user *u, void *work, size_t work_size, int32_t segment, int32_t level, void *memory,
                   size_t size, int expected)
{
    return ath_prepare_start(work, work_size, u->file, segment, level, memory, size) == expected;
}

static void misuse(user *u, int32_t argument)
{
    size_t work_size = ath_work_size(u->file), size = ath_segment_size(u->file, 0), less = 1 + (size_t)argument;
    if (work_size > MOST_MEMORY || size > MOST_MEMORY) return;
    uint8_t *work = fuzz_memory(work_size + 1, 0), *memory = fuzz_memory(size, 0);
    int32_t segments = u->info.segment_count, levels = u->info.level_count;
    REQUIRE(refuses(u, work, work_size - less, 0, 0, memory, size, ATH_NO_MEMORY), "too little is seen");
    REQUIRE(refuses(u, work + 1, work_size, 0, 0, memory, size, ATH_NO_MEMORY), "alignment is seen");
    REQUIRE(refuses(u, work, work_size, 0, 0, memory, size - 1, ATH_NO_MEMORY), "too little is seen");
    REQUIRE(refuses(u, work, work_size, segments, 0, memory, size, ATH_BAD_ARGUMENT), "no such segment");
    REQUIRE(refuses(u, work, work_size, -1, 0, memory, size, ATH_BAD_ARGUMENT), "no such segment");
    REQUIRE(refuses(u, work, work_size, 0, levels, memory, size, ATH_BAD_ARGUMENT), "no such level");
    REQUIRE(ath_build((ath_file *)(uintptr_t)u->file, memory, 0) == ATH_NO_MEMORY, "too little is seen");
    size = size < 64 ? size : 64;
    REQUIRE(ath_open(memory, size, u->bytes, u->size, NULL, NULL) == ATH_NO_MEMORY, "too little is seen");
    free(work);
    free(memory);
    for (int32_t result = -1; result < 72; result += 1 + argument % 3)
        REQUIRE(ath_result_name(result)[0] != 0, "every result has a name");
}

static void rest(user *u, int32_t argument)
{
    size_t vertices = (size_t)u->info.vertex_count;
    double *doubles = fuzz_memory(3 * vertices * sizeof *doubles, 0);
    float *floats = fuzz_memory(3 * vertices * sizeof *floats, 0);
    ath_read_rest(u->file, NULL);
    ath_rest_float64(u->file, argument & 1 ? ATH_SOURCE_ORDER : ATH_FILE_ORDER, doubles, 3 * sizeof *doubles);
    ath_rest(u->file, argument & 1 ? ATH_SOURCE_ORDER : ATH_FILE_ORDER, floats, 3 * sizeof *floats);
    for (size_t i = 0; i < 3 * vertices; i++)
        REQUIRE(floats[i] == (float)doubles[i] || doubles[i] != doubles[i], "both widths hold the same rest pose");
    int32_t level = argument % u->info.level_count;
    int result = ath_level_rest(u->file, level, ATH_FILE_ORDER, doubles, 3 * sizeof *doubles);
    int is_first = ath_file_stage(u->file, level) == 0; /* other poses are those of layers, which may not be read yet */
    REQUIRE(result == ATH_OK || (result == ATH_BAD_ARGUMENT && !is_first), "levels have a rest pose");
    REQUIRE(ath_level_rest(u->file, u->info.level_count, ATH_FILE_ORDER, doubles, 3 * sizeof *doubles)
                == ATH_BAD_ARGUMENT,
            "no such level");
    free(floats);
    free(doubles);
}

static void call(user *u, int32_t which, int32_t argument)
{
    if (which == 0) prepare(u, argument);
    if (which == 1 && !u->work) feed_or_drop(u, argument);
    if (which == 2) begin(u, argument);
    if (which == 3) go_on(u, argument);
    if (which == 4 || which == 5) play(u, argument, which == 5);
    if (which == 6) show_parts(u, argument, argument & 1);
    if (which == 7) ask(u, argument);
    if (which == 8) rest(u, argument);
    if (which == 9) misuse(u, argument);
    if (which == 10) refine_shown(u, argument);
    if (which == 11) prepare_to(u, argument);
}

static void use(fuzz_file *opened, const uint8_t *bytes, size_t size, const uint8_t *options)
{
    user u;
    memset(&u, 0, sizeof u);
    u.opened = opened;
    u.file = opened->file;
    u.bytes = bytes;
    u.size = size;
    ath_get_info(u.file, &u.info);
    for (int32_t i = 3; i + 1 < OPTIONS; i += 2) call(&u, options[i] % CALLS, options[i + 1]);
    for (int32_t level = 0; level < u.info.level_count; level++) {
        prepare(&u, level * 7 + options[3]);
        play(&u, options[4] + level, level & 1);
        show_parts(&u, options[5], level & 1);
        refine_shown(&u, level + options[3]);
        prepare_to(&u, level);
    }
    abandon(&u);
    for (int32_t i = 0; i < HELD; i++) free((void *)(uintptr_t)u.held[i]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < OPTIONS) return 0;
    const uint8_t *options = data + size - OPTIONS;
    ath_limits limits = fuzz_limits((uint64_t)1 << (14 + options[1] % 8));
    fuzz_file opened;
    uint8_t *file = fuzz_copy(data, size - OPTIONS);
    if (options[0] & 3) fuzz_repair(file, size - OPTIONS);
    size_t there = size - OPTIONS, least = there, memory;
    if (options[0] & 4 && ath_front(file, there, &limits, &least, &memory, NULL) == ATH_OK) there = least;
    if (fuzz_open(&opened, file, there, &limits, options[2])) {
        use(&opened, file, size - OPTIONS, options);
        fuzz_close(&opened);
    }
    free(file);
    return 0;
}
