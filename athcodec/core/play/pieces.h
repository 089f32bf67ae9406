/* Pieces and nodes. */
#ifndef ATH_PLAY_PIECES_H
#define ATH_PLAY_PIECES_H

#include "play/work.h"

/* Prepares the next piece, and the node that begins with it. */
int ath_do_piece(ath_work *work);

#endif
