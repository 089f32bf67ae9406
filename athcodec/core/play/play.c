/* Shows prepared segments: positions and matrices at any time, fades, and the level that a distance asks for. */
#include "play/segment.h"

/* ---- time ---- */

/* Returns x modulo the period; 0 if x is too large to count periods. */
static double wrapped(double x, double period)
{
    double turns = x / period;
    if (!(turns > -4503599627370496.0 && turns < 4503599627370496.0)) return 0.0;
    double rest = x - period * (double)(int64_t)turns;
    if (rest < 0.0) rest = rest + period;
    return rest < period ? rest : 0.0;
}

static double frame_of(const ath_file *file, const ath_clip *clip, double seconds)
{
    const double *times = file->times + clip->first_frame;
    int32_t low = 0, high = clip->frame_count - 1;
    while (high - low > 1) {
        int32_t middle = low + (high - low) / 2;
        if (times[middle] - times[0] <= seconds)
            low = middle;
        else
            high = middle;
    }
    return (double)low + (seconds - (times[low] - times[0])) / (times[high] - times[low]);
}

static double frame_within(const ath_file *file, const ath_clip *clip, double seconds, ath_wrap wrap)
{
    double last = (double)(clip->frame_count - 1), duration = clip->duration;
    if (clip->frame_count < 2) return 0.0;
    double frame_time = duration / last;
    if (wrap == ATH_LOOP) seconds = wrapped(seconds, duration + frame_time);
    if (wrap == ATH_PING_PONG) {
        seconds = wrapped(seconds, 2.0 * duration);
        if (seconds > duration) seconds = 2.0 * duration - seconds;
    }
    if (!(seconds > 0.0)) return 0.0;
    if (seconds < duration) return frame_of(file, clip, seconds);
    double beyond = wrap == ATH_LOOP ? (seconds - duration) / frame_time : 0.0;
    return last + (beyond < 1.0 ? beyond : 1.0);
}

double ath_frame_at(const ath_file *file, int32_t clip, double seconds, ath_wrap wrap)
{
    const ath_clip *shown = file->clips + clip;
    if (wrap == ATH_AS_MARKED) wrap = shown->loop ? ATH_LOOP : ATH_CLAMP;
    double first = (double)shown->first_frame, frame = first + frame_within(file, shown, seconds, wrap);
    return frame < first + (double)shown->frame_count ? frame : first; /* the next frame belongs to another clip */
}

ath_blend ath_blend_at(const ath_file *file, double frame)
{
    ath_blend blend;
    if (!(frame > 0.0) || frame >= (double)file->info.frame_count) frame = 0.0;
    const ath_clip *clip = ath_file_clip(file, (int32_t)frame);
    int32_t end = clip->first_frame + clip->frame_count;
    blend.frame[0] = blend.frame[1] = (int32_t)frame;
    blend.weight = frame - (double)blend.frame[0];
    if (blend.weight > 0.0) blend.frame[1] = blend.frame[0] + 1 < end ? blend.frame[0] + 1 : clip->first_frame;
    for (int32_t i = 0; i < 2; i++) blend.segment[i] = ath_segment_of(file, blend.frame[i]);
    return blend;
}

/* ---- segments ---- */

/* The two frames to blend, in the segments that have them. */
typedef struct {
    const ath_segment *segment[2];
    size_t frame[2]; /* index among the coded frames of the segment */
    double weight;
} shown_frames;

static const ath_segment *find_segment(const ath_segment *const *segments, int32_t count, int32_t index, int32_t level)
{
    for (int32_t i = 0; i < count; i++)
        if (segments[i] && segments[i]->level >= 0 && segments[i]->index == index
            && (level < 0 || segments[i]->level == level))
            return segments[i];
    return 0;
}

static int show_one(const ath_file *file, const ath_segment *segment, int32_t frame, shown_frames *shown)
{
    shown->segment[0] = shown->segment[1] = segment;
    shown->frame[0] = shown->frame[1] = file->coded[frame];
    shown->weight = 0.0;
    return ATH_HELD;
}

