/* The context model of refined tracks (FORMAT.md, "Refined rows"), compiled once for each direction.
 *
 * A refinement knows from the layer before what each integer is about: where that is not 0, the integer is spread over
 * the ratio of the steps around it; where it is 0, the integer is the smaller the quieter its surroundings. */
#ifndef ATH_BITS_REFINEMENTS_INL
#define ATH_BITS_REFINEMENTS_INL

#include "bits/coefficients.inl"

enum { REFINED_SIGNS = 3 };

typedef struct {
    coefficient_model rows; /* model of the differences; its numbers code integers that are 0 in the layer before */
    number_model known;     /* codes the other integers */
    ath_context sign[REFINED_SIGNS];
} refinement_model;

static void refinement_model_init(refinement_model *model, int32_t frames, uint32_t *history)
{
    coefficient_model_init(&model->rows, frames, history);
    number_model_init(&model->known);
    for (int32_t i = 0; i < REFINED_SIGNS; i++) context_init(&model->sign[i], 32768);
}

/* Returns an integer of the layer before in steps of this one, clamped so that it does not overflow. */
ATH_INLINE int32_t shifted(int32_t coarse, int32_t shift)
{
    int32_t most = 0x3fffffff >> shift;
    return (coarse > most ? most : coarse < -most ? -most : coarse) * (1 << shift);
}

/* Returns the steps of the layer before that a prediction stands for, as contexts see them. */
ATH_INLINE uint32_t coarse_steps(int32_t predicted, uint32_t ratio)
{
    uint32_t steps = (magnitude_of(predicted) + ratio / 2) / ratio;
    return steps < MAGNITUDE_CLIP ? steps : (uint32_t)MAGNITUDE_CLIP;
}

/* Predictions of a row, in steps of this layer. coarse: integers of this row in the layer before. below: those of the
 * row that follows it. Either may be null. */
typedef struct {
    const int32_t *row, *coarse, *below;
    int32_t frames, reach; /* reach: decoder, integers behind which both predictions and rows are 0 */
    uint32_t ratio[3];     /* step of the layer before over this one's, by axis */
} row_prediction;

/* Magnitudes of the layer before around a row, in its own steps, and their sums over the axes; then those of the row
 * that follows. Zeros stand behind the last frequency. */
typedef struct {
    uint32_t steps[3][ATH_SEGMENT_FRAMES + 2], all[ATH_SEGMENT_FRAMES + 2];
    uint32_t below[3][ATH_SEGMENT_FRAMES + 2], all_below[ATH_SEGMENT_FRAMES + 2];
} coarse_surroundings;

static void coarse_magnitudes(const row_prediction *p, const int32_t *row, int32_t count,
                              uint32_t steps[3][ATH_SEGMENT_FRAMES + 2], uint32_t *all)
{
    int32_t known = ath_min(count, p->frames);
    memset(all, 0, (size_t)count * sizeof *all);
    for (int32_t axis = 0; axis < 3; axis++) {
        const int32_t *from = row + axis * p->frames;
        for (int32_t k = 0; k < known; k++) {
            steps[axis][k] = p->coarse ? clipped(from[k]) : coarse_steps(from[k], p->ratio[axis]);
            all[k] += steps[axis][k];
        }
        for (int32_t k = known; k < count; k++) steps[axis][k] = 0;
    }
}

static void look_around(const row_prediction *p, int32_t count, coarse_surroundings *around)
{
    if (count == 0) return;
    coarse_magnitudes(p, p->coarse ? p->coarse : p->row, count + 2, around->steps, around->all);
    if (p->below) coarse_magnitudes(p, p->below, count + 1, around->below, around->all_below);
}

/* Returns how loud the layer before is around an integer, at places that this layer has not coded yet. */
ATH_INLINE uint32_t loudness(const row_prediction *p, const coarse_surroundings *around, int32_t axis, int32_t k)
{
    uint32_t loud = 2 * (2 * around->steps[axis][k + 1] + around->steps[axis][k + 2]) + around->all[k + 1];
    for (int32_t other = axis + 1; other < 3; other++) loud += around->steps[other][k];
    return p->below ? loud + 2 * around->all_below[k] + around->below[axis][k + 1] : loud;
}

static int32_t differing_frequencies(const int32_t *row, const int32_t *predicted, int32_t frames)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = frames; k > count; k--)
            if (row[axis * frames + k - 1] != predicted[axis * frames + k - 1]) count = k;
    return count;
}

ATH_INLINE int32_t code_refined_difference(ath_coder *coder, refinement_model *model, const row_prediction *prediction,
                                           const coarse_surroundings *around, const row_surroundings *differences,
                                           int32_t axis, int32_t k, int32_t difference)
{
    int32_t predicted = prediction->row[axis * prediction->frames + k];
    int known = around->steps[axis][k] > 0;
    number_model *number = known ? &model->known : model->rows.numbers + row_number(differences, axis, k);
    uint32_t ratio = prediction->ratio[axis];
    uint32_t expected = known && ratio > 1 ? 4 * ratio : expected_magnitude(differences, axis, k);
    if (!known) expected += 2 * loudness(prediction, around, axis, k);
    uint32_t magnitude = code_unsigned(coder, number, expected, magnitude_of(difference));
    if (magnitude == 0) return 0;
    int negative = predicted < 0;
    if (predicted == 0)
        negative = coder_raw_bit(coder, difference < 0);
    else
        negative ^= coder_bit(coder, &model->sign[(magnitude > 1) + (magnitude > 3)], (difference < 0) != negative);
    return negative ? -(int32_t)magnitude : (int32_t)magnitude;
}

/* Does what code_row does for the differences from the prediction, and adds them to it. */
static int32_t code_refined_row(ath_coder *coder, refinement_model *refinement, int32_t rank, int32_t slot,
                                int32_t above_count, const row_prediction *prediction, int32_t *row)
{
    coefficient_model *model = &refinement->rows;
    int32_t frames = prediction->frames;
    const int32_t *predicted = prediction->row;
    row_surroundings differences = start_row(model, frames, slot, above_count);
    int32_t count = code_count(coder, model, model->history_count[slot], ath_max(above_count, 0), rank,
                               ENCODING ? differing_frequencies(row, predicted, frames) : 0);
    coarse_surroundings around;
    look_around(prediction, count, &around);
    ath_coder own_coder = *coder; /* a local copy stays in registers */
    for (int32_t k = 0; k < count; k++) {
        start_frequency(&differences, k);
        for (int32_t axis = 0; axis < 3; axis++) {
            int32_t at = axis * frames + k;
            int32_t difference = code_refined_difference(&own_coder, refinement, prediction, &around, &differences,
                                                         axis, k, row[at] - predicted[at]);
            if (!ENCODING) row[at] = predicted[at] + difference;
            note_magnitude(&differences, axis, k, clipped(difference));
        }
        finish_frequency(&differences, k);
    }
    *coder = own_coder;
    for (int32_t axis = 0; axis < 3 && !ENCODING && count < prediction->reach; axis++)
        memcpy(row + axis * frames + count, predicted + axis * frames + count,
               (size_t)(prediction->reach - count) * sizeof *row);
    finish_row(model, &differences, slot, count);
    return count;
}

#endif
