/* A rest pose in the very numbers of the source (FORMAT.md, "Exact numbers"). Compiled once for each direction. */
#ifndef ATH_STREAMS_REST_EXACT_INL
#define ATH_STREAMS_REST_EXACT_INL

#include "bits/exact.inl"
#include "streams/rest_connected.inl"

/* Predicts vertex i of a stem by repeating the last step, or the step `lag` vertices ago. */
static void predict_rest(const ath_branch *branch, const double *rest, int32_t i, double predicted[3])
{
    const double *stem = rest + 3 * (size_t)branch->first;
    const double *attach = branch->attach >= 0 ? rest + 3 * (size_t)branch->attach : 0;
    const double *before = i > 0 ? stem + 3 * (i - 1) : attach, *from = 0, *to = 0;
    int32_t lag = ath_max(branch->lag, 1);
    if (i >= lag) {
        to = stem + 3 * (i - lag);
        from = i > lag ? stem + 3 * (i - lag - 1) : attach;
    }
    for (int32_t k = 0; k < 3; k++) {
        predicted[k] = before ? before[k] : 0.0;
        if (from) predicted[k] = predicted[k] + (to[k] - from[k]);
    }
}

/* Codes vertices in the order of their mesh about the mean of their parallelograms or, without any, of their
 * neighbours, or else as on a stem. */
static int code_connected_exact_rest(ath_coder *coder, exact_model *model, const ath_branch *branches,
                                     const ath_mesh *mesh, int is_float64, double *rest)
{
    int32_t length[3] = {0, 0, 0};
    const ath_branch *branch = branches;
    for (int32_t t = 0; t < mesh->vertex_count; t++) {
        int32_t v = mesh->order[t];
        double predicted[3];
        rest_ring ring;
        rest_ring_of(mesh, rest, v, &ring);
        const double *expected = ring.parallelograms > 0 ? ring.mean : ring.neighbours > 0 ? ring.middle : predicted;
        if (ring.base < 0) {
            while (v >= branch->first + branch->count) branch++;
            predict_rest(branch, rest, v - branch->first, predicted);
        }
        if (!code_exact_point(coder, model, is_float64, expected, length, rest + 3 * (size_t)v)) return 0;
    }
    return 1;
}

/* mesh: null unless the pose is connected. */
static int code_exact_rest(ath_coder *coder, exact_model *model, const ath_branch *branches, int32_t branch_count,
                           const ath_mesh *mesh, int is_float64, double *rest)
{
    int32_t length[3] = {0, 0, 0};
    exact_model_init(model);
    if (mesh) return code_connected_exact_rest(coder, model, branches, mesh, is_float64, rest);
    for (int32_t b = 0; b < branch_count; b++)
        for (int32_t i = 0; i < branches[b].count; i++) {
            double predicted[3], *out = rest + 3 * (size_t)(branches[b].first + i);
            predict_rest(branches + b, rest, i, predicted);
            if (!code_exact_point(coder, model, is_float64, predicted, length, out)) return 0;
        }
    return 1;
}

#endif
