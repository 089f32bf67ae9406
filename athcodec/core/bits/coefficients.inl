/* The context model of quantised tracks (FORMAT.md, "Coefficient streams"), compiled once for each direction.
 *
 * A row is three axes of a series of integers over temporal frequency. Most energy sits in few rows and low
 * frequencies, so a row first says how many frequencies it codes, and each integer is coded under the magnitude that
 * its decoded neighbours lead one to expect: the frequencies before it, the other axes, the row before, and the same
 * row of the units before; further by how high its frequency is, and by whether the axis is louder than it was in the
 * units before. */
#ifndef ATH_BITS_COEFFICIENTS_INL
#define ATH_BITS_COEFFICIENTS_INL

#include "bits/format.h"
#include "bits/numbers.inl"

enum { COUNT_CLASSES = 6, COUNT_BINS = 10, BANDS = 4, ROW_NUMBERS = 2 * BANDS, HISTORY_ROWS = 3 * ATH_SLOTS };

typedef struct {
    number_model numbers[ROW_NUMBERS];
    ath_context empty[COUNT_CLASSES][COUNT_CLASSES];
    ath_context count_size[COUNT_CLASSES][COUNT_BINS];
    ath_context count_mantissa[COUNT_BINS][4];
    uint32_t *history; /* HISTORY_ROWS x frames: running mean magnitude of a row's integers, in 1/16 */
    int32_t history_count[ATH_SLOTS], history_reach[ATH_SLOTS]; /* frequencies of the last row in a slot; of all rows */
    uint32_t sums[2][ATH_SEGMENT_FRAMES]; /* magnitudes of the last row and of this one, summed over the axes */
    int32_t turn;
    int invalid; /* a row said that it codes more frequencies than there are */
} coefficient_model;

ATH_INLINE size_t history_size(int32_t frames) { return HISTORY_ROWS * (size_t)frames * sizeof(uint32_t); }

static void coefficient_model_init(coefficient_model *model, int32_t frames, uint32_t *history)
{
    memset(model, 0, sizeof *model);
    memset(history, 0, history_size(frames));
    model->history = history;
    number_model_init(model->numbers);
    for (int32_t i = 1; i < ROW_NUMBERS; i++) model->numbers[i] = model->numbers[0];
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

/* Codes how many frequencies a row has. history: those of the same row of the unit before. */
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

/* The surroundings of an integer, which tell how large it is likely to be. */
typedef struct {
    uint32_t *history[3], *sums;
    const uint32_t *above;
    int32_t above_count;
    uint32_t near[3], run[3]; /* by axis: the last magnitude, and a running mean in 1/16 */
    uint32_t before, beside;  /* magnitudes summed over the axes, at the frequency before and at this one */
    uint32_t over, mean;      /* magnitudes of this frequency: in the row above, and the mean of earlier units */
    int32_t band;
} row_surroundings;

static row_surroundings start_row(coefficient_model *model, int32_t frames, int32_t slot, int32_t above_count)
{
    row_surroundings row;
    memset(&row, 0, sizeof row);
    for (int32_t axis = 0; axis < 3; axis++)
        row.history[axis] = model->history + ((size_t)slot * 3 + (size_t)axis) * (size_t)frames;
    row.above = model->sums[model->turn];
    row.sums = model->sums[model->turn ^= 1];
    row.above_count = above_count;
    return row;
}

ATH_INLINE void start_frequency(row_surroundings *row, int32_t k)
{
    row->beside = 0;
    row->over = k < row->above_count ? row->above[k] : 0;
    row->mean = (row->history[0][k] + row->history[1][k] + row->history[2][k]) / 3;
    row->band = ath_min(bit_length((uint32_t)k + 1) - 1, BANDS - 1);
}

/* Returns a magnitude in 1/16. `beside` sums one or two axes. */
ATH_INLINE uint32_t expected_magnitude(const row_surroundings *row, int32_t axis, int32_t k)
{
    uint32_t around = axis == 0 ? row->mean : ((row->beside * 16 >> (axis - 1)) + row->mean) / 2;
    return (16 * (row->near[axis] + row->run[axis]) + 12 * row->history[axis][k] + 2 * around + row->before + row->over)
           / 16;
}

ATH_INLINE int32_t row_number(const row_surroundings *row, int32_t axis, int32_t k)
{
    return 2 * row->band + (row->run[axis] > row->history[axis][k]);
}

ATH_INLINE void note_magnitude(row_surroundings *row, int32_t axis, int32_t k, uint32_t magnitude)
{
    row->history[axis][k] = averaged(row->history[axis][k], (int32_t)magnitude);
    row->run[axis] = averaged(row->run[axis], (int32_t)magnitude);
    row->near[axis] = magnitude;
    row->beside += magnitude;
}

ATH_INLINE void finish_frequency(row_surroundings *row, int32_t k) { row->before = row->sums[k] = row->beside; }

/* Averages the frequencies that the row does not code as zeros. */
static void finish_row(coefficient_model *model, const row_surroundings *row, int32_t slot, int32_t count)
{
    for (int32_t axis = 0; axis < 3; axis++) {
        uint32_t *history = row->history[axis];
        for (int32_t k = count; k < model->history_reach[slot]; k++) history[k] = averaged(history[k], 0);
    }
    model->history_count[slot] = count;
    model->history_reach[slot] = ath_max(model->history_reach[slot], count);
}

/* Codes three axes of `frames` integers, of which the first `rank` may be coded. above_count: frequencies of the unit's
 * row before, the last to be coded; -1: this is its first row. `slot` names the row in the history. When decoding,
 * `row` is zero on entry. Returns how many frequencies are coded. */
static int32_t code_row(ath_coder *coder, coefficient_model *model, int32_t frames, int32_t rank, int32_t slot,
                        int32_t above_count, int32_t *row)
{
    row_surroundings around = start_row(model, frames, slot, above_count);
    int32_t count = code_count(coder, model, model->history_count[slot], ath_max(above_count, 0), rank,
                               ENCODING ? used_frequencies(row, frames) : 0);
    ath_coder own_coder = *coder; /* a local copy stays in registers */
    for (int32_t k = 0; k < count; k++) {
        start_frequency(&around, k);
        for (int32_t axis = 0; axis < 3; axis++) {
            int32_t *own = row + axis * frames + k;
            number_model *number = model->numbers + row_number(&around, axis, k);
            *own = code_signed(&own_coder, number, expected_magnitude(&around, axis, k), *own);
            note_magnitude(&around, axis, k, clipped(*own));
        }
        finish_frequency(&around, k);
    }
    *coder = own_coder;
    finish_row(model, &around, slot, count);
    return count;
}

#endif
