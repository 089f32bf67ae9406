/* Predictions without the vertices of the layer before.
 *
 * Vertices are sums of terms: their rest positions, and what tracks over time add. So is what their projection makes of
 * them: each term, turned, times weights that do not change. Summing in this order takes far less time, but rounds
 * otherwise. So an integer is taken only if it is further from the middle between two than both sums can be apart. */
#include "model/foresee.h"

#include "model/lanes.h"

enum { MOST_TERMS = 16 };

/* At most so far are two sums apart, over the product of `reach`, the frames and 1 / step: 512 roundings of 2^-53, and
 * the absolute weights of a row add up to at most 128. */
#define APART (512.0 * 128.0 / 9007199254740992.0)

typedef double vertex_row[ATH_PIECE_VERTICES]; /* zeros behind the last vertex, as far as sums read */

typedef struct {
    int32_t count;
    vertex_row weight[1 + MOST_TERMS][3]; /* how a term moves each vertex along each axis; the first is at rest */
    const double *track[1 + MOST_TERMS];
    double reach; /* no number on the way is larger */
} placing_sums;

/* A row's track as a sum of the same terms, turned. */
typedef struct {
    double shift[3], turn[1 + MOST_TERMS][9], rest;
} row_sums;

/* Returns a sum of products in no order that FORMAT.md states. */
ATH_INLINE double quick_sum(int32_t count, const double *a, const double *b)
{
    double lane[2 * ATH_LANES], rest = 0.0;
    ath_lanes sum, other;
    int32_t i = 0;
    lanes_set(&sum, 0.0);
    other = sum;
    for (; i + 2 * ATH_LANES <= count; i += 2 * ATH_LANES) {
        lanes_add_product(&sum, a + i, b + i);
        lanes_add_product(&other, a + i + ATH_LANES, b + i + ATH_LANES);
    }
    for (; i < count; i++) rest = rest + a[i] * b[i];
    lanes_store(lane, &sum);
    lanes_store(lane + ATH_LANES, &other);
    for (int32_t j = 0; j < ATH_LANES; j++) lane[j] = lane[j] + lane[ATH_LANES + j];
    return rest + ((lane[0] + lane[2]) + (lane[1] + lane[3]));
}

/* Returns a number that none of these is larger than. */
ATH_FUSED static double bound_of(const double *numbers, int32_t count)
{
    return ath_sqrt(quick_sum(count, numbers, numbers));
}

static void weigh_rest(const ath_plan *plan, const ath_piece *piece, vertex_row *weight)
{
    const double *a = ath_rest_attach(plan, piece);
    memset(weight, 0, 3 * sizeof *weight);
    for (int32_t v = 0; v < piece->count; v++)
        for (int32_t k = 0; k < 3; k++) weight[k][v] = ath_rest_of(plan, piece->first + v)[k] - a[k];
}

/* Returns the numbers of a vertex_row that sums read. */
ATH_INLINE size_t summed_vertices(int32_t vertices)
{
    return (size_t)(vertices + 2 * ATH_LANES - 1) / (2 * ATH_LANES) * (2 * ATH_LANES);
}

/* Fills the weights of shape s or, from the number of shapes on, of a mode along one axis. The piece has at least
 * ATH_LANES vertices. */
ATH_FUSED static void weigh_row(const ath_plan *plan, const ath_piece *piece, const ath_piece_rows *rows, int32_t s,
                                vertex_row *ATH_RESTRICT weight)
{
    const double *basis = plan->bases + piece->basis;
    int32_t n = piece->count;
    for (int32_t k = 0; k < 3; k++) memset(weight[k], 0, summed_vertices(n) * sizeof *weight[k]);
    if (!ath_is_shape_row(piece, rows, s / 3)) {
        memcpy(weight[s % 3], basis + s / 3 * n, (size_t)n * sizeof *basis);
        return;
    }
    for (int32_t from = 0; from < n; from += ATH_LANES) {
        int32_t v = ath_min(from, n - ATH_LANES);
        lanes_of_shape(ath_shape_modes(piece), rows->shapes + s * ATH_SHAPE_NUMBERS, basis + v, n, weight[0] + v,
                       ATH_PIECE_VERTICES);
    }
}

/* Returns 0 if there are too many terms. */
ATH_FUSED static int find_placing_sums(const ath_placing *placing, const ath_piece *piece, int32_t T,
                                       placing_sums *sums)
{
    weigh_rest(placing->plan, piece, sums->weight[0]);
    sums->count = 1;
    sums->reach =
        4.0 * bound_of(sums->weight[0][0], 3 * ATH_PIECE_VERTICES) + bound_of(placing->scratch->at.point, 3 * T);
    for (int32_t s = 0; s < 3 * ath_rank(piece); s++) {
        const double *track = placing->scratch->rows + (size_t)s * (size_t)T;
        if (!placing->used[s / 3] || (ath_is_shape_row(piece, placing->rows, s / 3) && s >= placing->rows->shape_count))
            continue;
        if (sums->count > MOST_TERMS) return 0;
        vertex_row *weight = sums->weight[sums->count];
        weigh_row(placing->plan, piece, placing->rows, s, weight);
        sums->reach = sums->reach + 4.0 * bound_of(track, T); /* bases and shapes are orthonormal */
        sums->track[sums->count++] = track;
    }
    return 1;
}