/* level: -1 for any. */
static int find_frames(const ath_file *file, const ath_segment *const *segments, int32_t count, double frame,
                       int32_t level, shown_frames *shown)
{
    ath_blend blend = ath_blend_at(file, frame);
    shown->weight = blend.weight;
    for (int32_t i = 0; i < count; i++) {
        const ath_segment *first = find_segment(segments + i, 1, blend.segment[0], level);
        const ath_segment *second = first ? find_segment(segments, count, blend.segment[1], first->level) : 0;
        if (!second) continue;
        shown->segment[0] = first;
        shown->segment[1] = second;
        for (int32_t k = 0; k < 2; k++) shown->frame[k] = file->coded[blend.frame[k]];
        return ATH_OK;
    }
    int32_t nearer = blend.weight < 0.5 ? 0 : 1;
    for (int32_t i = 0; i < 2; i++) {
        int32_t side = i == 0 ? nearer : 1 - nearer;
        const ath_segment *segment = find_segment(segments, count, blend.segment[side], level);
        if (segment) return show_one(file, segment, blend.frame[side], shown);
    }
    return ATH_NOT_PREPARED;
}

/* ---- maps of nodes ---- */

static void blend_map(const shown_frames *shown, int32_t index, double map[ATH_MAP])
{
    const double *at[2];
    for (size_t i = 0; i < 2; i++) {
        const ath_segment *segment = shown->segment[i];
        at[i] = segment->maps + (shown->frame[i] * (size_t)segment->node_count + (size_t)index) * ATH_MAP;
    }
    if (shown->weight > 0.0)
        for (int32_t k = 0; k < ATH_MAP; k++) map[k] = at[0][k] + (at[1][k] - at[0][k]) * shown->weight;
    else
        for (int32_t k = 0; k < ATH_MAP; k++) map[k] = at[0][k];
}

static const double *rest_attach_of(const ath_plan *plan, const ath_part *part)
{
    const ath_branch *branch = plan->branches + part->branch;
    return plan->rest + 3 * (size_t)(branch->attach >= 0 ? branch->attach : branch->first);
}

/* Makes the map a matrix from absolute rest positions to absolute positions. */
static void matrix_of(const ath_file *file, const ath_plan *plan, const ath_part *part, const double map[ATH_MAP],
                      double matrix[12])
{
    const double *a = rest_attach_of(plan, part), *origin = file->info.origin;
    for (int32_t i = 0; i < 3; i++) {
        const double *R = map + 3 * i;
        for (int32_t k = 0; k < 3; k++) matrix[4 * i + k] = R[k];
        matrix[4 * i + 3] = (map[9 + i] + origin[i])
                            - (R[0] * (a[0] + origin[0]) + R[1] * (a[1] + origin[1]) + R[2] * (a[2] + origin[2]));
    }
}

/* ---- vertices ---- */

/* The destination of positions, float or (is_float64) double. */
typedef struct {
    char *out;
    size_t stride;
    const int32_t *place; /* null: file order */
    int is_float64;
    float share; /* weight of new positions; 1: they replace what is there */
} target;

ATH_INLINE float mixed(float before, float value, float share)
{
    return share < 1.0f ? before + (value - before) * share : value;
}

ATH_INLINE void put(const target *to, size_t vertex, double x, double y, double z)
{
    char *at = to->out + (to->place ? (size_t)to->place[vertex] : vertex) * to->stride;
    if (to->is_float64) {
        double *out = (double *)(void *)at;
        out[0] = x;
        out[1] = y;
        out[2] = z;
    } else {
        float *out = (float *)(void *)at;
        out[0] = mixed(out[0], (float)x, to->share);
        out[1] = mixed(out[1], (float)y, to->share);
        out[2] = mixed(out[2], (float)z, to->share);
    }
}

enum { BLOCK = 64 };

/* Moves rest positions, relative to the origin, to absolute positions. */
ATH_HOT static void move_block(const double *x0, size_t count, const double m[ATH_MAP], const double a[3],
                               const double origin[3], double *ATH_RESTRICT out)
{
    for (size_t i = 0; i < count; i++) {
        double x = x0[3 * i] - a[0], y = x0[3 * i + 1] - a[1], z = x0[3 * i + 2] - a[2];
        out[3 * i] = (m[9] + (m[0] * x + m[1] * y + m[2] * z)) + origin[0];
        out[3 * i + 1] = (m[10] + (m[3] * x + m[4] * y + m[5] * z)) + origin[1];
        out[3 * i + 2] = (m[11] + (m[6] * x + m[7] * y + m[8] * z)) + origin[2];
    }
}

ATH_HOT static void round_block(double *block, size_t count)
{
    for (size_t i = 0; i < count; i++) block[i] = ath_single(block[i]);
}

