/* What is kept of a prepared segment for a layer that refines it: bytes without pointers, so that their owner may move
 * them. A head; the streams of all levels so far, as later ones may begin with their bases; then, piece by piece, the
 * integers of the layer's rows, small numbers mostly. */
#ifndef ATH_KEPT_H
#define ATH_KEPT_H

#include "internal.h"

enum { KEPT_NUMBER = 5 }; /* bytes that a number takes at most */

typedef struct {
    uint64_t bytes; /* 0: nothing is kept, or not all of it yet */
    int32_t segment, level;
} kept_head;

/* Of ath_stream. The waves of a learned basis follow, temporal_rank x frames floats, which hold them exactly. */
typedef struct {
    double step, rotation_step_factor;
    int32_t temporal_rank, root;
} kept_stream;

typedef struct {
    uint8_t *at, *end; /* at null: nothing is kept, or there was no room for it */
} kept_writer;

ATH_INLINE size_t kept_row_most(int32_t frames) { return KEPT_NUMBER * (1 + 3 * (size_t)frames); }

/* Where the next `size` bytes go; null: nowhere. */
static void *kept_take(kept_writer *to, size_t size)
{
    uint8_t *at = to->at && (size_t)(to->end - to->at) >= size ? to->at : 0;
    to->at = at ? at + size : 0;
    return at;
}

ATH_INLINE uint8_t *put_number(uint8_t *at, uint32_t number)
{
    for (; number > 127; number >>= 7) *at++ = (uint8_t)(number | 128);
    *at++ = (uint8_t)number;
    return at;
}

ATH_INLINE const uint8_t *get_number(const uint8_t *at, uint32_t *number)
{
    int32_t shift = 0;
    for (*number = 0; *at > 127; shift += 7) *number |= (uint32_t)(*at++ & 127) << shift;
    *number |= (uint32_t)*at++ << shift;
    return at;
}

static void keep_number(kept_writer *to, int32_t number)
{
    uint8_t *at = (uint8_t *)kept_take(to, KEPT_NUMBER);
    if (at) to->at = put_number(at, (uint32_t)number);
}

/* Three axes of `frames` integers, of which those from `count` on are 0. */
static void keep_row(kept_writer *to, const int32_t *row, int32_t frames, int32_t count)
{
    uint8_t *at = (uint8_t *)kept_take(to, kept_row_most(count));
    if (!at) return;
    at = put_number(at, (uint32_t)count);
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < count; k++) {
            int32_t number = row[axis * frames + k];
            at = put_number(at, (uint32_t)number << 1 ^ (number < 0 ? 0xffffffffu : 0));
        }
    to->at = at;
}

/* The row is zero on entry. */
static const uint8_t *kept_row(const uint8_t *at, int32_t *row, int32_t frames, int32_t *count)
{
    uint32_t number;
    at = get_number(at, &number);
    *count = (int32_t)number;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < *count; k++) {
            at = get_number(at, &number);
            row[axis * frames + k] = (int32_t)(number >> 1) ^ -(int32_t)(number & 1);
        }
    return at;
}

#endif
