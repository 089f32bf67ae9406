/* Plays a forest for forest.py, which says what is measured and why. One thread, all files in memory, of which a
 * decoder is fed only what it asks for. Prints one JSON object. C11 and POSIX over ath.h alone. Judges nothing.
 *
 *     forest units ROUNDS FILE.ath...       what one preparation, pose and choice of level costs: medians over ROUNDS
 *     forest play SCENE SECONDS RATE        all instances of a scene, at RATE pictures a second
 *
 * A scene is text: the number of phases; that of clips, and a path for each; that of instances, and for each its clip,
 * distance and phase. */
#define _POSIX_C_SOURCE 200112L /* clock_gettime */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "program.h"

enum { LEVELS = 32, SLOTS = 3, MOTION = 16, STATIC = 32, SHAPES = 19, UNIT_POSES = 64, CHOICES = 4096 };

static const double FOV = 1.0471975511965976, SCREEN = 1080.0, PIXELS = 1.0; /* vertical; radians, pixels */
static const double GOLDEN = 0.6180339887498949;
static const double HASTE = 1.25; /* preparations go on so much faster than they have to */
static const double ALIKE = 1.25; /* a deeper level in use whose segments are at most so much larger is shown instead */

/* A clip, at each level in use with the segment that plays, the one before and the one behind it. It has the file to
 * itself and all of its segments; clips that share a file would share `file` and have some each. */
typedef struct {
    uint8_t *bytes;
    size_t size, memory; /* memory: of the file and what its segments share */
    ath_file *file;
    ath_info info;
    int32_t frame, segment;                  /* that play: the later one of those that are blended */
    int32_t shortest;                        /* frames of the shortest segment */
    long number;                             /* of the segment that plays, counted on from loop to loop */
    double ahead, loop;                      /* seconds that the clip is ahead of the clock; of one round */
    int32_t refined;                         /* the deepest level whose layers of precision are built */
    int32_t nodes[LEVELS], vertices[LEVELS]; /* of a level: matrices, exact vertices */
    double from[LEVELS];                     /* the distance from which a level will do */
    int32_t effort[LEVELS];                  /* of a step of preparing it, about */
    int32_t shown_as[LEVELS];                /* the level that is shown where it will do */
    int used[LEVELS];
    ath_segment *slots[LEVELS][SLOTS];
} clip;

typedef struct {
    int32_t clip, phase;
    double distance;
} instance;
typedef struct {
    int32_t clip, level, phase;
    size_t at;
} pose; /* at: in floats */
typedef struct {
    clip *of;
    int32_t level, segment;
    long number;
} job;

typedef struct {
    clip *clips;
    instance *instances;
    pose *poses;
    job *jobs;        /* a ring, oldest first */
    int32_t *pose_of; /* by clip, level and phase; -1: nobody shows it */
    int32_t *shown;   /* the pose of each instance in this picture */
    int32_t clip_count, instance_count, pose_count, phases;
    int32_t job_count, first_job, job_room, steps_left;
    int64_t effort_per_picture;
    int begun; /* the first job has been */
    void *work;
    size_t work_bytes;
    float *floats;
    double fed;
    long held, late;
} forest;

/* ---- helpers ---- */

/* Of this thread's processor: what else the machine has to do does not count. */
static double now_ms(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec * 1e3 + (double)time.tv_nsec * 1e-6;
}

static void expect(int condition, const char *what)
{
    if (condition) return;
    fprintf(stderr, "forest: %s\n", what);
    exit(1);
}

static void put(const char *before, const char *name, double number)
{
    printf("%s\"%s\": %.15g", before, name, number);
}

/* ---- clips ---- */

static void read_file(const char *path, clip *clip)
{
    FILE *stream = fopen(path, "rb");
    expect(stream && fseek(stream, 0, SEEK_END) == 0, path);
    clip->size = (size_t)ftell(stream);
    clip->bytes = (uint8_t *)memory_of(clip->size);
    rewind(stream);
    expect(fread(clip->bytes, 1, clip->size, stream) == clip->size, path);
    fclose(stream);
}

