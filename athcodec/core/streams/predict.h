/* Predicted motion: PREDICTED of a segment, decoded in steps. */
#ifndef ATH_STREAMS_PREDICT_H
#define ATH_STREAMS_PREDICT_H

#include "container/container.h"
#include "model/plan.h"

typedef struct ath_prediction ath_prediction;

/* Bytes of memory that a segment takes. */
uint64_t ath_prediction_size(int32_t vertex_count);
/* positions: frames x vertex_count x 3 in file order, float or (is_float64) double, which steps fill. ATH_OK or
 * ATH_BAD_CHUNK. */
int ath_prediction_start(ath_prediction *p, const ath_plan *plan, const double *origin, int32_t frames, int is_float64,
                         ath_bytes chunk, void *positions);
/* How many steps a segment takes, at most. */
int32_t ath_prediction_steps(int32_t vertex_count, int32_t frames);
/* ATH_MORE until the segment is whole. */
int ath_prediction_step(ath_prediction *p);

#endif
