/* An observer of a preparation, which is told what each piece and node is placed with. */
#ifndef ATH_PLAY_WATCH_H
#define ATH_PLAY_WATCH_H

#include "model/corrections.h"
#include "model/motion.h"
#include "play/segment.h"

typedef struct ath_watcher ath_watcher;

/* Bodies (the pieces and nodes that a level shows) come in file order. Joins and corrections belong to the last
 * body. */
struct ath_watcher {
    void (*piece)(ath_watcher *watcher, const ath_plan *plan, const ath_motion *motion, int32_t p,
                  const ath_piece_rows *rows);
    void (*node)(ath_watcher *watcher, const ath_plan *plan, const ath_motion *motion, int32_t n,
                 const ath_piece_rows *rows, const ath_node_rows *node_rows);
    /* `count` numbers are off by a jump and a slope each. Both fade out over `width` frames. */
    void (*join)(ath_watcher *watcher, int32_t width, const double *jumps, const double *slopes, int32_t count,
                 double off[][2]);
    void (*correction)(ath_watcher *watcher, int32_t position, int32_t frame, const ath_correction *own, double step);
    void (*done)(ath_watcher *watcher, const ath_motion *motion, const ath_segment *segment);
};

#endif