/* What is asked for in every picture. */
static void note_levels(clip *clip)
{
    double pixels_per_unit = SCREEN / (2.0 * tan(FOV / 2.0)); /* from a distance of 1 */
    for (int32_t level = 0; level < clip->info.level_count; level++) {
        double error = ath_level_error(clip->file, level, 0, clip->info.segment_count - 1, ATH_LARGEST);
        clip->from[level] = error * pixels_per_unit / PIXELS;
        ath_cut_size(clip->file, level, 0, clip->nodes + level, clip->vertices + level);
        int32_t refinements = level < clip->info.depth_levels ? 0 : level + 1 - clip->info.depth_levels;
        clip->effort[level] = (clip->nodes[level] + clip->vertices[level]) * (1 + refinements);
        clip->shown_as[level] = level;
    }
}

/* From the prelude alone. */
static void open_clip(const char *path, clip *clip)
{
    size_t front, size;
    ath_fault_info fault;
    read_file(path, clip);
    expect_no_fault(path, ath_front(clip->bytes, clip->size, 0, &front, &size, &fault), &fault);
    clip->file = (ath_file *)memory_of(size);
    expect_no_fault(path, ath_open(clip->file, size, clip->bytes, front, 0, &fault), &fault);
    size_t bases = ath_build_size(clip->file);
    expect_ok(path, ath_build(clip->file, memory_of(bases), bases));
    ath_get_info(clip->file, &clip->info);
    expect(clip->info.level_count <= LEVELS, "more levels than expected");
    clip->memory = size + bases;
    clip->loop = ath_clips(clip->file)->duration * clip->info.frame_count / fmax(1.0, clip->info.frame_count - 1);
    clip->shortest = clip->info.frame_count;
    for (int32_t s = 0; s < clip->info.segment_count; s++) {
        int32_t frames = ath_segment_start(clip->file, s + 1) - ath_segment_start(clip->file, s);
        if (frames < clip->shortest) clip->shortest = frames;
    }
    note_levels(clip);
}

/* What ath_level_for says. */
static int32_t level_at(const clip *clip, double distance)
{
    int32_t level = 0, deepest = clip->info.level_count - 1;
    while (level < deepest && distance < clip->from[level]) level++;
    return level;
}

/* Feeds what a segment lacks for a level, and builds what the level's segments share; how many bytes were lacking. */
static double feed(clip *clip, int32_t segment, int32_t level)
{
    int32_t count = ath_ranges(clip->file, level, segment, segment, 0, 0, 0);
    ath_range *ranges = (ath_range *)memory_of((size_t)count * sizeof *ranges);
    double bytes = 0.0;
    ath_ranges(clip->file, level, segment, segment, 0, ranges, count);
    for (int32_t i = 0; i < count; i++) {
        ath_feed(clip->file, clip->bytes + ranges[i].offset, ranges[i].offset, ranges[i].size);
        bytes += (double)ranges[i].size;
    }
    free(ranges);
    if (level > clip->refined) {
        clip->memory += refine(clip->file, level);
        clip->refined = level;
    }
    return bytes;
}

/* Forgets the bytes of a segment, but not those of shapes, which all segments share. */
static void drop(const clip *clip, int32_t segment)
{
    const ath_chunk *chunks = ath_chunks(clip->file);
    for (int32_t i = 0; i < clip->info.chunk_count; i++) {
        const ath_chunk *chunk = chunks + i;
        if (chunk->kind >= MOTION && chunk->kind < STATIC && chunk->kind != SHAPES && chunk->length > 0
            && chunk->segment == (uint32_t)segment)
            ath_drop(clip->file, chunk->offset, chunk->length);
    }
}

/* A clip of so few segments that all have a slot stays prepared. */
static int stays(const clip *clip) { return clip->info.segment_count <= SLOTS; }

static size_t pose_floats(const clip *clip, int32_t level)
{
    return 12 * (size_t)clip->nodes[level] + 3 * (size_t)clip->vertices[level];
}

/* Matrices, and exact vertices behind them; whether a frame was held. */
static int write_pose(const clip *clip, int32_t level, double place, float *out)
{
    const ath_segment *const *slots = (const ath_segment *const *)clip->slots[level];
    int32_t nodes = clip->nodes[level];
    int result = ATH_OK;
    if (nodes > 0) result = ath_matrices(clip->file, slots, SLOTS, place, out, 12 * sizeof(float));
    if (clip->vertices[level] > 0)
        result = ath_exact(clip->file, slots, SLOTS, place, out + 12 * nodes, 3 * sizeof(float));
    expect(result != ATH_NOT_PREPARED, "a pose was asked for that is not prepared");
    return result == ATH_HELD;
}

