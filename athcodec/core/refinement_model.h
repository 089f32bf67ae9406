/* The context model of refined tracks (FORMAT.md, "Refined rows"), compiled once for each direction.
 *
 * A refinement knows from the layer before what each integer is about: where that is not 0, the integer is spread over the
 * ratio of the steps around it; where it is 0, the integer is small, the more so the quieter its surroundings are. */
#ifndef ATH_REFINEMENT_MODEL_H
#define ATH_REFINEMENT_MODEL_H

#include "coefficient_model.h"

enum { REFINED_SIGNS = 3 };

typedef struct {
    coefficient_model rows;  /* counts, and what is remembered of rows: of the differences */
    number_model numbers[2]; /* of integers that are 0 in the layer before, of others */
    ath_context sign[REFINED_SIGNS];
} refinement_model;

/* `history`: history_size(frames) bytes. */
static void refinement_model_init(refinement_model *model, int32_t frames, uint32_t *history)
{
    coefficient_model_init(&model->rows, frames, history);
    for (int32_t i = 0; i < 2; i++) number_model_init(&model->numbers[i]);
    for (int32_t i = 0; i < REFINED_SIGNS; i++) context_init(&model->sign[i], 32768);
}

/* An integer of the layer before in steps of this one; what is too large for that is kept from overflowing. */
ATH_INLINE int32_t shifted(int32_t coarse, int32_t shift)
{
    int32_t most = 0x3fffffff >> shift;
    return (coarse > most ? most : coarse < -most ? -most : coarse) * (1 << shift);
}

/* Steps of the layer before that a prediction stands for, as contexts see them. */
ATH_INLINE uint32_t coarse_steps(int32_t predicted, uint32_t ratio)
{
    uint32_t steps = (magnitude_of(predicted) + ratio / 2) / ratio;
    return steps < MAGNITUDE_CLIP ? steps : (uint32_t)MAGNITUDE_CLIP;
}

/* Predictions of a row and of the one that follows it, null: none, in steps of the layer before. */
typedef struct {
    const int32_t *row, *coarse, *below;
    int32_t frames;
    uint32_t ratio[3]; /* of the axes */
} row_prediction;

ATH_INLINE uint32_t coarse_at(const row_prediction *p, const int32_t *row, int32_t axis, int32_t k)
{
    if (k >= p->frames) return 0;
    return p->coarse ? clipped(row[axis * p->frames + k]) : coarse_steps(row[axis * p->frames + k], p->ratio[axis]);
}

/* How loud the layer before is around an integer, where that is not known otherwise yet. */
static uint32_t loudness(const row_prediction *p, int32_t axis, int32_t k)
{
    const int32_t *row = p->coarse ? p->coarse : p->row;
    uint32_t loud = 2 * (2 * coarse_at(p, row, axis, k + 1) + coarse_at(p, row, axis, k + 2)), below = 0;
    for (int32_t other = 0; other < 3; other++) {
        loud += coarse_at(p, row, other, k + 1);
        if (other > axis) loud += coarse_at(p, row, other, k);
        if (p->below) below += coarse_at(p, p->below, other, k);
    }
    return p->below ? loud + 2 * below + coarse_at(p, p->below, axis, k + 1) : loud;
}

static int32_t differing_frequencies(const int32_t *row, const int32_t *predicted, int32_t frames)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = frames; k > count; k--)
            if (row[axis * frames + k - 1] != predicted[axis * frames + k - 1]) count = k;
    return count;
}

/* expected: of the differences around this one, in 1/16. */
static int32_t code_refined_difference(ath_coder *coder, refinement_model *model, const row_prediction *prediction,
                                       int32_t axis, int32_t k, uint32_t expected, int32_t difference)
{
    int32_t predicted = prediction->row[axis * prediction->frames + k];
    int known = coarse_at(prediction, prediction->coarse ? prediction->coarse : prediction->row, axis, k) > 0;
    expected = !known                        ? expected + 2 * loudness(prediction, axis, k)
               : prediction->ratio[axis] > 1 ? 4 * prediction->ratio[axis]
                                             : expected;
    uint32_t magnitude = code_unsigned(coder, &model->numbers[known], expected, magnitude_of(difference));
    if (magnitude == 0) return 0;
    int negative = predicted < 0;
    if (predicted == 0)
        negative = coder_raw_bit(coder, difference < 0);
    else
        negative ^= coder_bit(coder,
                              &model->sign[magnitude == 1  ? 0
                                           : magnitude < 4 ? 1
                                                           : 2],
                              (difference < 0) != negative);
    return negative ? -(int32_t)magnitude : (int32_t)magnitude;
}

/* As code_row; the row becomes its prediction and the differences that are coded. */
static int32_t code_refined_row(ath_coder *coder, refinement_model *refinement, int32_t rank, int32_t slot,
                                int32_t above_count, const row_prediction *prediction, int32_t *row)
{
    coefficient_model *model = &refinement->rows;
    int32_t frames = prediction->frames;
    const int32_t *predicted = prediction->row;
    const uint32_t *history = model->history + (size_t)slot * (size_t)frames;
    const uint32_t *above = model->sums[model->turn] + SUMS_BEFORE;
    uint32_t *sums = model->sums[model->turn ^= 1] + SUMS_BEFORE, last[3][3] = {{0}};
    int32_t count = code_count(coder, model, model->history_count[slot], ath_max(above_count, 0), rank,
                               ENCODING ? differing_frequencies(row, predicted, frames) : 0);
    for (int32_t k = 0; k < count; k++) {
        uint32_t over = above_count < 0 ? 0 : 2 * above[k] + above[k - 1] + above[k + 1];
        uint32_t common = (2 * sums[k - 1] + sums[k - 2]) * 2 + over, beside = 0;
        for (int32_t axis = 0; axis < 3; axis++) {
            int32_t at = axis * frames + k;
            uint32_t *near = last[axis];
            uint32_t around = axis == 0 ? history[k] : (beside * 16 / (uint32_t)axis + history[k]) / 2;
            uint32_t expected = ((2 * near[0] + near[1] + near[2]) * 16 + common + around * 8) / 16;
            int32_t difference =
                code_refined_difference(coder, refinement, prediction, axis, k, expected, row[at] - predicted[at]);
            if (!ENCODING) row[at] = predicted[at] + difference;
            near[2] = near[1];
            near[1] = near[0];
            near[0] = clipped(difference);
            beside += near[0];
        }
        sums[k] = beside;
    }
    for (int32_t axis = 0; axis < 3 && !ENCODING; axis++)
        memcpy(row + axis * frames + count, predicted + axis * frames + count, (size_t)(frames - count) * sizeof *row);
    memset(sums + count, 0, (size_t)(frames + 1 - count) * sizeof *sums);
    remember_row(model, slot, frames, count, sums);
    return count;
}

#endif
