/* Integers are kept as bytes of seven bits, low ones first, the sign below them. */
#include "play/kept.h"

void *ath_kept_take(kept_writer *to, size_t size)
{
    uint8_t *at = to->at && (size_t)(to->end - to->at) >= size ? to->at : 0;
    to->at = at ? at + size : 0;
    return at;
}

void ath_keep_waves(kept_writer *to, const double *waves, size_t count)
{
    float *at = (float *)ath_kept_take(to, count * sizeof *at);
    for (size_t i = 0; at && i < count; i++) at[i] = (float)waves[i];
}

const uint8_t *ath_kept_waves(const uint8_t *at, double *waves, size_t count)
{
    const float *from = (const float *)(const void *)at;
    for (size_t i = 0; i < count; i++) waves[i] = (double)from[i];
    return at + count * sizeof *from;
}

static uint8_t *put_kept(uint8_t *at, int32_t number)
{
    uint32_t left = (uint32_t)number << 1 ^ (number < 0 ? 0xffffffffu : 0);
    for (; left > 127; left >>= 7) *at++ = (uint8_t)(left | 128);
    *at++ = (uint8_t)left;
    return at;
}

const uint8_t *ath_kept_number(const uint8_t *at, int32_t *number)
{
    uint32_t found = *at & 127;
    for (int32_t shift = 7; *at++ > 127; shift += 7) found |= (uint32_t)(*at & 127) << shift;
    *number = (int32_t)(found >> 1) ^ -(int32_t)(found & 1);
    return at;
}

void ath_keep_number(kept_writer *to, int32_t number)
{
    uint8_t *at = (uint8_t *)ath_kept_take(to, KEPT_NUMBER);
    if (at) to->at = put_kept(at, number);
}

void ath_keep_row(kept_writer *to, const int32_t *row, int32_t frames, int32_t count)
{
    uint8_t *at = (uint8_t *)ath_kept_take(to, kept_row_most(count));
    if (!at) return;
    at = put_kept(at, count);
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < count; k++) at = put_kept(at, row[axis * frames + k]);
    to->at = at;
}

const uint8_t *ath_kept_row(const uint8_t *at, int32_t *row, int32_t frames, int32_t *count)
{
    at = ath_kept_number(at, count);
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < *count; k++) at = ath_kept_number(at, row + axis * frames + k);
    return at;
}