/* Fills the way to the attach point of the layer before, and the turn to its attach frame: 3 and 9 rows. */
ATH_FUSED static void find_moves(int32_t T, const ath_frames *at, const ath_frames *before, double *ATH_RESTRICT moves)
{
    const double *R = at->rotation, *S = before->rotation;
    ath_into_rest_space(T, at, before->point, moves);
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; k < 3; k++)
            for (int32_t t = 0; t < T; t++)
                moves[(3 + 3 * i + k) * T + t] = R[i * T + t] * S[k * T + t] + R[(3 + i) * T + t] * S[(3 + k) * T + t]
                                                 + R[(6 + i) * T + t] * S[(6 + k) * T + t];
}

ATH_FUSED static void find_row_sums(int32_t vertices, vertex_row *rest, vertex_row *weight, const placing_sums *terms,
                                    row_sums *row)
{
    int32_t count = (int32_t)summed_vertices(vertices);
    row->rest = 0.0;
    for (int32_t i = 0; i < 3; i++) {
        row->shift[i] = 0.0;
        for (int32_t v = 0; v < vertices; v++) row->shift[i] = row->shift[i] + weight[i][v];
        row->rest = row->rest + quick_sum(count, weight[i], rest[i]);
        for (int32_t j = 0; j < terms->count; j++)
            for (int32_t k = 0; k < 3; k++) row->turn[j][3 * i + k] = quick_sum(count, weight[i], terms->weight[j][k]);
    }
}

/* Fills the track of a row. T is at least ATH_LANES. */
ATH_FUSED static void foresee_track(int32_t T, const placing_sums *terms, const row_sums *row, const double *moves,
                                    double *track)
{
    for (int32_t from = 0; from < T; from += ATH_LANES) {
        int32_t t = ath_min(from, T - ATH_LANES);
        ath_lanes turned[9], sum;
        memset(turned, 0, sizeof turned); /* Compilers do not see that all of them are set. */
        for (int32_t k = 0; k < 9; k++) lanes_set(&turned[k], row->turn[0][k]);
        for (int32_t j = 1; j < terms->count; j++)
            for (int32_t k = 0; k < 9; k++) lanes_add_scaled(&turned[k], row->turn[j][k], terms->track[j] + t);
        lanes_set(&sum, -row->rest);
        for (int32_t k = 0; k < 3; k++) lanes_add_scaled(&sum, row->shift[k], moves + k * T + t);
        for (int32_t k = 0; k < 9; k++)
            lanes_add_product(&sum, (const double *)(const void *)&turned[k], moves + (3 + k) * T + t);
        lanes_store(track + t, &sum);
    }
}

/* Fills the integers of a track as predict_track does. Returns 0 if one is in doubt, or the track is not finite. */
ATH_FUSED static int foresee_integers(int32_t T, int32_t count, const double *waves, const double *track, double step,
                                      double least, double apart, const int32_t *coarse, int32_t *predicted)
{
    for (int32_t k = 0; k < count; k++) {
        if (coarse && coarse[k] == 0) continue;
        double units = quick_sum(T, waves + (size_t)k * (size_t)T, track) / step, size = units < 0.0 ? -units : units;
        if (size < least - apart) continue;
        if (!(size >= least + apart && size < 536870000.0)) return 0;
        int32_t whole = (int32_t)(size + 0.5);
        double above = size + 0.5 - (double)whole;
        if (!(above > apart && above < 1.0 - apart)) return 0;
        predicted[k] = units < 0.0 ? -whole : whole;
    }
    return 1;
}

ATH_FUSED int ath_foresee_modes(const ath_plan *plan, const ath_motion *motion, int32_t p,
                                const ath_piece_before *before, const ath_placing *placing, const ath_scratch *scratch,
                                ath_piece_rows *rows)
{
    const ath_piece *piece = plan->pieces + p;
    int32_t T = motion->frames, modes = ath_predicted_modes(piece, before, rows);
    placing_sums terms;
    row_sums sums;
    vertex_row rest[3], weight[3];
    double *moves = scratch->placed;
    if (modes > 0
        && (ath_min(T, piece->count) < ATH_LANES || !find_placing_sums(placing, placing->plan->pieces + p, T, &terms)))
        return 0;
    double reach = 0.0;
    if (modes > 0) {
        weigh_rest(plan, piece, rest);
        find_moves(T, &scratch->at, &placing->scratch->at, moves);
        reach = terms.reach + 4.0 * bound_of(rest[0], 3 * ATH_PIECE_VERTICES) + bound_of(scratch->at.point, 3 * T);
    }
    for (int32_t s = 0; s < 3 * modes; s++) {
        int32_t r = s / 3, *predicted = ath_row(rows->predicted_modes, r, T) + s % 3 * T;
        const ath_stream *stream = ath_mode_stream(motion, piece, r);
        const int32_t *coarse = rows->coarse_modes ? rows->coarse_modes + (size_t)s * (size_t)T : 0;
        double step = ath_row_step(motion, piece, rows, r);
        if (ath_is_shape_row(piece, rows, r) && s >= rows->shape_count) continue;
        if (coarse && ath_is_zero(coarse, T)) continue;
        weigh_row(plan, piece, rows, s, weight);
        for (int32_t k = 0; k < 3; k++) weight[k][piece->count - 1] *= piece->tip_weight;
        find_row_sums(piece->count, rest, weight, &terms, &sums);
        foresee_track(T, &terms, &sums, moves, scratch->track);
        if (!foresee_integers(T, ath_min(before->frequencies, stream->temporal_rank), stream->temporal, scratch->track,
                              step, coarse ? 0.5 : 0.5 * (double)motion->ratio, APART * reach * (double)T / step,
                              coarse, predicted))
            return 0;
    }
    return 1;
}
