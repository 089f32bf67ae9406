/* Decodes the streams of the prelude and of a learned time basis. */
#ifndef ATH_DECODE_H
#define ATH_DECODE_H

#include "plan.h"

/* Bytes of scratch memory that any of these needs as `model`. */
size_t ath_prelude_model_size(void);

/* ATH_OK or ATH_BAD_CHUNK. branches: zero on entry. */
int ath_decode_hierarchy(void *model, const uint8_t *bytes, size_t size, int32_t branch_count, int32_t vertex_count,
                         ath_branch *branches, int32_t *branch_source, int32_t *vertex_source);
/* coarse, before: integers and positions of the layer before, null for the first layer; steps: those of this one, null where none are wanted. */
int ath_decode_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches, int32_t branch_count,
                    double step, int adaptive, const int32_t *coarse, const double *before, int32_t *steps,
                    double *rest);
/* Positions as stored, floats or (is_float64) doubles, the origin not taken off. All are finite. */
int ath_decode_exact_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                          int32_t branch_count, int is_float64, double *rest);
/* All are finite; the caller checks that they increase. */
int ath_decode_times(void *model, const uint8_t *bytes, size_t size, int32_t frame_count, double *times);
/* rank x frames integers; `limit` stands for 1. */
int ath_decode_temporal(void *model, const uint8_t *bytes, size_t size, int32_t rank, int32_t frames, int32_t limit,
                        int32_t *basis);

#endif
