/* Puts placed vertices into the positions of a segment: rows over time become frames. */
#include "play/store.h"
#include "model/lanes.h"

enum { TILE = 8, CACHE_LINE = 16 /* floats */ };

/* Prefetches the memory behind a piece, which the next piece fills. */
ATH_INLINE void expect_next(float *next, int32_t rows, int32_t start, int32_t stop, size_t frame_size)
{
    for (int32_t r = 0; r < rows; r += CACHE_LINE)
        for (int32_t t = start; t < stop; t++)
            ath_expect_write((uintptr_t)next + ((size_t)t * frame_size + (size_t)(r + CACHE_LINE - 1)) * sizeof *next);
}

ATH_HOT static void store_floats(const double *placed, int32_t rows, int32_t T, const double origin[3], float *out,
                                 size_t frame_size)
{
    double added[3 + ATH_LANES];
    int32_t whole = rows - rows % ATH_LANES;
    for (int32_t i = 0; i < 3 + ATH_LANES; i++) added[i] = origin[i % 3];
    for (int32_t start = 0; start < T; start += TILE) {
        int32_t stop = ath_min(start + TILE, T), squares = start + (stop - start) / ATH_LANES * ATH_LANES;
        expect_next(out + rows, rows, start, stop, frame_size);
        for (int32_t r = 0; r < rows; r += ATH_LANES) {
            const double *from = placed + (size_t)r * (size_t)T;
            float *to = out + r;
            int32_t t = start;
            for (; r < whole && t < squares; t += ATH_LANES)
                lanes_transpose(from + t, (size_t)T, added + r % 3, to + (size_t)t * frame_size, frame_size);
            for (; t < stop; t++)
                for (int32_t i = 0; i < ath_min(ATH_LANES, rows - r); i++)
                    to[(size_t)t * frame_size + (size_t)i] = (float)(from[i * T + t] + added[r % 3 + i]);
        }
    }
}

static void store_doubles(const double *placed, int32_t rows, int32_t T, const double origin[3], double *out,
                          size_t frame_size)
{
    for (int32_t r = 0; r < rows; r++)
        for (int32_t t = 0; t < T; t++)
            out[(size_t)t * frame_size + (size_t)r] = placed[(size_t)r * (size_t)T + (size_t)t] + origin[r % 3];
}

void ath_store_vertices(ath_segment *segment, const double origin[3], size_t vertex, int32_t count,
                        const double *placed)
{
    size_t frame_size = 3 * (size_t)segment->exact_vertices;
    void *out = ath_vertex_at(segment, segment->positions, 0, vertex);
    if (segment->is_float64)
        store_doubles(placed, 3 * count, segment->frames, origin, (double *)out, frame_size);
    else
        store_floats(placed, 3 * count, segment->frames, origin, (float *)out, frame_size);
}

static void copy_frames(const ath_segment *segment, void *to, size_t to_frame, void *from, size_t from_frame,
                        size_t frames, size_t vertex, size_t count)
{
    size_t size = 3 * count * ath_number_size(segment->is_float64);
    for (size_t t = 0; t < frames; t++)
        memcpy(ath_vertex_at(segment, to, to_frame + t, vertex), ath_vertex_at(segment, from, from_frame + t, vertex),
               size);
}

void ath_copy_vertices(ath_segment *segment, const ath_segment *from, size_t vertex, size_t count)
{
    copy_frames(from, segment->positions, 0, from->positions, 0, (size_t)from->frames, vertex, count);
    if (from->end) copy_frames(from, segment->end, 0, from->end, 0, ATH_END_FRAMES, vertex, count);
}

void ath_keep_end(ath_segment *segment, size_t vertex, size_t count)
{
    size_t frames = (size_t)segment->frames;
    if (!segment->end || frames < ATH_END_FRAMES) return;
    copy_frames(segment, segment->end, 0, segment->positions, frames - ATH_END_FRAMES, ATH_END_FRAMES, vertex, count);
}
