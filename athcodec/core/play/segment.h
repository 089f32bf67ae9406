/* A prepared segment, as preparing and playing see it. */
#ifndef ATH_PLAY_SEGMENT_H
#define ATH_PLAY_SEGMENT_H

#include "file/file.h"

enum { ATH_MAP = 12 }; /* doubles of a map x = c + R (x0 - a): R row by row, c relative to the origin */

struct ath_segment {
    int32_t index, level; /* level -1: not prepared */
    int32_t stage;        /* of the level; pieces and nodes go by it */
    int32_t frames;       /* coded frames */
    int32_t exact_vertices, node_count, part_count;
    int32_t is_float64;
    int32_t in_source_order; /* 1: positions stand in the source's order, the vertices of a piece side by side */
    ath_part *parts;
    double *maps;    /* frames x node_count x ATH_MAP */
    void *positions; /* frames x exact_vertices x 3, float or (is_float64) double, absolute */
    void *end;       /* ATH_END_FRAMES x exact_vertices x 3: the last frames before corrections */
};

/* Returns the place of an exact vertex among the positions of a segment. */
ATH_INLINE size_t ath_position_of(const ath_file *file, const ath_segment *segment, size_t vertex)
{
    return segment->in_source_order ? (size_t)file->vertex_source[vertex] : vertex;
}

/* Returns where an exact vertex stands in `frames`, which hold as many vertices as the segment. */
ATH_INLINE void *ath_vertex_at(const ath_segment *segment, void *frames, size_t t, size_t vertex)
{
    size_t at = 3 * (t * (size_t)segment->exact_vertices + vertex);
    return (uint8_t *)frames + at * ath_number_size(segment->is_float64);
}

#endif
