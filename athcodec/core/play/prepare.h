/* How an observer follows a preparation. */
#ifndef ATH_PLAY_PREPARE_H
#define ATH_PLAY_PREPARE_H

#include "play/watch.h"

/* Call this between the call that begins a preparation and its first step. */
void ath_watch(ath_work *work, ath_watcher *watcher);
const ath_file *ath_watched_file(const ath_work *work);
int32_t ath_watched_level(const ath_work *work);

#endif
