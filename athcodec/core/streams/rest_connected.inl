/* Predicts a vertex of a connected rest pose from its neighbours in faces (FORMAT.md, "Connected rest poses"). Guesses
 * are weighted and learned as in rest_predictor.inl. */
#ifndef ATH_STREAMS_REST_CONNECTED_INL
#define ATH_STREAMS_REST_CONNECTED_INL

#include "model/mesh.h"
#include "streams/rest_predictor.inl"

enum { CONNECTED_GUESSES = 7, CONNECTED_CLASS = 4 };

/* At first, parallelograms are trusted or, if there are none, neighbours. */
static void rest_connected_init(rest_predictor *predictor)
{
    rest_predictor_init(predictor);
    for (int32_t f = 0; f < REST_FILTERS; f++) {
        predictor->filters[f].weight[3] = 0.0;
        predictor->filters[f].weight[f > 0 ? 0 : 2] = 1.0;
    }
}

/* The known surroundings of a vertex: neighbours, and parallelograms that it completes. */
typedef struct {
    int32_t neighbours, parallelograms;
    int32_t base; /* the neighbour that was placed last; -1: none */
    double middle[3], across[3], mean[3],
        last[3]; /* means of neighbours, opposite vertices, parallelograms; the last parallelogram */
} rest_ring;

static void rest_ring_of(const ath_mesh *mesh, const double *rest, int32_t v, rest_ring *ring)
{
    int32_t now = mesh->rank[v];
    memset(ring, 0, sizeof *ring);
    ring->base = -1;
    for (int32_t i = mesh->first[v]; i < mesh->first[v + 1]; i++) {
        int32_t corner = mesh->at[i], opposite = mesh->opposite[corner], known = 0;
        int32_t beside[2] = {ath_corner_before(mesh, corner), ath_next_corner(mesh, corner)};
        for (int32_t s = 0; s < 2; s++) {
            int32_t w = beside[s] >= 0 ? mesh->corners[beside[s]] : v;
            if (mesh->rank[w] >= now) continue;
            if (ring->base < 0 || mesh->rank[w] > mesh->rank[ring->base]) ring->base = w;
            for (int32_t k = 0; k < 3; k++) ring->middle[k] = ring->middle[k] + rest[3 * (size_t)w + (size_t)k];
            ring->neighbours++;
            known++;
        }
        if (known < 2 || opposite < 0 || mesh->rank[mesh->corners[opposite]] >= now) continue;
        const double *a = rest + 3 * (size_t)mesh->corners[beside[0]], *b = rest + 3 * (size_t)mesh->corners[beside[1]];
        const double *c = rest + 3 * (size_t)mesh->corners[opposite];
        for (int32_t k = 0; k < 3; k++) {
            double guess = a[k] + b[k] - c[k];
            ring->last[k] = guess;
            ring->mean[k] = ring->mean[k] + guess;
            ring->across[k] = ring->across[k] + c[k];
        }
        ring->parallelograms++;
    }
    for (int32_t k = 0; k < 3; k++) {
        if (ring->neighbours > 0) ring->middle[k] = ring->middle[k] / (double)ring->neighbours;
        if (ring->parallelograms == 0) continue;
        ring->mean[k] = ring->mean[k] / (double)ring->parallelograms;
        ring->across[k] = ring->across[k] / (double)ring->parallelograms;
    }
}

/* before: the rest pose of the layer before, or null. */
static void rest_look_beside(rest_predictor *predictor, const ath_mesh *mesh, const rest_ring *ring, const double *rest,
                             const double *before, int32_t v, double per_unit, rest_guess *at)
{
    const double *base = rest + 3 * (size_t)ring->base, *none = 0;
    int32_t complete = ring->parallelograms, from = mesh->from[ring->base], own = CONNECTED_TERMS;
    int32_t kind = CONNECTED_CLASS * ath_min(ring->neighbours - 1, 7) + ath_min(complete, CONNECTED_CLASS - 1);
    at->filter = predictor->filters + ath_min(complete, REST_FILTERS - 1);
    at->phase = predictor->phases + kind;
    at->increment = predictor->increments[kind];
    rest_term(at->terms[0], base, complete ? ring->mean : none, per_unit);
    rest_term(at->terms[1], base, complete ? ring->last : none, per_unit);
    rest_term(at->terms[2], base, ring->middle, per_unit);
    rest_term(at->terms[3], from >= 0 ? rest + 3 * (size_t)from : none, base, per_unit);
    rest_term(at->terms[4], base, complete ? ring->across : none, per_unit);
    memcpy(at->terms[5], at->increment, sizeof at->terms[5]);
    if (before) {
        rest_term(at->terms[own], base, before + 3 * (size_t)v, per_unit);
        rest_term(at->terms[own + 1], before + 3 * (size_t)ring->base, before + 3 * (size_t)v, per_unit);
    }
    at->term_count = own + (before ? 2 : 0);
    at->guess_count = CONNECTED_GUESSES + (before ? 2 : 0);
    memcpy(at->base, base, sizeof at->base);
    for (int32_t k = 0; k < 3; k++) {
        double sum = 0.0;
        for (int32_t j = 0; j < at->term_count; j++) sum = sum + at->filter->weight[j] * at->terms[j][k];
        at->guesses[0][k] = 0.5 * (at->terms[0][k] + at->terms[2][k]);
        for (int32_t g = 0; g < 4; g++) at->guesses[1 + g][k] = at->terms[g][k];
        at->guesses[5][k] = rest_is_far(sum) ? 0.0 : sum;
        at->guesses[6][k] = 0.0;
        for (int32_t g = 0; g < 2; g++) at->guesses[7 + g][k] = before ? at->terms[own + g][k] : 0.0;
    }
}

#endif