/* ---- what one of each costs ---- */

static double prepare_ms(clip *clip, int32_t level, void *work, size_t work_bytes)
{
    size_t size = ath_segment_size(clip->file, level);
    double start = now_ms();
    for (int32_t s = 0; s < clip->info.segment_count; s++)
        expect_ok("ath_prepare", ath_prepare(work, work_bytes, clip->file, s, level, clip->slots[level][0], size));
    return now_ms() - start;
}

static void print_medians(const char *before, const char *name, double *values, int rounds, int levels)
{
    printf("%s\"%s\": [", before, name);
    for (int level = 0; level < levels; level++)
        printf("%s%.15g", level ? ", " : "", quantile(values + level * rounds, rounds, 0.5));
    printf("]");
}

/* The first of all rounds does not count. */
static void print_preparing(clip *clip, int rounds, void *work, size_t work_bytes)
{
    int32_t levels = clip->info.level_count;
    double *values = (double *)memory_of(sizeof(double) * (size_t)(rounds * levels));
    for (int round = -1; round < rounds; round++)
        for (int32_t level = 0; level < levels; level++)
            values[level * rounds + (round < 0 ? 0 : round)] = prepare_ms(clip, level, work, work_bytes);
    print_medians("", "prepare_ms", values, rounds, levels);
    for (int32_t level = 0; level < levels; level++) values[level] = (double)ath_segment_size(clip->file, level);
    print_medians(", ", "segment_bytes", values, 1, levels);
    free(values);
}

/* One pose of a level, of each clip in turn, so that it costs more where the segments of all do not fit into the
 * processor's caches. Of the last segments, which are those that are left. */
static double pose_us(clip *clips, int count, int32_t level, float **out)
{
    int poses = 0;
    double start = now_ms();
    for (int i = 0; i < UNIT_POSES; i++)
        for (int c = 0; c < count; c++) {
            const clip *clip = clips + c;
            int32_t first = ath_segment_start(clip->file, clip->info.segment_count - 1);
            double frames = clip->info.frame_count - first - 1, turns = GOLDEN * i;
            if (level >= clip->info.level_count) continue;
            write_pose(clip, level, first + frames * (turns - floor(turns)), out[c]);
            poses++;
        }
    return (now_ms() - start) * 1e3 / poses;
}

static void print_poses(clip *clips, int count, int32_t levels, int rounds)
{
    float **out = (float **)memory_of((size_t)count * sizeof *out);
    double *values = (double *)memory_of(sizeof(double) * (size_t)(rounds * levels));
    for (int c = 0; c < count; c++) {
        size_t floats = 12 * (size_t)clips[c].info.node_count + 3 * (size_t)clips[c].info.vertex_count;
        out[c] = (float *)memory_of(floats * sizeof(float));
    }
    for (int round = -1; round < rounds; round++)
        for (int32_t level = 0; level < levels; level++)
            values[level * rounds + (round < 0 ? 0 : round)] = pose_us(clips, count, level, out);
    print_medians(", ", "pose_us", values, rounds, levels);
}

static void units(char **paths, int count, int rounds)
{
    clip *clips = (clip *)memory_of((size_t)count * sizeof *clips);
    int32_t levels = 0;
    memset(clips, 0, (size_t)count * sizeof *clips);
    printf("{\"clips\": [");
    for (int c = 0; c < count; c++) {
        clip *clip = clips + c;
        open_clip(paths[c], clip);
        size_t work_bytes = ath_work_size(clip->file);
        void *work = memory_of(work_bytes);
        for (int32_t level = 0; level < clip->info.level_count; level++) {
            for (int32_t s = 0; s < clip->info.segment_count; s++) feed(clip, s, level);
            clip->slots[level][0] = (ath_segment *)memory_of(ath_segment_size(clip->file, level));
        }
        if (clip->info.level_count > levels) levels = clip->info.level_count;
        printf(c ? ",\n {" : "{");
        print_preparing(clip, rounds, work, work_bytes);
        printf("}");
        free(work);
    }
    double start = now_ms();
    for (int i = 0; i < CHOICES; i++) {
        volatile int32_t level = level_at(clips + i % count, 10.0 + i); /* or a compiler would leave this out */
        (void)level;
    }
    put("],\n ", "choice_us", (now_ms() - start) * 1e3 / CHOICES);
    print_poses(clips, count, levels, rounds);
    printf("}\n");
}

