/* Plays an .ath file as an engine would, without the screen. The file arrives slice by slice, a camera walks up to the
 * plant and back, and every drawn frame gets what a GPU needs, at the level of detail that the distance asks for. A new
 * level fades in.
 *
 *     play FILE [--clip NAME] [--slices N] [--seconds S] [--fps F]
 *
 * It prints the same on every machine, except for the microseconds. It leaves out threads (each needs an ath_work), more
 * than a few segments in memory, and range requests (ath_ranges) instead of a download from the front. */
#include <ath.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const double FOV = 1.0, SCREEN = 1080.0; /* vertical field of view, radians; height, pixels */
static const double PIXELS = 1.0;               /* an error above this many pixels asks for a finer level */
static const double COMFORTABLE = 0.7; /* a coarser level must stay below this many pixels, or it would flicker */
static const double FADE = 0.2;        /* seconds that a change of level takes */

typedef struct {
    FILE *download;
    uint8_t *bytes; /* room for the whole file, since bytes that were fed must not move */
    size_t length, there, slice;
    ath_file *file;
    ath_info info;
    int32_t clip_index, first_segment, last_segment;
    const ath_clip *clip;  /* the clip that is played */
    void *bases, **layers; /* memory of ath_build; memory of ath_refine, by level */
    int32_t layer_count;
    ath_work *work;
    size_t file_size, build_size, layers_size, work_size, segments_size;
    ath_segment *playing, *next; /* null: none. `next` is prepared during `playing` */
    ath_segment *before;         /* `playing` at the level that fades out; null: none */
    ath_fade fade;
    double fade_frames;     /* drawn frames that a fade takes */
    void *kept, *next_kept; /* integers from which deeper levels go on */
    int preparing;
    int32_t steps, spread;      /* steps of the preparation, and drawn frames that they are spread over */
    int32_t level, bound_level; /* level that the camera asks for; level of `binding` */
    int32_t nodes;              /* matrices of bound_level */
    int32_t *binding;
    float *matrices, *positions;
    double drawn_per_frame; /* drawn frames per frame of the file */
    long drawn, held;
    double preparing_time, playing_time, longest;
} player;

static void fail(const char *where, const char *why)
{
    fprintf(stderr, "play: %s: %s\n", where, why);
    exit(EXIT_FAILURE);
}

static void check(int result, const char *where)
{
    if (result != ATH_OK) fail(where, ath_result_name(result));
}

static void check_fault(const ath_fault_info *fault, const char *where)
{
    char text[ATH_FAULT_TEXT];
    if (fault->code == ATH_OK) return;
    ath_fault_text(fault, text, sizeof text);
    fail(where, text);
}

/* malloc aligns to 16 on 64-bit systems. If it does not, athcodec returns ATH_NO_MEMORY: use an aligned allocator. */
static void *allocate(size_t size)
{
    void *memory = malloc(size > 0 ? size : 1);
    if (!memory) fail("malloc", "no memory");
    return memory;
}

/* ---- the file ---- */

/* Receives one more slice of the download; 0: there is none. */
static size_t receive(player *p)
{
    size_t left = p->length - p->there;
    size_t got = fread(p->bytes + p->there, 1, p->slice < left ? p->slice : left, p->download);
    p->there += got;
    return got;
}

/* The header, hierarchy and rest pose come first. Then all sizes are known, and the plant can be shown. */
static void open_file(player *p, const char *path, size_t slices)
{
    size_t front;
    ath_fault_info fault;
    int result;
    p->download = fopen(path, "rb");
    if (!p->download || fseek(p->download, 0, SEEK_END) != 0) fail(path, "cannot be read");
    p->length = (size_t)ftell(p->download);
    p->slice = p->length / slices + 1;
    p->bytes = allocate(p->length);
    rewind(p->download);
    do result = ath_front(p->bytes, p->there, NULL, &front, &p->file_size, &fault);
    while (result == ATH_MISSING && receive(p) > 0);
    check_fault(&fault, path);
    p->file = allocate(p->file_size);
    ath_open(p->file, p->file_size, p->bytes, p->there, NULL, &fault);
    check_fault(&fault, path);
    p->build_size = ath_build_size(p->file);
    p->bases = allocate(p->build_size);
    check(ath_build(p->file, p->bases, p->build_size), path);
    p->work_size = ath_work_size(p->file);
    p->work = allocate(p->work_size);
    ath_get_info(p->file, &p->info);
    p->layers = allocate((size_t)p->info.layer_count * sizeof *p->layers);
    p->binding = allocate((size_t)p->info.vertex_count * sizeof(int32_t));
    p->matrices = allocate((size_t)p->info.node_count * 12 * sizeof(float));
    p->positions = allocate((size_t)p->info.vertex_count * 3 * sizeof(float));
    p->bound_level = -1;
}

