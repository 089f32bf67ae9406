/* The rest pose of the source as a bent reference pose (FORMAT.md, "SOURCE_REST"). Compiled once for each direction. */
#ifndef ATH_STREAMS_SOURCE_REST_INL
#define ATH_STREAMS_SOURCE_REST_INL

#include "model/rotations.h"
#include "streams/rest.inl"

/* Poses are less the origin. turns: the rotation of each branch from the reference pose to the source's. */
typedef struct {
    const double *reference, *source;
    double *moved; /* see rest_layer */
    double *rest, *turns;
    double step;
} bent_pose;

/* Fills the rotation of a branch that hangs on vertex v of a stem, whose vertices up to `last` are placed. */
static void turn_at(const bent_pose *pose, const ath_branch *stem, int32_t v, int32_t last, const double turn[9],
                    double turned[9])
{
    int32_t before = v > stem->first ? v - 1 : stem->attach >= 0 ? stem->attach : v, after = ath_min(v + 1, last);
    const double *from = pose->reference + 3 * (size_t)before, *to = pose->reference + 3 * (size_t)after;
    double tangent[3], length2 = 0.0;
    if (turned != turn) memcpy(turned, turn, 9 * sizeof *turned);
    if (stem->lag > 0) return;
    for (int32_t k = 0; k < 3; k++) {
        tangent[k] = to[k] - from[k];
        length2 = length2 + tangent[k] * tangent[k];
    }
    if (!(length2 > 1e-200)) return;
    double inverse = 1.0 / ath_sqrt(length2);
    for (int32_t k = 0; k < 3; k++) tangent[k] = tangent[k] * inverse;
    ath_follow_tangents(1, tangent, pose->rest + 3 * (size_t)before, pose->rest + 3 * (size_t)after, turned, turned);
}

/* Codes vertex v about the vertex before it plus their reference edge, turned with the stem. before: -1: none. */
static void code_bent_vertex(ath_coder *coder, rest_model *model, const bent_pose *pose, int32_t v, int32_t before,
                             const double turn[9])
{
    double *out = pose->rest + 3 * (size_t)v, predicted[3], d[3];
    const double *here = pose->reference + 3 * (size_t)v;
    const double *from = pose->reference + 3 * (size_t)(before < 0 ? v : before);
    uint32_t *mean = model->bent_mean;
    for (int32_t k = 0; k < 3; k++) d[k] = before < 0 ? 0.0 : here[k] - from[k];
    for (int32_t k = 0; k < 3; k++) {
        double moved = turn[3 * k] * d[0] + turn[3 * k + 1] * d[1] + turn[3 * k + 2] * d[2];
        predicted[k] = before < 0 ? here[k] : pose->rest[3 * (size_t)before + (size_t)k] + moved;
    }
    for (int32_t k = 0; k < 3; k++) {
        int32_t given = ENCODING ? steps_in(pose->moved[3 * (size_t)v + (size_t)k] - predicted[k], pose->step, 0.5) : 0;
        int32_t steps = code_signed(coder, &model->bent, (mean[k] + mean[0] + mean[1] + mean[2]) / 4, given);
        out[k] = predicted[k] + (double)steps * pose->step;
        mean[k] = averaged(mean[k], steps);
    }
}

/* A stem that is no beam turns as its vertices did so far, the last ones above all. */
static void code_bent_sheet(ath_coder *coder, rest_model *model, const bent_pose *pose, const ath_branch *stem,
                            double turn[9])
{
    double H[9] = {0}, size2 = 0.0;
    for (int32_t i = 0; i < stem->count; i++) {
        int32_t v = stem->first + i, before = i > 0 ? v - 1 : stem->attach;
        double prior[9];
        code_bent_vertex(coder, model, pose, v, before, turn);
        if (before < 0) continue;
        size2 = 0.75 * size2;
        for (int32_t k = 0; k < 3; k++) {
            double d = pose->reference[3 * v + k] - pose->reference[3 * before + k];
            size2 = size2 + d * d;
            for (int32_t j = 0; j < 3; j++)
                H[3 * j + k] = 0.75 * H[3 * j + k] + (pose->rest[3 * v + j] - pose->rest[3 * before + j]) * d;
        }
        double prior_weight = 0.01 * size2 + 3.0 * (pose->step * pose->step);
        for (int32_t k = 0; k < 9; k++) prior[k] = H[k] + prior_weight * turn[k];
        ath_turn_to(prior, 1, turn);
    }
}