/* ---- the scene ---- */

static int32_t *slot_of_pose(const forest *forest, int32_t clip, int32_t level, int32_t phase)
{
    return forest->pose_of + ((size_t)clip * LEVELS + (size_t)level) * (size_t)forest->phases + phase;
}

static int32_t level_of(const forest *forest, const instance *instance)
{
    const clip *played = forest->clips + instance->clip;
    return played->shown_as[level_at(played, instance->distance)];
}

/* Nothing is prepared twice that takes about as much memory, and so time, to show: the deeper one will do for both. */
static void merge_levels(clip *clip)
{
    for (int32_t level = clip->info.level_count - 1; level >= 0; level--) {
        double most = ALIKE * (double)ath_segment_size(clip->file, level);
        for (int32_t deeper = level + 1; clip->used[level] && deeper < clip->info.level_count; deeper++)
            if (clip->used[deeper] && (double)ath_segment_size(clip->file, deeper) <= most)
                clip->shown_as[level] = deeper;
        if (clip->shown_as[level] != level) clip->used[level] = 0;
    }
}

static void choose_levels(forest *forest)
{
    for (const instance *each = forest->instances; each < forest->instances + forest->instance_count; each++)
        forest->clips[each->clip].used[level_of(forest, each)] = 1;
    for (int32_t c = 0; c < forest->clip_count; c++) merge_levels(forest->clips + c);
}

static void read_scene(const char *path, forest *forest)
{
    char name[4096];
    FILE *stream = fopen(path, "r");
    expect(stream && fscanf(stream, "%d %d ", &forest->phases, &forest->clip_count) == 2, path);
    forest->clips = (clip *)memory_of((size_t)forest->clip_count * sizeof(clip));
    memset(forest->clips, 0, (size_t)forest->clip_count * sizeof(clip));
    for (int32_t c = 0; c < forest->clip_count; c++) {
        expect(fgets(name, sizeof name, stream) != 0, path);
        name[strcspn(name, "\n")] = 0;
        open_clip(name, forest->clips + c);
        double turns = GOLDEN * c;
        forest->clips[c].ahead = forest->clips[c].loop * (1.0 + turns - floor(turns));
    }
    expect(fscanf(stream, "%d", &forest->instance_count) == 1, path);
    forest->instances = (instance *)memory_of((size_t)forest->instance_count * sizeof(instance));
    for (int32_t i = 0; i < forest->instance_count; i++) {
        instance *each = forest->instances + i;
        expect(fscanf(stream, "%d %lf %d", &each->clip, &each->distance, &each->phase) == 3, path);
        expect(each->clip >= 0 && each->clip < forest->clip_count && each->phase >= 0 && each->phase < forest->phases,
               path);
    }
    fclose(stream);
}

/* Poses by clip, level and phase, so that what they have in common is in the processor's caches. */
static void plan_poses(forest *forest)
{
    size_t places = (size_t)forest->clip_count * LEVELS * (size_t)forest->phases, floats = 0;
    forest->pose_of = (int32_t *)memory_of(places * sizeof(int32_t));
    forest->poses = (pose *)memory_of((size_t)forest->instance_count * sizeof(pose));
    forest->shown = (int32_t *)memory_of((size_t)forest->instance_count * sizeof(int32_t));
    memset(forest->pose_of, 0, places * sizeof(int32_t));
    for (const instance *each = forest->instances; each < forest->instances + forest->instance_count; each++)
        *slot_of_pose(forest, each->clip, level_of(forest, each), each->phase) = 1;
    for (size_t i = 0; i < places; i++) {
        int32_t phase = (int32_t)(i % (size_t)forest->phases), at = (int32_t)(i / (size_t)forest->phases);
        int32_t clip = at / LEVELS, level = at % LEVELS, is_shown = forest->pose_of[i];
        forest->pose_of[i] = is_shown ? forest->pose_count : -1;
        if (!is_shown) continue;
        forest->poses[forest->pose_count++] = (pose){clip, level, phase, floats};
        floats += pose_floats(forest->clips + clip, level);
    }
    forest->floats = (float *)memory_of(floats * sizeof(float));
    memset(forest->floats, 0, floats * sizeof(float));
}

