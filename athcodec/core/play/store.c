/* Puts vertices placed as doubles into the positions of a segment: rows over time become frames. Copies frames. */
#include "play/store.h"

void ath_store_doubles(ath_segment *segment, const double origin[3], size_t vertex, int32_t count, const double *placed)
{
    size_t frame_size = 3 * (size_t)segment->exact_vertices, T = (size_t)segment->frames;
    double *out = (double *)segment->positions + 3 * vertex;
    for (size_t r = 0; r < 3 * (size_t)count; r++)
        for (size_t t = 0; t < T; t++) out[t * frame_size + r] = placed[r * T + t] + origin[r % 3];
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