ATH_HOT static void narrow_block(const double *ATH_RESTRICT block, size_t count, float *ATH_RESTRICT out)
{
    for (size_t i = 0; i < count; i++) out[i] = (float)block[i];
}

static int is_packed(const target *to)
{
    return !to->is_float64 && !to->place && to->stride == 3 * sizeof(float) && to->share == 1.0f;
}

/* Puts vertices first to first + count - 1 of a node, moved from `rest`, at `vertex` and those behind it. */
static void put_node(const ath_file *file, const ath_plan *plan, const ath_part *part, const double m[ATH_MAP],
                     const double *rest, size_t first, size_t count, size_t vertex, const target *to)
{
    const double *a = rest_attach_of(plan, part);
    double block[3 * BLOCK];
    for (size_t start = 0; start < count; start += BLOCK) {
        size_t size = count - start < (size_t)BLOCK ? count - start : (size_t)BLOCK, at = vertex + start;
        move_block(rest + 3 * (first + start), size, m, a, file->info.origin, block);
        if (is_packed(to)) {
            narrow_block(block, 3 * size, (float *)(void *)to->out + 3 * at);
            continue;
        }
        if (!file->info.is_float64 && to->is_float64) round_block(block, 3 * size);
        for (size_t i = 0; i < size; i++) put(to, at + i, block[3 * i], block[3 * i + 1], block[3 * i + 2]);
    }
}

ATH_HOT static void blend_floats(const float *a, const float *b, float weight, size_t count, float *ATH_RESTRICT out)
{
    if (weight == 0.0f)
        for (size_t i = 0; i < count; i++) out[i] = a[i];
    else
        for (size_t i = 0; i < count; i++) out[i] = a[i] + (b[i] - a[i]) * weight;
}

static void scatter_floats(const float *from, size_t count, size_t vertex, const target *to)
{
    const int32_t *place = to->place ? to->place + vertex : 0;
    char *out = to->out;
    size_t stride = to->stride;
    for (size_t i = 0; i < count; i++)
        memcpy(out + (place ? (size_t)place[i] : vertex + i) * stride, from + 3 * i, 3 * sizeof(float));
}

/* Returns where an exact vertex stands in one of the two frames. */
static const void *exact_at(const ath_file *file, const shown_frames *shown, size_t i, size_t index)
{
    const ath_segment *segment = shown->segment[i];
    return ath_vertex_at(segment, segment->positions, shown->frame[i], ath_position_of(file, segment, index));
}

/* Puts `count` exact vertices, which stand side by side, from `index` on at `vertex` and those behind it. */
static void put_floats(const ath_file *file, const shown_frames *shown, size_t index, size_t count, size_t vertex,
                       const target *to)
{
    const float *at[2];
    for (size_t i = 0; i < 2; i++) at[i] = (const float *)exact_at(file, shown, i, index);
    float weight = (float)shown->weight, block[3 * BLOCK];
    if (is_packed(to)) {
        blend_floats(at[0], at[1], weight, 3 * count, (float *)(void *)to->out + 3 * vertex);
        return;
    }
    if (weight == 0.0f && !to->is_float64 && to->share == 1.0f) {
        scatter_floats(at[0], count, vertex, to);
        return;
    }
    for (size_t start = 0; start < count; start += BLOCK) {
        size_t size = count - start < (size_t)BLOCK ? count - start : (size_t)BLOCK;
        blend_floats(at[0] + 3 * start, at[1] + 3 * start, weight, 3 * size, block);
        for (size_t i = 0; i < size; i++)
            put(to, vertex + start + i, (double)block[3 * i], (double)block[3 * i + 1], (double)block[3 * i + 2]);
    }
}

static void put_doubles(const ath_file *file, const shown_frames *shown, size_t index, size_t count, size_t vertex,
                        const target *to)
{
    const double *at[2];
    double w = shown->weight, x[3];
    for (size_t i = 0; i < 2; i++) at[i] = (const double *)exact_at(file, shown, i, index);
    for (size_t i = 0; i < count; i++) {
        const double *a = at[0] + 3 * i, *b = at[1] + 3 * i;
        for (size_t k = 0; k < 3; k++) x[k] = w > 0.0 ? a[k] + (b[k] - a[k]) * w : a[k];
        put(to, vertex + i, x[0], x[1], x[2]);
    }
}

