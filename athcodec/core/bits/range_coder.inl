/* The adaptive binary range coder of FORMAT.md, "Range coder": 64-bit interval, 32-bit renormalisation, 16-bit
 * probabilities whose rate of adaptation falls from 2/5 to 1/95 as a context gathers experience.
 *
 * Models that use it are written once and compiled twice: `coder_bit` returns the bit it decoded, or encodes the bit it
 * is given and returns that. A file that defines ATH_ENCODING before including this header gets the encoder. */
#ifndef ATH_BITS_RANGE_CODER_INL
#define ATH_BITS_RANGE_CODER_INL

#include "bits/platform.h"

typedef struct {
    uint16_t one;        /* probability of a 1, in 1/65536 */
    uint16_t experience; /* bits seen, up to RATE_LIMIT */
} ath_context;

enum { RATE_LIMIT = 60, PROBABILITY_MIN = 48 };

/* 65536 / (experience + 2.5) and at last 65536 / 95, rounded down */
static const uint16_t ath_rate[RATE_LIMIT + 1] = {
    26214, 18724, 14563, 11915, 10082, 8738, 7710, 6898, 6241, 5698, 5242, 4854, 4519, 4228, 3971, 3744,
    3542,  3360,  3196,  3048,  2912,  2788, 2674, 2570, 2473, 2383, 2299, 2221, 2148, 2080, 2016, 1956,
    1899,  1846,  1795,  1747,  1702,  1659, 1618, 1579, 1542, 1506, 1472, 1440, 1409, 1379, 1351, 1323,
    1297,  1272,  1248,  1224,  1202,  1180, 1159, 1139, 1120, 1101, 1083, 1065, 690};

ATH_INLINE void context_learn(ath_context *context, int bit)
{
    uint32_t rate = ath_rate[context->experience];
    uint32_t one = context->one;
    if (bit) {
        one += ((65536u - one) * rate) >> 16;
        if (one > 65536u - PROBABILITY_MIN) one = 65536u - PROBABILITY_MIN;
    } else {
        one -= (one * rate) >> 16;
        if (one < PROBABILITY_MIN) one = PROBABILITY_MIN;
    }
    context->one = (uint16_t)one;
    context->experience = (uint16_t)(context->experience + (context->experience < RATE_LIMIT));
}

ATH_INLINE void context_init(ath_context *context, uint32_t one)
{
    if (one < PROBABILITY_MIN) one = PROBABILITY_MIN;
    if (one > 65536u - PROBABILITY_MIN) one = 65536u - PROBABILITY_MIN;
    context->one = (uint16_t)one;
    context->experience = 0;
}

#ifdef ATH_ENCODING

enum { ENCODING = 1 };

typedef struct {
    uint64_t low, range;
    uint8_t *bytes;
    size_t size, capacity;
    int overflow;
} ath_coder;

static void coder_start(ath_coder *coder, uint8_t *bytes, size_t capacity)
{
    coder->low = 0;
    coder->range = ~(uint64_t)0;
    coder->bytes = bytes;
    coder->size = 0;
    coder->capacity = capacity;
    coder->overflow = 0;
}

static void coder_carry(ath_coder *coder)
{
    size_t at = coder->size;
    while (at > 0 && ++coder->bytes[--at] == 0) {
    }
}

static void coder_shift(ath_coder *coder)
{
    if (coder->size + 4 > coder->capacity) {
        coder->overflow = 1;
        coder->size = 0;
    }
    for (int shift = 56; shift >= 32; shift -= 8) coder->bytes[coder->size++] = (uint8_t)(coder->low >> shift);
    coder->low <<= 32;
    coder->range <<= 32;
}

ATH_INLINE void coder_narrow(ath_coder *coder, uint64_t bound, int bit)
{
    if (bit) {
        coder->range = bound;
    } else {
        uint64_t low = coder->low + bound;
        if (low < coder->low) coder_carry(coder);
        coder->low = low;
        coder->range -= bound;
    }
    if (coder->range < (uint64_t)1 << 32) coder_shift(coder);
}

ATH_INLINE int coder_bit(ath_coder *coder, ath_context *context, int bit)
{
    coder_narrow(coder, (coder->range >> 16) * context->one, bit);
    context_learn(context, bit);
    return bit;
}

/* Codes a bit that is 0 about as often as 1. */
ATH_INLINE int coder_even_bit(ath_coder *coder, ath_context *context, int bit)
{
    return coder_bit(coder, context, bit);
}

ATH_INLINE int coder_raw_bit(ath_coder *coder, int bit)
{
    coder_narrow(coder, coder->range >> 1, bit);
    return bit;
}

