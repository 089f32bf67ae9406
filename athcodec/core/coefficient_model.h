/* The context model of quantised tracks (FORMAT.md, "Coefficient streams"), compiled once for each direction.
 *
 * A row is three axes of a series of integers over temporal frequency. Most energy sits in few rows and low
 * frequencies, so a row first says how many frequencies it codes, and each integer is coded under the magnitude that
 * its decoded neighbours lead one to expect: the frequencies before it, the other axes, the row before, and the same
 * row of the units before. */
#ifndef ATH_COEFFICIENT_MODEL_H
#define ATH_COEFFICIENT_MODEL_H

#include "number_model.h"

enum {
    COUNT_CLASSES = 6,
    COUNT_BINS = 10,
    SHIFT_SLOT = ATH_PIECE_VERTICES,
    OMEGA_SLOT,
    HISTORY_ROWS,
    MAGNITUDE_CLIP = 1 << 20
};

typedef struct {
    number_model number;
    ath_context empty[COUNT_CLASSES][COUNT_CLASSES];
    ath_context count_size[COUNT_CLASSES][COUNT_BINS];
    ath_context count_mantissa[COUNT_BINS][4];
    uint32_t history[HISTORY_ROWS][ATH_SEGMENT_FRAMES]; /* running mean magnitude of a row's frequency, in 1/16 */
    int32_t history_count[HISTORY_ROWS];
    int invalid; /* a row said that it codes more frequencies than there are */
} coefficient_model;

static void coefficient_model_init(coefficient_model *model)
{
    memset(model, 0, sizeof *model);
    number_model_init(&model->number);
    for (int32_t i = 0; i < COUNT_CLASSES; i++) {
        for (int32_t j = 0; j < COUNT_CLASSES; j++) context_init(&model->empty[i][j], 32768);
        for (int32_t bin = 0; bin < COUNT_BINS; bin++) context_init(&model->count_size[i][bin], 40000);
    }
    for (int32_t bin = 0; bin < COUNT_BINS; bin++)
        for (int32_t i = 0; i < 4; i++) context_init(&model->count_mantissa[bin][i], 32768);
}

ATH_INLINE int32_t count_class(int32_t count)
{
    return count == 0 ? 0 : count <= 2 ? 1 : count <= 6 ? 2 : count <= 14 ? 3 : count <= 30 ? 4 : 5;
}

/* How many frequencies a row codes, given how many the same row of the unit before and the row before coded. */
static int32_t code_count(ath_coder *coder, coefficient_model *model, int32_t history, int32_t above, int32_t limit,
                          int32_t count)
{
    if (coder_bit(coder, &model->empty[count_class(history)][count_class(above)], count == 0)) return 0;
    ath_context *size = model->count_size[count_class((history + above + 1) / 2)];
    int32_t length = bit_length((uint32_t)count), coded = 1;
    while (coded < COUNT_BINS && coder_bit(coder, &size[coded], coded < length)) coded++;
    int32_t built = 1;
    for (int32_t bit = coded - 2; bit >= 0; bit--) {
        int32_t taken = coded - 2 - bit;
        ath_context *context = &model->count_mantissa[coded - 1][taken == 0 ? 0 : taken == 1 ? 1 + (built & 1) : 3];
        built = built << 1 | coder_bit(coder, context, (int)(count >> bit & 1));
    }
    model->invalid |= built > limit;
    return ath_min(built, limit);
}

ATH_INLINE uint32_t clipped(int32_t value)
{
    uint32_t magnitude = magnitude_of(value);
    return magnitude < MAGNITUDE_CLIP ? magnitude : MAGNITUDE_CLIP;
}

ATH_INLINE uint32_t magnitude_at(const int32_t *axis, int32_t frames, int32_t k)
{
    return k < 0 || k >= frames ? 0 : clipped(axis[k]);
}

static int32_t used_frequencies(const int32_t *row, int32_t frames)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = frames; k > count; k--)
            if (row[axis * frames + k - 1] != 0) count = k;
    return count;
}

static void remember_row(coefficient_model *model, int32_t slot, int32_t frames, int32_t count, const int32_t *row)
{
    uint32_t *history = model->history[slot];
    model->history_count[slot] = count;
    for (int32_t k = 0; k < frames; k++) {
        uint32_t sum = k < count ? clipped(row[k]) + clipped(row[frames + k]) + clipped(row[2 * frames + k]) : 0;
        history[k] = history[k] - (history[k] + 3) / 4 + sum * 4 / 3;
    }
}

/* One row: three axes of `frames` integers, of which the first `rank` may be coded; `above` is the unit's row before,
 * or null; `slot` names the row in the history. When decoding, `row` is zero on entry. Returns how many frequencies
 * are coded. */
static int32_t code_row(ath_coder *coder, coefficient_model *model, int32_t frames, int32_t rank, int32_t slot,
                        const int32_t *above, int32_t above_count, int32_t *row)
{
    const uint32_t *history = model->history[slot];
    int32_t count = code_count(coder, model, model->history_count[slot], above_count, rank,
                               ENCODING ? used_frequencies(row, frames) : 0);
    for (int32_t k = 0; k < count; k++) {
        uint32_t before = 0, over = 0, beside = 0;
        for (int32_t axis = 0; axis < 3; axis++) {
            const int32_t *own = row + axis * frames;
            before += 2 * magnitude_at(own, frames, k - 1) + magnitude_at(own, frames, k - 2);
            if (!above) continue;
            const int32_t *other = above + axis * frames;
            over += 2 * magnitude_at(other, frames, k) + magnitude_at(other, frames, k - 1)
                    + magnitude_at(other, frames, k + 1);
        }
        for (int32_t axis = 0; axis < 3; axis++) {
            int32_t *own = row + axis * frames;
            uint32_t near = 2 * magnitude_at(own, frames, k - 1) + magnitude_at(own, frames, k - 2)
                            + magnitude_at(own, frames, k - 3);
            uint32_t around = axis == 0 ? history[k] : (beside * 16 / (uint32_t)axis + history[k]) / 2;
            own[k] = code_signed(coder, &model->number, (near * 16 + before * 2 + over + around * 8) / 16, own[k]);
            beside += clipped(own[k]);
        }
    }
    remember_row(model, slot, frames, count, row);
    return count;
}

#endif