static void put_exact(const ath_file *file, const shown_frames *shown, size_t index, size_t count, size_t vertex,
                      const target *to)
{
    int moved = shown->segment[0]->in_source_order || shown->segment[1]->in_source_order;
    size_t side_by_side = moved ? 1 : count;
    for (size_t i = 0; i < count; i += side_by_side)
        (shown->segment[0]->is_float64 ? put_doubles : put_floats)(file, shown, index + i, side_by_side, vertex + i,
                                                                   to);
}

/* Puts vertices first to first + count - 1 of one part at `vertex` and those behind it. Nodes move `posed`. */
static void put_part(const ath_file *file, const shown_frames *shown, const ath_part *part, const ath_plan *posed,
                     size_t first, size_t count, size_t vertex, const target *to)
{
    double map[ATH_MAP];
    if (part->branch < 0) {
        put_exact(file, shown, (size_t)part->index + (first - (size_t)part->first), count, vertex, to);
        return;
    }
    blend_map(shown, part->index, map);
    put_node(file, ath_stage_plan(file, shown->segment[0]->stage), part, map, posed->rest, first, count, vertex, to);
}

static void put_all(const ath_file *file, const shown_frames *shown, const target *to)
{
    const ath_segment *segment = shown->segment[0];
    for (const ath_part *part = segment->parts; part < segment->parts + segment->part_count; part++)
        put_part(file, shown, part, ath_stage_plan(file, segment->stage), (size_t)part->first, (size_t)part->count,
                 (size_t)part->first, to);
}

/* Returns the coordinates of all places in the frame that is shown if they only have to be copied, or null. */
static const void *whole_frame(const ath_file *file, const shown_frames *shown, const target *to)
{
    const ath_segment *segment = shown->segment[0];
    int is_whole = segment->part_count == 1 && segment->parts->branch < 0
                   && segment->exact_vertices == (int32_t)file->header.place_count;
    if (!is_whole || shown->weight > 0.0 || segment->in_source_order || segment->is_float64 != to->is_float64) return 0;
    size_t bytes = 3 * (segment->is_float64 ? sizeof(double) : sizeof(float));
    return (const char *)segment->positions + shown->frame[0] * (size_t)segment->exact_vertices * bytes;
}

ATH_INLINE void gather(const char *from, const int32_t *places, size_t count, size_t bytes, char *out, size_t stride)
{
    for (size_t i = 0; i < count; i++) memcpy(out + i * stride, from + (size_t)places[i] * bytes, bytes);
}

/* Puts each vertex of the source from its place, in the order of memory. Scattering what is in file order and copying
 * the vertices that share a place takes half as long again. */
static void gather_all(const ath_file *file, const void *from, const target *to)
{
    const int32_t *places = file->vertex_places;
    size_t count = file->header.vertex_count;
    if (to->is_float64)
        gather((const char *)from, places, count, 3 * sizeof(double), to->out, to->stride);
    else
        gather((const char *)from, places, count, 3 * sizeof(float), to->out, to->stride);
}

static int positions(const ath_file *file, const ath_segment *const *segments, int32_t count, double frame, target to)
{
    shown_frames shown;
    int result = find_frames(file, segments, count, frame, -1, &shown);
    if (result == ATH_NOT_PREPARED) return result;
    const void *from = to.place ? whole_frame(file, &shown, &to) : 0;
    if (from) {
        gather_all(file, from, &to);
        return result;
    }
    put_all(file, &shown, &to);
    if (to.place) ath_fill_places(file, to.out, to.stride, 3 * (to.is_float64 ? sizeof(double) : sizeof(float)));
    return result;
}

static target target_of(const ath_file *file, ath_order order, void *out, size_t stride, int is_float64)
{
    target to = {(char *)out, stride, order == ATH_SOURCE_ORDER ? file->vertex_source : 0, is_float64, 1.0f};
    return to;
}

int ath_positions(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                  ath_order order, float *xyz, size_t stride)
{
    return positions(file, segments, segment_count, frame, target_of(file, order, xyz, stride, 0));
}

int ath_positions_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                          ath_order order, double *xyz, size_t stride)
{
    return positions(file, segments, segment_count, frame, target_of(file, order, xyz, stride, 1));
}

static int exact(const ath_file *file, const ath_segment *const *segments, int32_t count, double frame, target to)
{
    shown_frames shown;
    int result = find_frames(file, segments, count, frame, -1, &shown);
    if (result != ATH_NOT_PREPARED) put_exact(file, &shown, 0, (size_t)shown.segment[0]->exact_vertices, 0, &to);
    return result;
}

