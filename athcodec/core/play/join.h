/* Joins: how a segment goes on where the one before it ends, so that motion does not tick at the seam. */
#ifndef ATH_PLAY_JOIN_H
#define ATH_PLAY_JOIN_H

#include "play/watch.h"

typedef struct {
    double *maps;    /* ATH_END_FRAMES x nodes x ATH_MAP: the end of the segment before */
    void *positions; /* ATH_END_FRAMES x exact vertices x 3: the end of the segment before */
    int32_t width;   /* frames; 0: the segment is not joined */
    double jumps[ATH_JOIN_SLOPED],
        slopes[ATH_JOIN_SLOPED]; /* shares of a jump and of a slope that are left at each frame */
} ath_join;

/* Carves room for the end of a segment at any level. */
void ath_carve_end(ath_join *join, const ath_file *file, ath_arena *arena);
/* Copies the end of a prepared segment for the segment that is joined to it. */
void ath_take_end(ath_join *join, const ath_segment *before);
/* Sets the width and the shares for an entry of ath_joins. */
void ath_set_join(ath_join *join, int32_t how);
/* Join `count` exact vertices, whose first has this position (ath_position_of), and the map of a node. watcher: null, or told by how much they are off. */
void ath_join_vertices(const ath_join *join, ath_segment *segment, size_t position, size_t vertex, size_t count,
                       ath_watcher *watcher);
void ath_join_map(const ath_join *join, ath_segment *segment, size_t index, ath_watcher *watcher);

#endif
