/* The context model of quantised tracks (FORMAT.md, "Coefficient streams"), compiled once for each direction.
 *
 * A row is three axes of a series of integers over temporal frequency. Most energy sits in few rows and low
 * frequencies, so a row first says how many frequencies it codes, and each integer is coded under the magnitude that
 * its decoded neighbours lead one to expect: the frequencies before it, the other axes, the row before, and the same
 * row of the units before. */
#ifndef ATH_COEFFICIENT_MODEL_H
#define ATH_COEFFICIENT_MODEL_H

#include "motion.h"
#include "number_model.h"

enum { COUNT_CLASSES = 6, COUNT_BINS = 10, SUMS_BEFORE = 2 };

typedef struct {
    number_model number;
    ath_context empty[COUNT_CLASSES][COUNT_CLASSES];
    ath_context count_size[COUNT_CLASSES][COUNT_BINS];
    ath_context count_mantissa[COUNT_BINS][4];
    uint32_t *history; /* ATH_SLOTS x frames: running mean magnitude of a row's frequency, in 1/16 */
    int32_t history_count[ATH_SLOTS];
    /* magnitudes of the last row and of this one, summed over the axes; zeros before the first and behind the last */
    uint32_t sums[2][SUMS_BEFORE + ATH_SEGMENT_FRAMES + 1];
    int32_t turn;
    int invalid; /* a row said that it codes more frequencies than there are */
} coefficient_model;

ATH_INLINE size_t history_size(int32_t frames) { return ATH_SLOTS * (size_t)frames * sizeof(uint32_t); }

/* `history`: history_size(frames) bytes. */
static void coefficient_model_init(coefficient_model *model, int32_t frames, uint32_t *history)
{
    memset(model, 0, sizeof *model);
    memset(history, 0, history_size(frames));
    model->history = history;
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

static int32_t used_frequencies(const int32_t *row, int32_t frames)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = frames; k > count; k--)
            if (row[axis * frames + k - 1] != 0) count = k;
    return count;
}

static void remember_row(coefficient_model *model, int32_t slot, int32_t frames, int32_t count, const uint32_t *sums)
{
    uint32_t *history = model->history + (size_t)slot * (size_t)frames;
    model->history_count[slot] = count;
    for (int32_t k = 0; k < frames; k++) history[k] = history[k] - (history[k] + 3) / 4 + sums[k] * 4 / 3;
}

/* One row: three axes of `frames` integers, of which the first `rank` may be coded. `above_count`: frequencies of the
 * unit's row before, which was the last to be coded, or -1 where this is its first. `slot` names the row in the
 * history. When decoding, `row` is zero on entry. Returns how many frequencies are coded. */
static int32_t code_row(ath_coder *coder, coefficient_model *model, int32_t frames, int32_t rank, int32_t slot,
                        int32_t above_count, int32_t *row)
{
    const uint32_t *history = model->history + (size_t)slot * (size_t)frames;
    const uint32_t *above = model->sums[model->turn] + SUMS_BEFORE;
    uint32_t *sums = model->sums[model->turn ^= 1] + SUMS_BEFORE,
             last[3][3] = {{0}}; /* the last magnitudes of each axis */
    int32_t count = code_count(coder, model, model->history_count[slot], ath_max(above_count, 0), rank,
                               ENCODING ? used_frequencies(row, frames) : 0);
    for (int32_t k = 0; k < count; k++) {
        uint32_t over = above_count < 0 ? 0 : 2 * above[k] + above[k - 1] + above[k + 1];
        uint32_t common = (2 * sums[k - 1] + sums[k - 2]) * 2 + over, beside = 0;
        for (int32_t axis = 0; axis < 3; axis++) {
            int32_t *own = row + axis * frames + k;
            uint32_t *near = last[axis];
            uint32_t around = axis == 0 ? history[k] : (beside * 16 / (uint32_t)axis + history[k]) / 2;
            uint32_t expected = ((2 * near[0] + near[1] + near[2]) * 16 + common + around * 8) / 16;
            *own = code_signed(coder, &model->number, expected, *own);
            near[2] = near[1];
            near[1] = near[0];
            near[0] = clipped(*own);
            beside += near[0];
        }
        sums[k] = beside;
    }
    memset(sums + count, 0, (size_t)(frames + 1 - count) * sizeof *sums);
    remember_row(model, slot, frames, count, sums);
    return count;
}

#endif
