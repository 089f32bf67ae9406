/* From positions back to integers: what a layer of precision predicts from the layer before. */
#include "model/refine.h"
#include "model/basis.h"
#include "model/lanes.h"
#include "model/rotations.h"

enum { PROJECTED_NUMBERS = 8 * ATH_LANES };

/* A track is projected on PREDICTED waves at once. Each sum runs over the frames in order. */
enum { PREDICTED = 8 };

ATH_HOT static void project_waves(int32_t T, const double *waves, const double *track, double sums[PREDICTED])
{
    double sum[PREDICTED] = {0.0};
    for (int32_t t = 0; t < T; t++)
        for (int32_t i = 0; i < PREDICTED; i++) sum[i] = sum[i] + waves[i * T + t] * track[t];
    for (int32_t i = 0; i < PREDICTED; i++) sums[i] = sum[i];
}

static double wave_product(int32_t T, const double *wave, const double *track)
{
    double sum = 0.0;
    for (int32_t t = 0; t < T; t++) sum = sum + wave[t] * track[t];
    return sum;
}

static int32_t nearest_or_none(double units, double least)
{
    double magnitude = units < 0.0 ? -units : units;
    if (!(magnitude >= least)) return 0;
    int32_t whole = magnitude >= 536870911.0 ? 536870911 : (int32_t)(magnitude + 0.5);
    return units < 0.0 ? -whole : whole;
}

int ath_is_zero(const int32_t *integers, int32_t count)
{
    int32_t i = 0;
    for (; i + PREDICTED <= count; i += PREDICTED) {
        int32_t any = 0;
        for (int32_t j = 0; j < PREDICTED; j++) any |= integers[i + j];
        if (any) return 0;
    }
    for (; i < count; i++)
        if (integers[i] != 0) return 0;
    return 1;
}

/* Sets a row to zeros. Memory that holds them already is not written: the encoder keeps the rows of all pieces, and the
 * system no pages of those of zeros. */
static void set_to_zeros(int32_t *row, int32_t count)
{
    if (!ath_is_zero(row, count)) memset(row, 0, (size_t)count * sizeof *row);
}

/* Fills the nearest integers, by `steps` of the three axes, of a track over temporal frequency. Integers below half of
 * the axis's ratio (the step of the layer before over this one's) are 0, and so are those from `frequencies` on. */
static void predict_track(const ath_stream *stream, int32_t T, int32_t frequencies, const double steps[3],
                          const uint32_t ratios[3], const double *track, const int32_t *coarse, int32_t *predicted)
{
    int32_t count = ath_min(frequencies, stream->temporal_rank);
    set_to_zeros(predicted, 3 * T);
    for (int32_t axis = 0; axis < 3 && count > 0 && track; axis++) {
        const double *row = track + axis * T;
        double least = coarse ? 0.5 : 0.5 * (double)ratios[axis];
        int32_t k = 0, any = 0;
        for (int32_t t = 0; t < T && !any; t++) any = row[t] != 0.0;
        if (!any) continue;
        const int32_t *known = coarse ? coarse + axis * T : 0;
        for (; k < count; k += PREDICTED) {
            double sums[PREDICTED];
            int32_t stop = ath_min(k + PREDICTED, count), first = ath_min(k, stream->temporal_rank - PREDICTED);
            if (first < 0) break;
            if (known && ath_is_zero(known + k, stop - k)) continue;
            project_waves(T, stream->temporal + (size_t)first * (size_t)T, row, sums);
            for (int32_t i = k; i < stop; i++)
                predicted[axis * T + i] = nearest_or_none(sums[i - first] / steps[axis], least);
        }
        for (; k < count; k++)
            predicted[axis * T + k] =
                nearest_or_none(wave_product(T, stream->temporal + (size_t)k * (size_t)T, row) / steps[axis], least);
        for (k = 0; known && k < count; k++)
            if (known[k] == 0) predicted[axis * T + k] = 0;
    }
}

