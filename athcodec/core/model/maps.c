/* The affine maps that move the subtrees of nodes. */
#include "model/maps.h"

ath_stream ath_node_stream(const ath_motion *motion, double step)
{
    ath_stream stream = {step, 0.0, motion->waves, motion->frames, -1, 0.0};
    return stream;
}

/* E += columns x functional: axis i of track r adds track[i] * functional[k] to E[i][k]. E: 9 rows. */
ATH_HOT static void add_outer(int32_t T, const double *track, const double functional[3], double *ATH_RESTRICT E)
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; k < 3; k++) {
            double *out = E + (3 * i + k) * T;
            for (int32_t t = 0; t < T; t++) out[t] = out[t] + track[i * T + t] * functional[k];
        }
}

void ath_affine_part(const ath_plan *plan, const ath_node *node, const double *mode, double g[3])
{
    const double *a = ath_rest_attach(plan, plan->pieces + node->piece);
    double moment[3] = {0.0, 0.0, 0.0};
    for (int32_t i = 0; i < node->count; i++) {
        const double *x0 = ath_rest_of(plan, node->first + i);
        for (int32_t k = 0; k < 3; k++) moment[k] = moment[k] + mode[i] * (x0[k] - a[k]);
    }
    for (int32_t k = 0; k < 3; k++) g[k] = 0.0;
    for (int32_t r = 0; r < node->rank; r++) {
        const double *w = node->whitening + 3 * r;
        double dot = (w[0] * moment[0] + w[1] * moment[1] + w[2] * moment[2]) / (double)node->count;
        for (int32_t k = 0; k < 3; k++) g[k] = g[k] + dot * w[k];
    }
}

static void coded_map(const ath_motion *motion, const ath_node *node, const ath_node_rows *rows,
                      const ath_scratch *scratch, int shifted, double *E)
{
    int32_t T = motion->frames;
    double step = ath_node_step(*rows->step);
    ath_stream stream = ath_node_stream(motion, step);
    if (shifted) {
        ath_inverse_track(&stream, T, T, step, ath_row(rows->rows, 3, T), scratch->track);
        ath_move_point(T, scratch->track, scratch->at.point);
    }
    for (int32_t r = 0; r < node->rank; r++) {
        ath_inverse_track(&stream, T, T, step, ath_row(rows->rows, r, T), scratch->track);
        add_outer(T, scratch->track, node->whitening + 3 * r, E);
    }
}

static void map_of_modes(const ath_plan *plan, const ath_motion *motion, const ath_node *node,
                         const ath_piece_rows *rows, const ath_scratch *scratch, double *E)
{
    const ath_piece *piece = plan->pieces + node->piece;
    for (int32_t m = 0; m < ath_min(piece->low_modes, ath_rank(piece)); m++) {
        double g[3];
        ath_affine_part(plan, node, plan->bases + piece->basis + (size_t)m * (size_t)piece->count, g);
        ath_inverse_row(motion, piece, rows, m, scratch->track);
        add_outer(motion->frames, scratch->track, g, E);
    }
}

/* The affine part of a shape sums those of its modes. */
static void map_of_shape(int32_t modes, double functionals[][3], const double *numbers, double G[9])
{
    for (int32_t k = 0; k < 9; k++) G[k] = 0.0;
    for (int32_t m = 0; m < modes; m++)
        for (int32_t i = 0; i < 3; i++)
            for (int32_t k = 0; k < 3; k++) G[3 * i + k] = G[3 * i + k] + numbers[3 * m + i] * functionals[m][k];
}

static void map_of_shapes(const ath_plan *plan, const ath_motion *motion, const ath_node *node,
                          const ath_piece_rows *rows, const ath_scratch *scratch, double *E)
{
    const ath_piece *piece = plan->pieces + node->piece;
    int32_t T = motion->frames, count = ath_min(rows->shape_count, ath_base_shapes(piece));
    double functionals[ATH_SHAPE_MODES][3];
    for (int32_t m = 0; m < ath_shape_modes(piece); m++)
        ath_affine_part(plan, node, plan->bases + piece->basis + (size_t)m * (size_t)piece->count, functionals[m]);
    for (int32_t s = 0; s < count; s++) {
        double G[9];
        const double *track = scratch->track + s % 3 * T;
        if (s % 3 == 0) ath_inverse_row(motion, piece, rows, s / 3, scratch->track);
        map_of_shape(ath_shape_modes(piece), functionals, rows->shapes + s * ATH_SHAPE_NUMBERS, G);
        for (int32_t k = 0; k < 9; k++)
            for (int32_t t = 0; t < T; t++) E[k * T + t] = E[k * T + t] + track[t] * G[k];
    }
}

/* R := R (I + E) */
ATH_HOT static void compose(int32_t T, const double *E, double *ATH_RESTRICT R)
{
    for (int32_t i = 0; i < 3; i++) {
        double *r = R + 3 * i * T;
        for (int32_t t = 0; t < T; t++) {
            double r0 = r[t], r1 = r[T + t], r2 = r[2 * T + t];
            r[t] = r0 + (r0 * E[t] + r1 * E[3 * T + t] + r2 * E[6 * T + t]);
            r[T + t] = r1 + (r0 * E[T + t] + r1 * E[4 * T + t] + r2 * E[7 * T + t]);
            r[2 * T + t] = r2 + (r0 * E[2 * T + t] + r1 * E[5 * T + t] + r2 * E[8 * T + t]);
        }
    }
}

void ath_node_map(const ath_plan *plan, const ath_motion *motion, int32_t n, const ath_piece_rows *piece_rows,
                  const ath_node_rows *rows, const ath_scratch *scratch)
{
    const ath_node *node = plan->nodes + n;
    double *E = scratch->rows;
    for (int32_t i = 0; i < 9 * motion->frames; i++) E[i] = 0.0;
    if (node->coded) {
        ath_attach(plan, motion, plan->pieces + node->piece, scratch->at);
        coded_map(motion, node, rows, scratch, ath_has_shift(plan->pieces + node->piece), E);
    } else {
        ath_turned_attach(plan, motion, node->piece, piece_rows, scratch);
        if (piece_rows->shape_count > 0)
            map_of_shapes(plan, motion, node, piece_rows, scratch, E);
        else
            map_of_modes(plan, motion, node, piece_rows, scratch, E);
    }
    compose(motion->frames, E, scratch->at.rotation);
}
