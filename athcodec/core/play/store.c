/* Puts vertices placed as doubles into the positions of a segment: rows over time become frames. Copies frames. */
#include "play/store.h"

void ath_store_doubles(ath_segment *segment, const double origin[3], size_t position, int32_t count,
                       const double *placed)
{
    size_t frame_size = 3 * (size_t)segment->exact_vertices, T = (size_t)segment->frames;
    double *out = (double *)segment->positions + 3 * position;
    for (size_t r = 0; r < 3 * (size_t)count; r++)
        for (size_t t = 0; t < T; t++) out[t * frame_size + r] = placed[r * T + t] + origin[r % 3];
}

/* Copies `count` vertices in frames of as many vertices as the segment has. */
static void copy_frames(const ath_segment *segment, void *to, const void *from, size_t frames, size_t count)
{
    size_t number = ath_number_size(segment->is_float64), frame = 3 * (size_t)segment->exact_vertices * number;
    for (size_t t = 0; t < frames; t++)
        memcpy((uint8_t *)to + t * frame, (const uint8_t *)from + t * frame, 3 * count * number);
}

void ath_copy_vertices(const ath_file *file, ath_segment *segment, const ath_segment *from, size_t vertex, size_t count)
{
    void *to = ath_vertex_at(segment, segment->positions, 0, ath_position_of(file, segment, vertex));
    const void *of = ath_vertex_at(from, from->positions, 0, ath_position_of(file, from, vertex));
    copy_frames(from, to, of, (size_t)from->frames, count);
    if (from->end)
        copy_frames(from, ath_vertex_at(segment, segment->end, 0, vertex), ath_vertex_at(from, from->end, 0, vertex),
                    ATH_END_FRAMES, count);
}

void ath_keep_end(ath_segment *segment, size_t position, size_t vertex, size_t count)
{
    size_t frames = (size_t)segment->frames;
    if (!segment->end || frames < ATH_END_FRAMES) return;
    copy_frames(segment, ath_vertex_at(segment, segment->end, 0, vertex),
                ath_vertex_at(segment, segment->positions, frames - ATH_END_FRAMES, position), ATH_END_FRAMES, count);
}
