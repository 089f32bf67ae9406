/* A prepared segment, as preparing and playing see it. */
#ifndef ATH_PREPARED_H
#define ATH_PREPARED_H

#include "file/file.h"

enum { ATH_MAP = 12 }; /* doubles of a map x = c + R (x0 - a): R row by row, c relative to the origin */

struct ath_segment {
    int32_t index, level; /* level -1: not prepared */
    int32_t frames;       /* coded ones */
    int32_t exact_vertices, node_count, part_count;
    int32_t is_float64;
    ath_part *parts;
    double *maps;    /* frames x node_count x ATH_MAP */
    void *positions; /* frames x exact_vertices x 3, float or (is_float64) double, absolute */
    void *end;       /* ATH_END_FRAMES x exact_vertices x 3: the last ones, not corrected */
};

#endif