/* Other clips are never requested. */
static void choose_clip(player *p, const char *name)
{
    p->clip_index = name ? ath_clip_named(p->file, name) : 0;
    if (p->clip_index < 0) fail(name, "is none of the file's clips");
    p->clip = ath_clips(p->file) + p->clip_index;
    p->first_segment = p->clip->first_segment;
    p->last_segment = p->first_segment + p->clip->segment_count - 1;
}

static void close_file(player *p)
{
    void *const memories[] = {p->playing, p->kept, p->next,    p->next_kept, p->before,    p->work, p->bases,
                              p->layers,  p->file, p->binding, p->matrices,  p->positions, p->bytes};
    for (int32_t i = 0; i < p->layer_count; i++) free(p->layers[i]);
    for (size_t i = 0; i < sizeof memories / sizeof *memories; i++) free(memories[i]);
    fclose(p->download);
}

/* ---- levels ---- */

static void choose_level(player *p, double distance)
{
    int32_t at_least =
        ath_level_for(p->file, p->first_segment, p->last_segment, ATH_P99, distance, FOV, SCREEN, PIXELS);
    int32_t at_most =
        ath_level_for(p->file, p->first_segment, p->last_segment, ATH_P99, distance, FOV, SCREEN, COMFORTABLE);
    if (p->level < at_least) p->level = at_least;
    if (p->level > at_most) p->level = at_most;
}

/* Returns the level that is wanted, or the deepest that has arrived; -1: none has. */
static int32_t level_for(const player *p, int32_t segment)
{
    int32_t ready = ath_ready_level(p->file, segment);
    return p->level < ready ? p->level : ready;
}

/* ---- preparing ---- */

static int32_t index_of(const ath_segment *segment) { return segment ? ath_segment_index(segment) : -1; }
static int32_t level_of(const ath_segment *segment) { return segment ? ath_segment_level(segment) : -1; }

/* Builds what the segments of a level share, as soon as the first of them can be prepared. */
static void refine(player *p, int32_t level)
{
    size_t size;
    ath_fault_info fault;
    ath_refine_size(p->file, level, &size, &fault);
    check_fault(&fault, "refining");
    void *memory = size > 0 ? p->layers[p->layer_count++] = allocate(size) : NULL;
    check(ath_refine(p->file, level, memory, size), "refining");
    p->layers_size += size;
}

/* Takes room for the most that may be kept, since pages that nobody writes to cost nothing. */
static void keep(player *p, int32_t level)
{
    size_t room = ath_keep_size(p->file, level) + 16;
    free(p->next_kept);
    p->next_kept = allocate(room);
    check(ath_keep(p->work, p->next_kept, room), "keeping");
}

static void keep_no_more_than_there_is(player *p)
{
    size_t size = ath_kept_size(p->next_kept);
    void *shrunk = realloc(p->next_kept, size > 16 ? size : 16);
    if (shrunk) p->next_kept = shrunk;
}

/* A finer level of the playing segment goes on from its integers. */
static int begin(player *p, int32_t segment, int32_t level, size_t size)
{
    if (index_of(p->playing) == segment && ath_goes_on(p->file, p->playing, p->kept, level))
        return ath_prepare_onward(p->work, p->work_size, p->file, p->playing, p->kept, level, p->next, size);
    return ath_prepare_start(p->work, p->work_size, p->file, segment, level, p->next, size);
}

static size_t room_of(const player *p, const ath_segment *segment)
{
    return segment ? ath_segment_size(p->file, level_of(segment)) : 0;
}

/* Memory depends on the level, so that a distant plant takes little. */
static int start(player *p, int32_t segment, int32_t level)
{
    size_t size = ath_segment_size(p->file, level);
    size_t all = size + room_of(p, p->playing) + room_of(p, p->before);
    if (p->segments_size < all) p->segments_size = all;
    free(p->next);
    p->next = allocate(size);
    refine(p, level);
    check(begin(p, segment, level, size), "preparing");
    keep(p, level);
    if (p->playing) ath_follow(p->work, p->playing); /* ignored unless it is joined to this one */
    p->steps = ath_prepare_steps(p->file, segment, level);
    return p->preparing = 1;
}

/* Chooses what to prepare: a segment to show now, then a new level for it, then the next segment at the same level, so
 * that no level changes at the seam. A new level waits for the next segment if this one ends before it has faded in,
 * and goes ahead of a segment of which less has arrived. left: drawn frames until the next segment. */
