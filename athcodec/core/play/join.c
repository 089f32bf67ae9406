/* Joins a segment to the one before it: what it is off by fades out over its first frames. */
#include "play/join.h"

void ath_carve_end(ath_join *join, const ath_file *file, ath_arena *arena)
{
    uint64_t nodes = (uint64_t)file->plan.node_count, vertices = (uint64_t)file->plan.vertex_count;
    join->maps = (double *)ath_take(arena, ATH_END_FRAMES * nodes * ATH_MAP * sizeof(double));
    join->positions = ath_take(arena, ATH_END_FRAMES * vertices * 3 * ath_number_size(file->info.is_float64));
}

void ath_take_end(ath_join *join, const ath_segment *before)
{
    size_t maps = ATH_END_FRAMES * (size_t)before->node_count * ATH_MAP;
    size_t all_maps = (size_t)before->frames * (size_t)before->node_count * ATH_MAP;
    size_t number = ath_number_size(before->is_float64);
    memcpy(join->maps, before->maps + (all_maps - maps), maps * sizeof(double));
    memcpy(join->positions, before->end, ATH_END_FRAMES * 3 * (size_t)before->exact_vertices * number);
}

/* The shares of a jump and of a slope fall to 0 with level ends and the least bending: they are parabolas, which turn
 * halfway (jumps), or where 1 - sqrt(1/2) of the frames are left (slopes). */
void ath_set_join(ath_join *join, int32_t how)
{
    const double turn = 0.70710678118654752440, bend = 0.5 + turn;
    join->width = how % ATH_JOIN_SLOPED;
    for (int32_t t = 0; t < join->width; t++) {
        double w = (double)join->width, u = ((double)t + 0.5) / w, left = 1.0 - u;
        join->jumps[t] = u < 0.5 ? 1.0 - 2.0 * u * u : 2.0 * left * left;
        join->slopes[t] = how < ATH_JOIN_SLOPED ? 0.0 : w * (u < turn ? u - bend * u * u : bend * left * left);
    }
}

/* Fills how far a number is off, in value and in slope, midway between the last frame before the seam and the first
 * frame behind it. start, end: the last two frames before; first, second: the first two behind. */
ATH_INLINE void set_off(double start, double end, double first, double second, double off[2])
{
    off[0] = 0.5 * (3.0 * (end - first) - (start - second));
    off[1] = (end - start) - (second - first);
}

ATH_INLINE double joined(const ath_join *join, int32_t t, double x, const double off[2])
{
    return x + (off[0] * join->jumps[t] + off[1] * join->slopes[t]);
}

ATH_HOT static void join_floats(const ath_join *join, const float *start, const float *end, float *x, size_t count,
                                size_t frame_size)
{
    double off[3 * ATH_PIECE_VERTICES][2];
    for (size_t i = 0; i < count; i++)
        set_off((double)start[i], (double)end[i], (double)x[i], (double)x[frame_size + i], off[i]);
    for (int32_t t = 0; t < join->width; t++, x += frame_size)
        for (size_t i = 0; i < count; i++) x[i] = (float)joined(join, t, (double)x[i], off[i]);
}

static void join_doubles(const ath_join *join, const double *start, const double *end, double *x, size_t count,
                         size_t frame_size)
{
    double off[3 * ATH_PIECE_VERTICES][2];
    for (size_t i = 0; i < count; i++) set_off(start[i], end[i], x[i], x[frame_size + i], off[i]);
    for (int32_t t = 0; t < join->width; t++, x += frame_size)
        for (size_t i = 0; i < count; i++) x[i] = joined(join, t, x[i], off[i]);
}

static void watch_join(const ath_join *join, ath_watcher *watcher, const void *start, const void *end, const void *x,
                       size_t count, size_t frame_size, int is_float64)
{
    double off[3 * ATH_PIECE_VERTICES][2];
    if (!watcher) return;
    for (size_t i = 0; i < count; i++)
        set_off(ath_number_at(start, i, is_float64), ath_number_at(end, i, is_float64), ath_number_at(x, i, is_float64),
                ath_number_at(x, frame_size + i, is_float64), off[i]);
    watcher->join(watcher, join->width, join->jumps, join->slopes, (int32_t)count, off);
}

void ath_join_vertices(const ath_join *join, ath_segment *segment, size_t position, size_t vertex, size_t count,
                       ath_watcher *watcher)
{
    size_t numbers = 3 * count, frame_size = 3 * (size_t)segment->exact_vertices;
    const void *start = ath_vertex_at(segment, join->positions, 0, vertex);
    const void *end = ath_vertex_at(segment, join->positions, 1, vertex);
    void *x = ath_vertex_at(segment, segment->positions, 0, position);
    watch_join(join, watcher, start, end, x, numbers, frame_size, segment->is_float64);
    if (segment->is_float64)
        join_doubles(join, (const double *)start, (const double *)end, (double *)x, numbers, frame_size);
    else
        join_floats(join, (const float *)start, (const float *)end, (float *)x, numbers, frame_size);
}

void ath_join_map(const ath_join *join, ath_segment *segment, size_t index, ath_watcher *watcher)
{
    size_t frame_size = (size_t)segment->node_count * ATH_MAP;
    const double *start = join->maps + index * ATH_MAP, *end = start + frame_size;
    double *maps = segment->maps + index * ATH_MAP;
    watch_join(join, watcher, start, end, maps, ATH_MAP, frame_size, 1);
    join_doubles(join, start, end, maps, ATH_MAP, frame_size);
}