int ath_exact(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame, float *xyz,
              size_t stride)
{
    return exact(file, segments, segment_count, frame, target_of(file, ATH_FILE_ORDER, xyz, stride, 0));
}

int ath_exact_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                      double *xyz, size_t stride)
{
    return exact(file, segments, segment_count, frame, target_of(file, ATH_FILE_ORDER, xyz, stride, 1));
}

int32_t ath_shown_level(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame)
{
    shown_frames shown;
    return find_frames(file, segments, segment_count, frame, -1, &shown) == ATH_NOT_PREPARED ? -1
                                                                                             : shown.segment[0]->level;
}

static int matrices(const ath_file *file, const ath_segment *const *segments, int32_t count, double frame, void *out,
                    size_t stride, int is_float64)
{
    shown_frames shown;
    int result = find_frames(file, segments, count, frame, -1, &shown);
    if (result == ATH_NOT_PREPARED) return result;
    const ath_plan *plan = ath_stage_plan(file, shown.segment[0]->stage);
    for (int32_t i = 0; i < shown.segment[0]->part_count; i++) {
        const ath_part *part = shown.segment[0]->parts + i;
        double map[ATH_MAP], matrix[12];
        if (part->branch < 0) continue;
        char *at = (char *)out + (size_t)part->index * stride;
        blend_map(&shown, part->index, map);
        matrix_of(file, plan, part, map, matrix);
        for (size_t k = 0; k < 12; k++) ath_put_number(at, k, is_float64, matrix[k]);
    }
    return result;
}

int ath_matrices(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                 float *out, size_t stride)
{
    return matrices(file, segments, segment_count, frame, out, stride, 0);
}

int ath_matrices_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                         double *out, size_t stride)
{
    return matrices(file, segments, segment_count, frame, out, stride, 1);
}

/* ---- from level to level ---- */

/* Eases the progress of a fade, which begins and ends at rest. */
static double eased(double passed) { return passed * passed * (3.0 - 2.0 * passed); }

void ath_fade_to(ath_fade *fade, int32_t level, double share)
{
    int32_t gone = 0, at_once = !(share < 1.0);
    for (int32_t i = 1; i < fade->count; i++) {
        fade->passed[i] = fade->passed[i] + share;
        if (!(fade->passed[i] < 1.0)) gone = i;
    }
    if (at_once && fade->count > 0) gone = fade->level[fade->count - 1] == level ? fade->count - 1 : fade->count;
    for (int32_t i = gone; i < fade->count; i++) {
        fade->level[i - gone] = fade->level[i];
        fade->passed[i - gone] = fade->passed[i];
    }
    fade->count -= gone;
    if (fade->count < ATH_FADE_LEVELS && (fade->count == 0 || fade->level[fade->count - 1] != level)) {
        fade->level[fade->count] = level;
        fade->passed[fade->count++] = 0.0;
    }
    for (int32_t i = 0; i < fade->count; i++)
        fade->weight[i] =
            (i > 0 ? eased(fade->passed[i]) : 1.0) - (i + 1 < fade->count ? eased(fade->passed[i + 1]) : 0.0);
}

int32_t ath_fade_cut(const ath_fade *fade)
{
    int32_t deepest = -1;
    for (int32_t i = 0; i < fade->count; i++)
        if (fade->level[i] > deepest) deepest = fade->level[i];
    return deepest;
}

/* The frames of those levels of a fade that have a weight. */
typedef struct {
    const ath_segment *cut; /* a segment of the deepest level */
    shown_frames shown[ATH_FADE_LEVELS];
    float share[ATH_FADE_LEVELS]; /* weight of each level in the blend with those before it */
    int32_t count;
    int result;
} faded_frames;

static faded_frames find_faded(const ath_file *file, const ath_segment *const *segments, int32_t count, double frame,
                               const ath_fade *fade)
{
    faded_frames found;
    double sum = 0.0;
    int32_t deepest = ath_fade_cut(fade);
    found.count = 0;
    found.result = ATH_NOT_PREPARED;
    found.cut = 0;
    for (int32_t i = 0; i < count; i++)
        if (segments[i] && segments[i]->level >= 0 && segments[i]->level == deepest) found.cut = segments[i];
    if (!found.cut) return found;
    int held = ATH_OK;
    for (int32_t i = 0; i < fade->count; i++) {
        if (!(fade->weight[i] > 0.0)) continue;
        int result = find_frames(file, segments, count, frame, fade->level[i], found.shown + found.count);
        if (result == ATH_NOT_PREPARED) return found;
        if (result == ATH_HELD) held = ATH_HELD;
        sum = sum + fade->weight[i];
        found.share[found.count++] = (float)(fade->weight[i] / sum);
    }
    if (found.count > 0) found.result = held;
    return found;
}