/* out = R^T (x - c) - d */
ATH_INLINE void into_rest_space(int32_t T, const ath_frames *at, const double *x, const double d[3],
                                double *ATH_RESTRICT out)
{
    const double *R = at->rotation, *c = at->point;
    for (int32_t t = 0; t < T; t++) {
        double dx = x[t] - c[t], dy = x[T + t] - c[T + t], dz = x[2 * T + t] - c[2 * T + t];
        out[t] = R[t] * dx + R[3 * T + t] * dy + R[6 * T + t] * dz - d[0];
        out[T + t] = R[T + t] * dx + R[4 * T + t] * dy + R[7 * T + t] * dz - d[1];
        out[2 * T + t] = R[2 * T + t] * dx + R[5 * T + t] * dy + R[8 * T + t] * dz - d[2];
    }
}

ATH_HOT void ath_into_rest_space(int32_t T, const ath_frames *at, const double *x, double *ATH_RESTRICT out)
{
    static const double nothing[3] = {0.0, 0.0, 0.0};
    into_rest_space(T, at, x, nothing, out);
}

ATH_HOT void ath_to_local(const ath_plan *plan, int32_t T, const ath_piece *piece, const ath_frames *at,
                          const double *placed, double *local)
{
    const double *a = ath_rest_attach(plan, piece);
    for (int32_t i = 0; i < piece->count; i++) {
        const double *x0 = ath_rest_of(plan, piece->first + i);
        double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
        into_rest_space(T, at, placed + (size_t)i * 3 * (size_t)T, d, local + (size_t)i * 3 * (size_t)T);
    }
}

/* row = sum over the vertices of weight in the mode * track */
ATH_HOT static void project_modes(const ath_plan *plan, int32_t T, const ath_piece *piece, int32_t first, int32_t stop,
                                  const double *local, double *ATH_RESTRICT rows)
{
    double weight[ATH_PIECE_VERTICES], tip = piece->tip_weight;
    const double *x[ATH_PIECE_VERTICES];
    int32_t last = piece->count - 1, count;
    for (int32_t from = 0; from < 3 * T; from += count) {
        count = ath_min(PROJECTED_NUMBERS, 3 * T - from);
        for (int32_t v = 0; v <= last; v++) x[v] = local + (size_t)v * 3 * (size_t)T + from;
        for (int32_t m = first; m < stop; m++) {
            const double *mode = plan->bases + piece->basis + (size_t)m * (size_t)piece->count;
            for (int32_t v = 0; v <= last; v++) weight[v] = v == last ? mode[v] * tip : mode[v];
            lanes_sum(count, piece->count, weight, x, 0.0, rows + (size_t)m * 3 * (size_t)T + from);
        }
    }
}

void ath_project(const ath_plan *plan, int32_t T, const ath_piece *piece, int32_t count, const double *local,
                 double *ATH_RESTRICT rows)
{
    project_modes(plan, T, piece, 0, count, local, rows);
}

static void predict_evenly(const ath_stream *stream, const ath_motion *motion, int32_t frequencies, double step,
                           const double *track, const int32_t *coarse, int32_t *predicted)
{
    uint32_t ratio = (uint32_t)motion->ratio, ratios[3] = {ratio, ratio, ratio};
    double steps[3] = {step, step, step};
    predict_track(stream, motion->frames, frequencies, steps, ratios, track, coarse, predicted);
}

void ath_predict_shift(const ath_motion *motion, const ath_piece *piece, const ath_piece_before *before,
                       const ath_scratch *scratch, ath_piece_rows *rows)
{
    const ath_stream *stream = ath_base_stream(motion, piece);
    const double *track = before->shift;
    if (before->frames && before->frequencies > 0) {
        for (int32_t i = 0; i < 3 * motion->frames; i++) scratch->shift[i] = before->frames[i] - scratch->at.point[i];
        track = scratch->shift;
    }
    predict_evenly(stream, motion, before->frequencies, ath_shift_step(piece, stream), track, rows->coarse_shift,
                   rows->predicted_shift);
}