static int start_next(player *p, int32_t now, double left)
{
    int32_t count = p->clip->segment_count, after = now < p->last_segment ? now + 1 : p->first_segment;
    int32_t level = level_for(p, now), level_after = level_for(p, after);
    double change = p->spread + p->fade_frames;
    if (level < 0) return 0;
    if (index_of(p->playing) != now) return start(p, now, level);
    if (level_after >= 0 && level_after < level && left < 2.0 * change) level = level_after;
    if (level_of(p->playing) != level && !p->before && (count == 1 || left > change)) return start(p, now, level);
    if (level_after > level_of(p->playing)) level_after = level_of(p->playing);
    if (count == 1 || level_after < 0) return 0;
    if (index_of(p->next) != after) return start(p, after, level_after);
    if (level_of(p->next) != level_after && left > p->spread) return start(p, after, level_after);
    return 0;
}

/* Plays what is prepared, if its time has come, or fades in a new level. */
static void take_over(player *p, int32_t now)
{
    if (p->preparing || index_of(p->next) != now) return;
    free(p->before);
    p->before = p->playing;
    free(p->kept);
    p->playing = p->next;
    p->kept = p->next_kept;
    p->next = NULL;
    p->next_kept = NULL;
}

/* Runs some steps per drawn frame, or all at once if nothing could be shown otherwise: at the start, or after a jump in
 * time. A preparation that has begun is finished, so that a fast camera cannot starve it. */
static void prepare(player *p, double place)
{
    int32_t now = ath_blend_at(p->file, place).segment[0];
    double left = (ath_segment_start(p->file, now + 1) - place) * p->drawn_per_frame;
    ath_fault_info fault;
    int urgent;
    do {
        take_over(p, now);
        urgent = index_of(p->playing) != now;
        if (!p->preparing && !start_next(p, now, left)) return;
        int result = ath_prepare_step(p->work, urgent ? INT32_MAX : p->steps / p->spread + 1);
        if (result == ATH_MORE) return;
        ath_work_fault(p->work, &fault);
        check_fault(&fault, "preparing");
        keep_no_more_than_there_is(p);
        p->preparing = 0;
    } while (urgent);
    take_over(p, now);
}

/* A segment is prepared during a quarter of the time that the one before plays. */
static void set_pace(player *p, double fps)
{
    double frame_time = p->clip->duration / fmax(1.0, p->clip->frame_count - 1);
    p->drawn_per_frame = frame_time * fps;
    double drawn = p->drawn_per_frame * p->clip->frame_count / p->clip->segment_count;
    p->spread = (int32_t)fmin(30.0, 1.0 + drawn / 4.0);
    p->fade_frames = fmin(FADE * fps, 1.0 + drawn / 4.0);
}

/* ---- drawing ---- */

/* Fills a vertex attribute once per level. With it, the vertex shader places a vertex of the rest pose at
 *     binding < 0 ? positions[-1 - binding] : matrices[binding] * rest */
static void bind_vertices(player *p, int32_t level)
{
    int32_t count;
    ath_cut_size(p->file, level, &count, &p->nodes, NULL);
    ath_part *parts = allocate((size_t)count * sizeof *parts);
    ath_cut(p->file, level, parts);
    for (const ath_part *part = parts; part < parts + count; part++)
        for (int32_t i = 0; i < part->count; i++)
            p->binding[part->first + i] = part->branch >= 0 ? part->index : -1 - (part->index + i);
    free(parts);
    p->bound_level = level;
}

/* Frees the segment that has faded out, or that belongs to another time. */
static void fade(player *p)
{
    ath_fade_to(&p->fade, level_of(p->playing), 1.0 / p->fade_frames);
    if (p->fade.count > 1 && index_of(p->before) == index_of(p->playing)) return;
    free(p->before);
    p->before = NULL;
    if (p->fade.count > 1) ath_fade_to(&p->fade, level_of(p->playing), 1.0);
}

static int draw(player *p, double place)
{
    if (!p->playing) return ATH_NOT_PREPARED; /* show the rest pose until there is motion */
    fade(p);
    const ath_segment *segments[3] = {p->playing, p->next, p->before};
    size_t matrix = 12 * sizeof(float), vertex = 3 * sizeof(float);
    int32_t level = ath_fade_cut(&p->fade);
    if (level != p->bound_level) bind_vertices(p, level);
    if (p->nodes == 0) /* without a GPU, call this at all levels */
        return ath_faded_positions(p->file, segments, 3, place, &p->fade, ATH_FILE_ORDER, p->positions, vertex);
    ath_faded_matrices(p->file, segments, 3, place, &p->fade, p->matrices, matrix);
    return ath_faded_exact(p->file, segments, 3, place, &p->fade, p->positions, vertex);
}