/* Codes `n` vertices of a beam from `first` on, by the modes of a beam that leaves `before` in any direction. */
static void code_bent_run(ath_coder *coder, rest_model *model, const bent_pose *pose, int32_t first, int32_t n,
                          int32_t before, const double R[9])
{
    static const double nothing[3] = {0.0, 0.0, 0.0};
    int32_t row[3 * REST_RUN] = {0};
    double local[3 * REST_RUN];
    const double *basis = rest_basis(model, n), *base = pose->rest + 3 * (size_t)before;
    const double *from = pose->reference + 3 * (size_t)before, *run = pose->reference + 3 * (size_t)first;
    for (int32_t i = 0; ENCODING && i < n; i++) {
        const double *x = pose->moved + 3 * (size_t)(first + i);
        for (int32_t k = 0; k < 3; k++)
            local[3 * i + k] = R[k] * (x[0] - base[0]) + R[3 + k] * (x[1] - base[1]) + R[6 + k] * (x[2] - base[2])
                               - (run[3 * i + k] - from[k]);
    }
    if (ENCODING) steps_of_run(n, basis, pose->step, 0.55, nothing, local, 0, row);
    code_row(coder, &model->modes, REST_RUN, n, 0, -1, row);
    for (int32_t i = 0; i < n; i++) {
        double x[3], *out = pose->rest + 3 * (size_t)(first + i);
        for (int32_t k = 0; k < 3; k++) {
            double sum = 0.0;
            for (int32_t m = 0; m < n; m++) sum = sum + basis[m * n + i] * (double)row[k * REST_RUN + m];
            x[k] = run[3 * i + k] - from[k] + sum * pose->step;
        }
        for (int32_t k = 0; k < 3; k++)
            out[k] = base[k] + (R[3 * k] * x[0] + R[3 * k + 1] * x[1] + R[3 * k + 2] * x[2]);
    }
}

static void code_bent_beam(ath_coder *coder, rest_model *model, const bent_pose *pose, const ath_branch *stem,
                           const double turn[9])
{
    int32_t from = stem->attach < 0, left = stem->count - from, runs = (left + REST_RUN - 1) / REST_RUN;
    if (from) code_bent_vertex(coder, model, pose, stem->first, -1, turn);
    for (int32_t r = 0; r < runs; r++) {
        int32_t start = stem->first + from + (int32_t)((int64_t)left * r / runs);
        int32_t end = stem->first + from + (int32_t)((int64_t)left * (r + 1) / runs);
        int32_t before = start > stem->first ? start - 1 : stem->attach;
        double turned[9];
        if (r == 0)
            memcpy(turned, turn, sizeof turned);
        else
            turn_at(pose, stem, before, before, turn, turned);
        code_bent_run(coder, model, pose, start, end - start, before, turned);
    }
}

static int code_source_rest(ath_coder *coder, rest_model *model, const bent_pose *pose, const ath_branch *branches,
                            int32_t branch_count)
{
    static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    rest_model_init(model, 0);
    for (int32_t b = 0; b < branch_count && !model->modes.invalid; b++) {
        const ath_branch *stem = branches + b, *parent = branches + ath_max(stem->parent, 0);
        double *turn = pose->turns + 9 * (size_t)b;
        bent_pose own = *pose;
        own.step = rest_step(stem, pose->step);
        if (ENCODING) take_along(branches, stem, pose->source, pose->moved, pose->rest);
        if (stem->parent < 0)
            memcpy(turn, identity, sizeof identity);
        else
            turn_at(pose, parent, stem->attach, parent->first + parent->count - 1, turn - 9 * (b - stem->parent), turn);
        if (stem->lag == 0)
            code_bent_beam(coder, model, &own, stem, turn);
        else
            code_bent_sheet(coder, model, &own, stem, turn);
    }
    return !model->modes.invalid;
}

#endif