void ath_predict_rotation(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                          const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows)
{
    const ath_stream *stream = ath_base_stream(motion, piece);
    ath_turning turning = ath_turning_of(plan, piece, stream);
    int32_t T = motion->frames;
    uint32_t ratios[3];
    const double *track = before->rotation;
    ath_turn_ratios(motion, &turning, rows->coarse_turn_steps, ratios);
    if (before->frames && before->frequencies > 0) {
        ath_rotations_between(T, scratch->at.rotation, before->frames + 3 * (size_t)T, scratch->rotation);
        ath_into_axes(T, &turning, scratch->rotation);
        track = scratch->rotation;
    }
    predict_track(stream, T, before->frequencies, turning.steps, ratios, track, rows->coarse_rotation,
                  rows->predicted_rotation);
}

void ath_predict_tracks(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                        const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows)
{
    if (ath_has_shift(piece)) ath_predict_shift(motion, piece, before, scratch, rows);
    if (ath_has_rotation(plan, piece, ath_base_stream(motion, piece)))
        ath_predict_rotation(plan, motion, piece, before, scratch, rows);
}

/* Fills the tracks of three shapes from those of the modes. */
ATH_HOT static void shape_tracks(int32_t T, const ath_piece *piece, const ath_piece_rows *rows, int32_t r,
                                 const double *modes, double *track)
{
    int32_t count = 3 * ath_shape_modes(piece);
    const double *x[ATH_SHAPE_NUMBERS];
    for (int32_t j = 0; j < count; j++) x[j] = modes + (size_t)j * (size_t)T;
    for (int32_t s = 3 * r; s < 3 * r + 3; s++, track += T)
        lanes_sum(T, s < rows->shape_count ? count : 0, rows->shapes + s * ATH_SHAPE_NUMBERS, x, 0.0, track);
}

int32_t ath_predicted_modes(const ath_piece *piece, const ath_piece_before *before, const ath_piece_rows *rows)
{
    int32_t modes = before->frequencies > 0 ? ath_min(before->modes, ath_rank(piece)) : 0;
    return modes > 0 && rows->shape_count > 0 ? ath_max(modes, ath_shape_modes(piece)) : modes;
}

void ath_predict_modes(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows)
{
    int32_t T = motion->frames, modes = ath_predicted_modes(piece, before, rows);
    if (modes > 0) {
        ath_to_local(plan, T, piece, &scratch->at, before->placed, scratch->placed);
        if (rows->shape_count > 0) ath_project(plan, T, piece, modes, scratch->placed, scratch->rows);
    }
    for (int32_t r = 0; r < modes; r++) {
        const ath_stream *stream = ath_mode_stream(motion, piece, r);
        const int32_t *coarse = rows->coarse_modes ? rows->coarse_modes + (size_t)r * 3 * (size_t)T : 0;
        double *track = scratch->rows + (size_t)r * 3 * (size_t)T;
        int has_prediction = !coarse || !ath_is_zero(coarse, 3 * T);
        if (has_prediction && rows->shape_count == 0)
            project_modes(plan, T, piece, r, r + 1, scratch->placed, scratch->rows);
        if (has_prediction && ath_is_shape_row(piece, rows, r)) {
            shape_tracks(T, piece, rows, r, scratch->rows, scratch->track);
            track = scratch->track;
        }
        predict_evenly(stream, motion, has_prediction ? before->frequencies : 0, ath_row_step(motion, piece, rows, r),
                       track, coarse, ath_row(rows->predicted_modes, r, T));
    }
    for (int32_t r = modes; r < ath_rank(piece); r++) set_to_zeros(ath_row(rows->predicted_modes, r, T), 3 * T);
}

int32_t ath_row_extent(const int32_t *row, int32_t T, int32_t most)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3; axis++) {
        const int32_t *own = row + axis * T;
        int32_t k = most;
        while (k - count >= PREDICTED && ath_is_zero(own + k - PREDICTED, PREDICTED)) k -= PREDICTED;
        while (k > count && own[k - 1] == 0) k--;
        count = k;
    }
    return count;
}
