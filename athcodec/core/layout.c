/* Between vertex-major segments in file order and frame-major arrays in the source's order. */
#include "motion.h"

enum { TILE = 16 };

void ath_scatter(int32_t vertex_count, int32_t frames, const int32_t *vertex_source, int wide, const void *positions,
                 int32_t from, int32_t to, void *out)
{
    size_t T = (size_t)frames, N = (size_t)vertex_count;
    for (int32_t start = from; start < to; start += TILE)
        for (size_t v = 0; v < N; v++) {
            size_t target = (size_t)vertex_source[v];
            for (size_t axis = 0; axis < 3; axis++) {
                size_t row = (v * 3 + axis) * T;
                for (int32_t t = start; t < ath_min(start + TILE, to); t++) {
                    size_t at = ((size_t)(t - from) * N + target) * 3 + axis;
                    if (wide)
                        ((double *)out)[at] = ((const double *)positions)[row + (size_t)t];
                    else
                        ((float *)out)[at] = ((const float *)positions)[row + (size_t)t];
                }
            }
        }
}

void ath_gather(int32_t vertex_count, int32_t frames, const int32_t *vertex_source, int wide, const void *source,
                const double origin[3], double *out)
{
    size_t T = (size_t)frames, N = (size_t)vertex_count;
    for (int32_t start = 0; start < frames; start += TILE)
        for (size_t v = 0; v < N; v++)
            for (size_t axis = 0; axis < 3; axis++)
                for (int32_t t = start; t < ath_min(start + TILE, frames); t++) {
                    size_t at = ((size_t)t * N + (size_t)vertex_source[v]) * 3 + axis;
                    double value = wide ? ((const double *)source)[at] : (double)((const float *)source)[at];
                    out[(v * 3 + axis) * T + (size_t)t] = value - origin[axis];
                }
}