static size_t plan_slots(forest *forest)
{
    size_t bytes = 0;
    for (clip *clip = forest->clips; clip < forest->clips + forest->clip_count; clip++) {
        if (ath_work_size(clip->file) > forest->work_bytes) forest->work_bytes = ath_work_size(clip->file);
        for (int32_t level = 0; level < clip->info.level_count; level++)
            for (int slot = 0; clip->used[level] && slot < SLOTS && slot < clip->info.segment_count; slot++) {
                size_t size = ath_segment_size(clip->file, level);
                clip->slots[level][slot] = (ath_segment *)memory_of(size);
                bytes += size;
            }
        forest->job_room += SLOTS * LEVELS;
    }
    forest->work = memory_of(forest->work_bytes);
    forest->jobs = (job *)memory_of((size_t)forest->job_room * sizeof(job));
    return bytes + forest->work_bytes;
}

/* ---- preparing ---- */

static void add_job(forest *forest, clip *of, int32_t level, int32_t segment, long number)
{
    expect(forest->job_count < forest->job_room, "more preparations than were counted on");
    forest->fed += feed(of, segment, level);
    forest->jobs[(forest->first_job + forest->job_count++) % forest->job_room] = (job){of, level, segment, number};
}

/* Goes on with the oldest preparation for at most so much effort, or a step, and returns what is left of it. */
static int64_t go_on(forest *forest, int64_t effort)
{
    job *job = forest->jobs + forest->first_job;
    clip *of = job->of;
    if (!forest->begun) {
        ath_segment *slot = of->slots[job->level][job->number % SLOTS];
        expect_ok("ath_prepare_start", ath_prepare_start(forest->work, forest->work_bytes, of->file, job->segment,
                                                         job->level, slot, ath_segment_size(of->file, job->level)));
        forest->steps_left = ath_prepare_steps(of->file, job->segment, job->level);
        forest->begun = 1;
    }
    int64_t each = of->effort[job->level], most = effort / each + (effort % each > 0);
    int32_t now = most < forest->steps_left ? (int32_t)most : forest->steps_left;
    int result = ath_prepare_step((ath_work *)forest->work, now);
    forest->steps_left -= now;
    if (result == ATH_MORE) return effort - now * each;
    expect_ok("ath_prepare_step", result);
    forest->begun = 0;
    forest->first_job = (forest->first_job + 1) % forest->job_room;
    forest->job_count--;
    return effort - now * each;
}

/* The segments around the one that a clip is at. */
static void start_clip(forest *forest, clip *clip, double clock)
{
    int32_t count = clip->info.segment_count;
    ath_blend blend = ath_blend_at(clip->file, ath_frame_at(clip->file, 0, clock + clip->ahead, ATH_LOOP));
    clip->segment = blend.segment[1];
    clip->number = clip->segment + count;
    for (int32_t level = 0; level < clip->info.level_count; level++)
        for (int32_t i = 0; clip->used[level] && i < SLOTS && i < count; i++) {
            long number = stays(clip) ? i : clip->number - 1 + i;
            add_job(forest, clip, level, (int32_t)(number % count), number);
        }
    while (forest->job_count > 0) go_on(forest, INT64_MAX);
}

/* When the next segment begins, the one behind it is asked for, and the one before the last can go. */
static void advance(forest *forest, clip *clip, double clock)
{
    int32_t count = clip->info.segment_count;
    ath_blend blend = ath_blend_at(clip->file, ath_frame_at(clip->file, 0, clock + clip->ahead, ATH_LOOP));
    if (stays(clip) || blend.segment[1] == clip->segment) return;
    clip->segment = blend.segment[1];
    clip->number++;
    drop(clip, (clip->segment + count - 2) % count);
    for (int32_t level = 0; level < clip->info.level_count; level++) {
        if (!clip->used[level]) continue;
        while (ath_segment_index(clip->slots[level][clip->number % SLOTS]) != clip->segment) {
            forest->late++;
            go_on(forest, INT64_MAX);
        }
        add_job(forest, clip, level, (clip->segment + 1) % count, clip->number + 1);
    }
}

/* So that preparing is spread evenly over the pictures. */
static void set_pace(forest *forest, double rate)
{
    double effort = 0.0;
    for (const clip *clip = forest->clips; clip < forest->clips + forest->clip_count; clip++)
        for (int32_t level = 0; !stays(clip) && level < clip->info.level_count; level++)
            for (int32_t s = 0; clip->used[level] && s < clip->info.segment_count; s++)
                effort += (double)clip->effort[level] * ath_prepare_steps(clip->file, s, level) / (clip->loop * rate);
    forest->effort_per_picture = (int64_t)ceil(HASTE * effort);
}

