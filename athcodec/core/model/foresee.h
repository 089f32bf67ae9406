/* What a layer of precision predicts from the layer before, without the vertices of that. */
#ifndef ATH_MODEL_FORESEE_H
#define ATH_MODEL_FORESEE_H

#include "model/refine.h"

/* What places a piece in the layer before: its rows and tracks (see ath_pose_tracks), in its attach frame. */
typedef struct {
    const ath_plan *plan;
    const ath_piece_rows *rows;
    const ath_scratch *scratch;
    const uint8_t *used;
} ath_placing;

/* Predicts the integers of ath_predict_modes, into rows of zeros, from what places the vertices. Returns 0 where rounding
 * leaves one of them in doubt. */
int ath_foresee_modes(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_before *before,
                      const ath_placing *placing, const ath_scratch *scratch, ath_piece_rows *rows);

#endif