/* ---- the walk ---- */

/* Walks from where level 0 suffices to where only the last level does, and back, with a third of the time close up. */
static double camera(const player *p, double progress)
{
    double unit = SCREEN / (2.0 * tan(FOV / 2.0)); /* pixels of a length of 1 from a distance of 1 */
    double nearness = fmin(1.0, 1.5 * (1.0 - fabs(2.0 * progress - 1.0)));
    double error = ath_level_error(p->file, 0, p->first_segment, p->last_segment, ATH_P99);
    double far = fmax(1e-6, 1.5 * error * unit / COMFORTABLE);
    int32_t last_but_one = p->info.level_count > 1 ? p->info.level_count - 2 : 0;
    error = ath_level_error(p->file, last_but_one, p->first_segment, p->last_segment, ATH_P99);
    double near = fmax(1e-6 * far, error * unit / (2.0 * PIXELS));
    return far * pow(near / far, nearness);
}

static double microseconds(void)
{
    struct timespec now;
    timespec_get(&now, TIME_UTC);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec * 1e-3;
}

static void draw_frame(player *p, double seconds)
{
    double place = ath_frame_at(p->file, p->clip_index, seconds, ATH_LOOP), begin = microseconds();
    prepare(p, place);
    double prepared = microseconds();
    p->held += draw(p, place) == ATH_HELD;
    p->playing_time += microseconds() - prepared;
    p->preparing_time += prepared - begin;
    p->longest = fmax(p->longest, prepared - begin);
    p->drawn++;
}

static void walk(player *p, double seconds, double fps)
{
    double distance = 0.0, preparing = 0.0, playing = 0.0;
    puts("second   distance   asks  shows      bytes   us per frame: prepare       play");
    for (int second = 0; second < (int)seconds; second++) {
        long begin = p->drawn;
        while ((double)p->drawn < (second + 1) * fps) {
            double progress = (double)p->drawn / (seconds * fps);
            while ((double)p->there < 2.0 * progress * (double)p->length && receive(p) > 0) continue;
            ath_feed(p->file, p->bytes, 0, p->there);
            distance = camera(p, progress);
            choose_level(p, distance);
            draw_frame(p, (double)p->drawn / fps);
        }
        double frames = (double)(p->drawn - begin);
        printf("%6d %10.4g %6d %6d %10zu %23.1f %10.1f\n", second, distance, (int)p->level, (int)level_of(p->playing),
               p->there, (p->preparing_time - preparing) / frames, (p->playing_time - playing) / frames);
        preparing = p->preparing_time;
        playing = p->playing_time;
    }
    printf("total: %ld frames, %ld of them held\n", p->drawn, p->held);
    printf("us per frame: prepare %.1f, at most %.1f, play %.1f\n", preparing / (double)p->drawn, p->longest,
           playing / (double)p->drawn);
}

int main(int argc, char **argv)
{
    player p = {0};
    double slices = 32, seconds = 12, fps = 60;
    const char *clip = NULL;
    if (argc < 2 || argc % 2 != 0) fail("usage", "play FILE [--clip NAME] [--slices N] [--seconds S] [--fps F]");
    for (int i = 2; i < argc; i += 2) {
        if (!strcmp(argv[i], "--clip")) {
            clip = argv[i + 1];
            continue;
        }
        double *option = !strcmp(argv[i], "--slices")    ? &slices
                         : !strcmp(argv[i], "--seconds") ? &seconds
                         : !strcmp(argv[i], "--fps")     ? &fps
                                                         : NULL;
        if (!option) fail(argv[i], "no such option");
        *option = atof(argv[i + 1]);
        if (!(*option >= 1.0 && *option <= 1e6)) fail(argv[i], "expected a number from 1 to 1e6");
    }
    open_file(&p, argv[1], (size_t)slices);
    choose_clip(&p, clip);
    set_pace(&p, fps);
    walk(&p, seconds, fps);
    printf("bytes of memory: file %zu, opened %zu, built %zu, work %zu, segments at most %zu\n", p.length, p.file_size,
           p.build_size + p.layers_size, p.work_size, p.segments_size);
    printf("ranges missing at the end: %d\n",
           (int)ath_ranges(p.file, p.info.level_count - 1, p.first_segment, p.last_segment, 0, NULL, 0));
    close_file(&p);
    return EXIT_SUCCESS;
}
