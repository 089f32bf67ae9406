/* Exact numbers, coded as differences from a prediction (FORMAT.md, "Exact numbers"). Compiled for each direction. */
#ifndef ATH_BITS_EXACT_INL
#define ATH_BITS_EXACT_INL

#include "bits/numbers.inl"

enum { EXACT_BITS = 64 };

typedef struct {
    ath_context size[EXACT_BITS + 1][EXACT_BITS]; /* by the length of the difference before */
    ath_context mantissa[EXACT_BITS][MANTISSA_CONTEXTS];
} exact_model;

static void exact_model_init(exact_model *model)
{
    for (int32_t before = 0; before <= EXACT_BITS; before++)
        for (int32_t bin = 0; bin < EXACT_BITS; bin++) context_init(&model->size[before][bin], 60000);
    for (int32_t bin = 0; bin < EXACT_BITS; bin++)
        for (int32_t i = 0; i < MANTISSA_CONTEXTS; i++) context_init(&model->mantissa[bin][i], 30000);
}

static uint64_t bits_of(double number, int is_float64)
{
    uint64_t bits;
    uint32_t narrow_bits;
    float narrow;
    if (is_float64) {
        memcpy(&bits, &number, sizeof bits);
        return bits;
    }
    narrow = (float)number;
    memcpy(&narrow_bits, &narrow, sizeof narrow_bits);
    return narrow_bits;
}

static double number_of(uint64_t bits, int is_float64)
{
    uint32_t narrow_bits = (uint32_t)bits;
    double number;
    float narrow;
    if (is_float64) {
        memcpy(&number, &bits, sizeof number);
        return number;
    }
    memcpy(&narrow, &narrow_bits, sizeof narrow);
    return (double)narrow;
}

static int is_finite(uint64_t bits, int is_float64)
{
    uint64_t exponent = is_float64 ? (uint64_t)0x7FF << 52 : (uint64_t)0xFF << 23;
    return (bits & exponent) != exponent;
}

/* Maps bits to integers in the order of the numbers, with -0 right below 0, and back. `sign` is the top bit. */
static uint64_t ordered_of(uint64_t bits, uint64_t sign)
{
    return bits & sign ? ~bits & (sign | (sign - 1)) : bits | sign;
}

static uint64_t bits_of_ordered(uint64_t ordered, uint64_t sign)
{
    return ordered & sign ? ordered ^ sign : ~ordered & (sign | (sign - 1));
}

static uint64_t code_difference(ath_coder *coder, exact_model *model, int32_t bits, int32_t *length, uint64_t magnitude,
                                int negative)
{
    uint32_t high = (uint32_t)(magnitude >> 32);
    ath_context *size = model->size[*length];
    int32_t given = high ? 32 + bit_length(high) : bit_length((uint32_t)magnitude), coded = 0;
    while (coded < bits && coder_bit(coder, &size[coded], coded < given)) coded++;
    *length = coded;
    if (coded == 0) return 0;
    magnitude = code_mantissa(coder, model->mantissa[coded - 1], coded, magnitude);
    return coder_raw_bit(coder, negative) ? 0 - magnitude : magnitude;
}

/* Codes a number by its difference from `expected`. length: bits of the last difference. */
static int code_exact(ath_coder *coder, exact_model *model, int is_float64, double expected, int32_t *length,
                      double *number)
{
    uint64_t sign = (uint64_t)1 << (is_float64 ? 63 : 31), bits = bits_of(expected, is_float64);
    uint64_t from = ordered_of(is_finite(bits, is_float64) ? bits : 0, sign), difference = 0;
    if (ENCODING) difference = (ordered_of(bits_of(*number, is_float64), sign) - from) & (sign | (sign - 1));
    int negative = (difference & sign) != 0;
    if (negative) difference = (0 - difference) & (sign | (sign - 1));
    difference = code_difference(coder, model, is_float64 ? 64 : 32, length, difference, negative);
    bits = bits_of_ordered((from + difference) & (sign | (sign - 1)), sign);
    *number = number_of(bits, is_float64);
    return is_finite(bits, is_float64);
}

static int code_exact_point(ath_coder *coder, exact_model *model, int is_float64, const double expected[3],
                            int32_t length[3], double number[3])
{
    for (int32_t k = 0; k < 3; k++)
        if (!code_exact(coder, model, is_float64, expected[k], &length[k], number + k)) return 0;
    return 1;
}

#endif
