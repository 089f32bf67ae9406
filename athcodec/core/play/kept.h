/* What is kept of a prepared segment for a layer that refines it: bytes without pointers, so that their owner may move
 * them. A head; the streams of all levels so far, as later ones may begin with their bases; then, piece by piece, the
 * integers of the layer's rows, small numbers mostly. */
#ifndef ATH_KEPT_H
#define ATH_KEPT_H

#include "bits/internal.h"

enum { KEPT_NUMBER = 5 }; /* bytes that a number takes at most */

typedef struct {
    uint64_t bytes; /* 0: nothing is kept, or not all of it yet */
    int32_t segment, level;
} kept_head;

/* Of ath_stream. The waves of a learned basis follow, temporal_rank x frames floats, which hold them exactly. */
typedef struct {
    double step, rotation_step_factor, turn_step;
    int32_t temporal_rank, root;
} kept_stream;

typedef struct {
    uint8_t *at, *end; /* at null: nothing is kept, or there was no room for it */
} kept_writer;

ATH_INLINE size_t kept_row_most(int32_t frames) { return KEPT_NUMBER * (1 + 3 * (size_t)frames); }

/* Where the next `size` bytes go; null: nowhere. */
void *ath_kept_take(kept_writer *to, size_t size);
void ath_keep_waves(kept_writer *to, const double *waves, size_t count);
void ath_keep_number(kept_writer *to, int32_t number);
/* Three axes of `frames` integers, of which those from `count` on are 0. */
void ath_keep_row(kept_writer *to, const int32_t *row, int32_t frames, int32_t count);

/* What is read, and where the next is. A row is zero on entry. */
const uint8_t *ath_kept_waves(const uint8_t *at, double *waves, size_t count);
const uint8_t *ath_kept_number(const uint8_t *at, int32_t *number);
const uint8_t *ath_kept_row(const uint8_t *at, int32_t *row, int32_t frames, int32_t *count);

#endif
