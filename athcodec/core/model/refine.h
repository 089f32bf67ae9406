/* From positions back to integers: projections on the bases, and what a layer of precision predicts from the layer
 * before (FORMAT.md, "Layers"). */
#ifndef ATH_MODEL_REFINE_H
#define ATH_MODEL_REFINE_H

#include "model/motion.h"

/* Returns the number of frequencies, at most `most`, up to which a row is not all 0. */
int32_t ath_row_extent(const int32_t *row, int32_t frames, int32_t most);
/* Returns whether all integers are 0. */
int ath_is_zero(const int32_t *integers, int32_t count);
/* Returns how many rows of a piece, from the first, have predictions. */
int32_t ath_predicted_modes(const ath_piece *piece, const ath_piece_before *before, const ath_piece_rows *rows);
/* Predict the integers of a piece's translation and of its rotation. For pieces that were rigid in the layer before,
 * scratch->at is the attach frame, before this track is applied. */
void ath_predict_shift(const ath_motion *motion, const ath_piece *piece, const ath_piece_before *before,
                       const ath_scratch *scratch, ath_piece_rows *rows);
void ath_predict_rotation(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                          const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows);
/* Predicts both tracks of a piece, as far as it has them, after ath_attach. */
void ath_predict_tracks(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                        const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows);
/* Predicts the integers of a piece's modes from its vertices in the layer before, seen from scratch->at. */
void ath_predict_modes(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows);
/* out = R^T (x - c), 3 x frames */
void ath_into_rest_space(int32_t frames, const ath_frames *at, const double *x, double *out);
/* Fills the vertices of a piece in its attach frame, less those of the rest pose. */
void ath_to_local(const ath_plan *plan, int32_t frames, const ath_piece *piece, const ath_frames *at,
                  const double *placed, double *local);
/* Fills the tracks of the first `count` modes, 3 x frames each, of vertices that ath_to_local gave. */
void ath_project(const ath_plan *plan, int32_t frames, const ath_piece *piece, int32_t count, const double *local,
                 double *rows);

#endif