int ath_faded_positions(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                        const ath_fade *fade, ath_order order, float *xyz, size_t stride)
{
    faded_frames found = find_faded(file, segments, segment_count, frame, fade);
    if (found.result == ATH_NOT_PREPARED) return found.result;
    target to = target_of(file, order, xyz, stride, 0);
    for (int32_t i = 0; i < found.count; i++) {
        to.share = found.share[i];
        put_all(file, found.shown + i, &to);
    }
    if (to.place) ath_fill_places(file, xyz, stride, 3 * sizeof(float));
    return found.result;
}

/* Returns the first part from `part` on that has a vertex. */
static const ath_part *part_with(const ath_part *part, int32_t vertex)
{
    while (part->first + part->count <= vertex) part++;
    return part;
}

static void fade_matrices(const ath_file *file, const faded_frames *found, int32_t index, float *out, size_t stride)
{
    const shown_frames *shown = found->shown + index;
    const ath_segment *cut = found->cut;
    const ath_plan *plan = ath_stage_plan(file, shown->segment[0]->stage);
    const ath_part *moves = shown->segment[0]->parts;
    double map[ATH_MAP], matrix[12];
    for (const ath_part *part = cut->parts; part < cut->parts + cut->part_count; part++) {
        if (part->branch < 0) continue;
        float *at = (float *)(void *)((char *)out + (size_t)part->index * stride);
        moves = part_with(moves, part->first);
        blend_map(shown, moves->index, map);
        matrix_of(file, plan, moves, map, matrix);
        for (int32_t k = 0; k < 12; k++) at[k] = mixed(at[k], (float)matrix[k], found->share[index]);
    }
}

int ath_faded_matrices(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                       const ath_fade *fade, float *out, size_t stride)
{
    faded_frames found = find_faded(file, segments, segment_count, frame, fade);
    for (int32_t i = 0; i < found.count && found.result != ATH_NOT_PREPARED; i++)
        fade_matrices(file, &found, i, out, stride);
    return found.result;
}

/* Shows the exact vertices of a deeper level. Nodes of any level move some of them, from the rest pose of level 1. */
static void fade_exact(const ath_file *file, const shown_frames *shown, const ath_segment *cut, const target *to)
{
    const ath_part *moves = shown->segment[0]->parts;
    const ath_plan *posed = ath_stage_plan(file, cut->stage > 0 ? 1 : 0);
    for (const ath_part *part = cut->parts; part < cut->parts + cut->part_count; part++) {
        int32_t end = part->first + part->count, next;
        for (int32_t first = part->first; part->branch < 0 && first < end; first = next) {
            moves = part_with(moves, first);
            next = moves->first + moves->count < end ? moves->first + moves->count : end;
            put_part(file, shown, moves, posed, (size_t)first, (size_t)(next - first),
                     (size_t)(part->index + first - part->first), to);
        }
    }
}

int ath_faded_exact(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                    const ath_fade *fade, float *xyz, size_t stride)
{
    faded_frames found = find_faded(file, segments, segment_count, frame, fade);
    target to = target_of(file, ATH_FILE_ORDER, xyz, stride, 0);
    for (int32_t i = 0; i < found.count && found.result != ATH_NOT_PREPARED; i++) {
        to.share = found.share[i];
        fade_exact(file, found.shown + i, found.cut, &to);
    }
    return found.result;
}

/* ---- level of detail ---- */

int32_t ath_level_for(const ath_file *file, int32_t first_segment, int32_t last_segment, ath_measure measure,
                      double distance, double fov, double height, double pixels)
{
    int32_t deepest = file->info.level_count - 1;
    if (!(distance > 0.0 && fov > 0.0 && fov < 3.141592653589793)) return deepest;
    double pixels_per_unit = height / (2.0 * distance * ath_tan_of_half(fov));
    for (int32_t level = 0; level < deepest; level++)
        if (ath_level_error(file, level, first_segment, last_segment, measure) * pixels_per_unit <= pixels)
            return level;
    return deepest;
}
