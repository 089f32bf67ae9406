/* Placed vertices put into the positions of a segment. A `position` is that of the first vertex, ath_position_of. */
#ifndef ATH_PLAY_STORE_H
#define ATH_PLAY_STORE_H

#include "play/segment.h"

/* Puts `count` placed vertices (3 x frames each, relative to the origin) from a position on as doubles. */
void ath_store_doubles(ath_segment *segment, const double origin[3], size_t position, int32_t count,
                       const double *placed);
/* Copies exact vertices, and their end, from the same segment at another level. */
void ath_copy_vertices(const ath_file *file, ath_segment *segment, const ath_segment *from, size_t vertex,
                       size_t count);
/* Keeps the last frames of exact vertices for the segment that is joined to this one. */
void ath_keep_end(ath_segment *segment, size_t position, size_t vertex, size_t count);

#endif
