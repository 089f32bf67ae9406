/* Adaptive codes for integers (FORMAT.md, "Numbers"), compiled once for each direction. */
#ifndef ATH_BITS_NUMBERS_INL
#define ATH_BITS_NUMBERS_INL

#include "bits/range_coder.inl"

enum { NUMBER_CLASSES = 28, NUMBER_BINS = 30, MANTISSA_CONTEXTS = 3, MAGNITUDE_CLIP = 1 << 20 };

typedef struct {
    ath_context size[NUMBER_CLASSES][NUMBER_BINS + 2]; /* rows of whole cache lines */
    ath_context mantissa[NUMBER_BINS][MANTISSA_CONTEXTS];
} number_model;

/* Returns the bits in x: 0 for 0, 1 for 1, 2 for 2 and 3, ... */
ATH_INLINE int32_t bit_length(uint32_t x)
{
#if defined(__GNUC__)
    return x == 0 ? 0 : 32 - __builtin_clz(x);
#else
    int32_t length = 0;
    for (; x; x >>= 1) length++;
    return length;
#endif
}

ATH_INLINE uint32_t magnitude_of(int32_t value) { return (uint32_t)(value < 0 ? -value : value); }

/* Returns the magnitude that contexts see. */
ATH_INLINE uint32_t clipped(int32_t value)
{
    uint32_t magnitude = magnitude_of(value);
    return magnitude < MAGNITUDE_CLIP ? magnitude : (uint32_t)MAGNITUDE_CLIP;
}

/* Returns a running mean of magnitudes, in 1/16, after one more number. */
ATH_INLINE uint32_t averaged(uint32_t mean, int32_t value) { return mean - (mean + 4) / 8 + 2 * clipped(value); }

/* Returns the half-octave class of an expected magnitude in 1/16. Classes begin at 0, 1, 2, 3, 4, 6, 8, 12, 16, ... */
ATH_INLINE int32_t number_class(uint32_t expected)
{
    static const uint8_t small[128] = {
        0,  1,  2,  3,  4,  4,  5,  5,  6,  6,  6,  6,  7,  7,  7,  7,  8,  8,  8,  8,  8,  8,  8,  8,  9,  9,
        9,  9,  9,  9,  9,  9,  10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 11, 11, 11, 11,
        11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12,
        12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 12, 13, 13, 13, 13, 13, 13, 13, 13,
        13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13, 13};
    if (expected < sizeof small) return small[expected];
    int32_t length = bit_length(expected), half_octave = 2 * length - 2 + (int32_t)(expected >> (length - 2) & 1);
    return half_octave < NUMBER_CLASSES ? half_octave : NUMBER_CLASSES - 1;
}

/* Starting probabilities are those of a geometric distribution with the class's mean. */
static void number_model_init(number_model *model)
{
    for (int32_t c = 0; c < NUMBER_CLASSES; c++) {
        uint32_t mean =
            c < 2 ? (uint32_t)(c * 2 + 1) : (uint32_t)(5 + (c & 1) * 2) << (c / 2 - 1); /* in 1/32, middle of class c */
        uint32_t more = (uint32_t)(((uint64_t)mean << 16) / (mean + 32));
        for (int32_t bin = 0; bin < NUMBER_BINS; bin++) {
            context_init(&model->size[c][bin], more);
            if (bin > 0) more = (uint32_t)(((uint64_t)more * more) >> 16);
        }
    }
    for (int32_t bin = 0; bin < NUMBER_BINS; bin++)
        for (int32_t i = 0; i < MANTISSA_CONTEXTS; i++) context_init(&model->mantissa[bin][i], 30000);
}

/* Codes the bits of a number below its leading one. The first two have contexts. length: at least 1. */
ATH_INLINE uint64_t code_mantissa(ath_coder *coder, ath_context contexts[MANTISSA_CONTEXTS], int32_t length,
                                  uint64_t value)
{
    uint64_t built = 1;
    for (int32_t bit = length - 2; bit >= 0; bit--) {
        int given = (int)(value >> bit & 1);
        int32_t taken = length - 2 - bit;
        int coded = taken < 2 ? coder_even_bit(coder, &contexts[taken ? 1 + (built & 1) : 0], given)
                              : coder_raw_bit(coder, given);
        built = built << 1 | (uint64_t)coded;
    }
    return built;
}

/* Codes a number below 2^30 under a class of expected magnitudes. */
ATH_INLINE uint32_t code_in_class(ath_coder *coder, number_model *model, int32_t about, uint32_t value)
{
    ath_context *size = model->size[about];
    int32_t length = bit_length(value), coded = 0;
    while (coded < NUMBER_BINS && coder_bit(coder, &size[coded], coded < length)) coded++;
    if (coded == 0) return 0;
    return (uint32_t)code_mantissa(coder, model->mantissa[coded - 1], coded, value);
}

ATH_INLINE uint32_t code_unsigned(ath_coder *coder, number_model *model, uint32_t expected, uint32_t value)
{
    return code_in_class(coder, model, number_class(expected), value);
}

/* sign: null if nothing is known of it. */
ATH_INLINE int32_t code_signed_in_class(ath_coder *coder, number_model *model, int32_t about, ath_context *sign,
                                        int32_t value)
{
    uint32_t magnitude = code_in_class(coder, model, about, magnitude_of(value));
    if (magnitude == 0) return 0;
    int negative = sign ? coder_bit(coder, sign, value < 0) : coder_raw_bit(coder, value < 0);
    return negative ? -(int32_t)magnitude : (int32_t)magnitude;
}

ATH_INLINE int32_t code_signed(ath_coder *coder, number_model *model, uint32_t expected, int32_t value)
{
    return code_signed_in_class(coder, model, number_class(expected), 0, value);
}

/* Rounds a value to steps. Fractions of at least `half` round away from 0; 0.5 rounds to the nearest. */
ATH_INLINE int32_t steps_in(double value, double step, double half)
{
    double units = value / step;
    if (!(units > -1073741823.0)) return -1073741823;
    if (!(units < 1073741823.0)) return 1073741823;
    return units < 0.0 ? -(int32_t)(1.0 - half - units) : (int32_t)(1.0 - half + units);
}

#endif
