/* Heads of chunks. */
#ifndef ATH_PLAY_HEADS_H
#define ATH_PLAY_HEADS_H

#include "play/work.h"

/* Opens the streams of the next stage and, behind the last one, those that have no stage. */
int ath_open_stage(ath_work *work);

#endif