/* ---- playing ---- */

/* Each instance lags behind its clip by its phase, less than the shortest segment, so that two segments hold all. */
static double place_of(const forest *forest, const pose *pose, double clock)
{
    const clip *clip = forest->clips + pose->clip;
    double lag = clip->loop / clip->info.frame_count * (clip->shortest - 1) * pose->phase / forest->phases;
    return ath_frame_at(clip->file, 0, clock + clip->ahead - lag, ATH_LOOP);
}

typedef struct {
    double choose, prepare, pose;
} parts;

static parts show(forest *forest, double clock)
{
    double start = now_ms();
    for (int32_t i = 0; i < forest->instance_count; i++) {
        const instance *each = forest->instances + i;
        forest->shown[i] = *slot_of_pose(forest, each->clip, level_of(forest, each), each->phase);
    }
    double chosen = now_ms();
    for (int32_t c = 0; c < forest->clip_count; c++) advance(forest, forest->clips + c, clock);
    for (int64_t effort = forest->effort_per_picture; effort > 0 && forest->job_count > 0;)
        effort = go_on(forest, effort);
    double prepared = now_ms();
    for (int32_t i = 0; i < forest->pose_count; i++) {
        const pose *pose = forest->poses + i;
        double place = place_of(forest, pose, clock);
        forest->held += write_pose(forest->clips + pose->clip, pose->level, place, forest->floats + pose->at);
    }
    return (parts){chosen - start, prepared - chosen, now_ms() - prepared};
}

static void print_levels(const forest *forest)
{
    int32_t counts[LEVELS] = {0}, most = 0;
    for (int32_t i = 0; i < forest->instance_count; i++) {
        int32_t level = forest->poses[forest->shown[i]].level;
        counts[level]++;
        if (level > most) most = level;
    }
    printf(", \"levels\": [");
    for (int32_t level = 0; level <= most; level++) printf("%s%d", level ? ", " : "", counts[level]);
    printf("]");
}

static void play(const char *scene, double seconds, double rate)
{
    forest forest = {0};
    read_scene(scene, &forest);
    choose_levels(&forest);
    plan_poses(&forest);
    size_t bytes = plan_slots(&forest);
    int pictures = (int)ceil(seconds * rate);
    double *whole = (double *)memory_of((size_t)pictures * sizeof(double)), start = now_ms();
    for (int32_t c = 0; c < forest.clip_count; c++) {
        start_clip(&forest, forest.clips + c, 0.0);
        bytes += forest.clips[c].memory;
    }
    put("{", "start_ms", now_ms() - start);
    put(", ", "start_bytes", forest.fed);
    set_pace(&forest, rate);
    forest.fed = 0.0;
    parts sum = {0};
    for (int picture = 0; picture < pictures; picture++) {
        parts took = show(&forest, (picture + 1) / rate);
        whole[picture] = took.choose + took.prepare + took.pose;
        sum.choose += took.choose / pictures;
        sum.prepare += took.prepare / pictures;
        sum.pose += took.pose / pictures;
    }
    put(", ", "choose_ms", sum.choose);
    put(", ", "prepare_ms", sum.prepare);
    put(", ", "pose_ms", sum.pose);
    put(", ", "p99_ms", quantile(whole, pictures, 0.99));
    put(", ", "bytes_per_s", forest.fed * rate / pictures);
    put(", ", "memory", (double)bytes);
    put(", ", "poses", forest.pose_count);
    put(", ", "held", (double)forest.held);
    put(", ", "late", (double)forest.late);
    print_levels(&forest);
    printf("}\n");
}

int main(int argc, char **argv)
{
    if (argc > 3 && strcmp(argv[1], "units") == 0) {
        units(argv + 3, argc - 3, atoi(argv[2]));
    } else if (argc == 5 && strcmp(argv[1], "play") == 0) {
        play(argv[2], atof(argv[3]), atof(argv[4]));
    } else {
        fprintf(stderr, "usage: forest units ROUNDS FILE.ath... | play SCENE SECONDS RATE\n");
        return 2;
    }
    return 0;
}
