/* Decodes the PREDICTED chunk of a segment in steps. */
#ifndef ATH_STREAMS_PREDICT_H
#define ATH_STREAMS_PREDICT_H

#include "container/container.h"
#include "model/plan.h"

typedef struct ath_prediction ath_prediction;

/* Returns the bytes of memory that a segment takes. */
uint64_t ath_prediction_size(int32_t vertex_count);
/* Steps fill `positions`: frames x vertex_count x 3 in file order, float or (is_float64) double. If `loose_alone`, they
 * fill those of the trees of loose roots, and the others have to be numbers. Returns ATH_OK or ATH_BAD_CHUNK. */
int ath_prediction_start(ath_prediction *p, const ath_plan *plan, int loose_alone, const double *origin, int32_t frames,
                         int is_float64, ath_bytes chunk, void *positions);
/* Returns the most steps that a segment takes. */
int32_t ath_prediction_steps(int32_t vertex_count, int32_t frames);
/* Returns ATH_MORE until the segment is whole, then ATH_OK or ATH_BAD_CHUNK. */
int ath_prediction_step(ath_prediction *p);

#endif
