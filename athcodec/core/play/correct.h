/* Corrections and exact numbers of a piece. */
#ifndef ATH_PLAY_CORRECT_H
#define ATH_PLAY_CORRECT_H

#include "play/work.h"

/* Correct a piece at its exact vertices, and replace the positions of the last lossy stage by the source's own. */
void ath_correct_piece(ath_work *work, const ath_piece *piece);
int ath_make_exact(ath_work *work, const ath_piece *piece);

#endif
