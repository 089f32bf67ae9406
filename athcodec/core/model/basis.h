/* Orthonormal bases: modes of pieces in space, waves in time (FORMAT.md, "Bases"). */
#ifndef ATH_MODEL_BASIS_H
#define ATH_MODEL_BASIS_H

#include "model/plan.h"

/* int32_t that ath_basis_layout needs as `table`. */
ATH_ENCODER_API size_t ath_basis_table_size(int32_t piece_count);
/* Fills the pieces' offsets, stages and tip weights, and `gaps` (vertex_count bytes, scratch). Returns the doubles that all bases
 * need together. */
ATH_ENCODER_API int64_t ath_basis_layout(ath_piece *pieces, int32_t piece_count, const double *rest, uint8_t *gaps,
                                         int32_t *table);
/* Fills the bases that some of the stages are the first to take, from piece *next on, which counts up, for a budget.
 * `before` is null, or a plan of the same pieces about another rest pose: equal modes are copied from it. work:
 * ATH_BASIS_WORK doubles. Returns ATH_OK, or ATH_MORE once the budget is spent. */
enum { ATH_BASIS_WORK = 2 * ATH_PIECE_VERTICES * ATH_PIECE_VERTICES };
int ath_basis_fill(ath_piece *pieces, int32_t *next, int32_t piece_count, int32_t first_stage, int32_t last_stage,
                   const double *rest, const ath_plan *before, double *work, double *bases, int32_t *cost);
/* Fill the bases of a range of pieces in two passes: a sheet may need the modes of any piece. */
ATH_ENCODER_API void ath_basis_modes(const ath_piece *pieces, int32_t first, int32_t stop, const double *rest,
                                     double *work, double *bases);
ATH_ENCODER_API void ath_basis_sheets(ath_piece *pieces, int32_t first, int32_t stop, const double *rest,
                                      double *bases);
/* Fills n x n: the modes of an evenly spaced beam that leaves its base in any direction. work: 2 n x n doubles. */
void ath_rest_basis(int32_t n, double *basis, double *work);
/* Fills the eigenvalues, in descending order, and the eigenvectors, one per row, of `count` symmetric n x n matrices,
 * which are destroyed. n is at most ATH_SEGMENT_FRAMES. work: n x n doubles. */
ATH_ENCODER_API void ath_principal(int32_t count, int32_t n, double *matrices, double *work, double *values,
                                   double *vectors);

/* Eigenvectors of third differences, Fourier series, modes of a free beam. */
enum { ATH_SMOOTH, ATH_PERIODIC, ATH_BEAM, ATH_WAVE_KINDS };
/* Fills frames x frames, orthonormal: row k is wave k of its kind. */
ATH_ENCODER_API void ath_waves(int32_t frames, int32_t kind, double *waves);

/* Returns tan(x / 2) for 0 <= x < pi, by the series of sine and cosine. */
double ath_tan_of_half(double x);

#endif