/* Writes the shortest bytes that name a number of the last interval, without zeros at the end. Returns the size; -1:
 * the bytes did not fit. */
static int64_t coder_finish(ath_coder *coder)
{
    uint64_t last = coder->low + (coder->range - 1), value = last;
    for (int keep = 0; keep < 64; keep++) {
        uint64_t mask = keep == 0 ? 0 : ~(uint64_t)0 << (64 - keep);
        if (last < coder->low) { /* the interval wraps around, and 0 is in it */
            value = 0;
            coder_carry(coder);
            break;
        }
        value = last & mask;
        if (value >= coder->low) break;
    }
    coder->low = value;
    coder_shift(coder);
    coder_shift(coder);
    while (coder->size > 0 && coder->bytes[coder->size - 1] == 0) coder->size--;
    return coder->overflow ? -1 : (int64_t)coder->size;
}

#else

enum { ENCODING = 0 };

typedef struct {
    uint64_t code, range;
    const uint8_t *bytes;
    size_t size, at;
} ath_coder;

/* Returns the next four bytes. Bytes behind the end are 0. */
ATH_INLINE uint32_t coder_word(ath_coder *coder)
{
    uint32_t word = 0;
    if (coder->at + 4 <= coder->size) {
        const uint8_t *from = coder->bytes + coder->at;
        word = (uint32_t)from[0] << 24 | (uint32_t)from[1] << 16 | (uint32_t)from[2] << 8 | from[3];
    } else {
        for (size_t i = coder->at; i < coder->size; i++)
            word |= (uint32_t)coder->bytes[i] << (24 - 8 * (i - coder->at));
    }
    coder->at += 4;
    return word;
}

static void coder_start(ath_coder *coder, const uint8_t *bytes, size_t size)
{
    coder->range = ~(uint64_t)0;
    coder->bytes = bytes;
    coder->size = size;
    coder->at = 0;
    coder->code = (uint64_t)coder_word(coder) << 32;
    coder->code |= coder_word(coder);
}

ATH_INLINE void coder_renew(ath_coder *coder)
{
    if (coder->range < (uint64_t)1 << 32) {
        coder->range <<= 32;
        coder->code = coder->code << 32 | coder_word(coder);
    }
}

ATH_INLINE int coder_bit(ath_coder *coder, ath_context *context, int ignored)
{
    uint64_t bound = (coder->range >> 16) * context->one;
    int bit = coder->code < bound;
    (void)ignored;
    if (bit) {
        coder->range = bound;
    } else {
        coder->code -= bound;
        coder->range -= bound;
    }
    coder_renew(coder);
    context_learn(context, bit);
    return bit;
}

/* Does what context_learn does without a branch on the bit. */
ATH_INLINE void context_learn_either(ath_context *context, uint32_t bit)
{
    uint32_t rate = ath_rate[context->experience], one = context->one, unless = bit - 1;
    uint32_t way = (((one ^ ~unless) + (65537u & ~unless)) * rate) >> 16;
    one += (way ^ unless) - unless;
    if (one < PROBABILITY_MIN) one = PROBABILITY_MIN;
    if (one > 65536u - PROBABILITY_MIN) one = 65536u - PROBABILITY_MIN;
    context->one = (uint16_t)one;
    context->experience = (uint16_t)(context->experience + (context->experience < RATE_LIMIT));
}

/* Decodes a bit that is 0 about as often as 1, without a branch, which would be mispredicted. */
ATH_INLINE int coder_even_bit(ath_coder *coder, ath_context *context, int ignored)
{
    uint64_t bound = (coder->range >> 16) * context->one, bit = coder->code < bound, unless = bit - 1;
    (void)ignored;
    coder->code -= bound & unless;
    coder->range = bound + ((coder->range - 2 * bound) & unless);
    coder_renew(coder);
    context_learn_either(context, (uint32_t)bit);
    return (int)bit;
}

ATH_INLINE int coder_raw_bit(ath_coder *coder, int ignored)
{
    uint64_t half = coder->range >> 1, bit = coder->code < half, unless = bit - 1;
    (void)ignored;
    coder->code -= half & unless;
    coder->range = half + (coder->range & 1 & unless);
    coder_renew(coder);
    return (int)bit;
}

/* A stream is whole when its bytes were all read, nothing beyond them was needed except the zeros left out at the end,
 * and it does not end in a zero that should have been left out. */
static int coder_finish(const ath_coder *coder)
{
    if (coder->size > 0 && coder->bytes[coder->size - 1] == 0) return 0;
    return coder->at >= coder->size && coder->code < coder->range;
}

#endif
#endif
