/* Predicts vertices that are coded one by one, and learns from each (FORMAT.md, "Single vertices"). Offsets are in
 * units of the lattice, from the vertex before. */
#ifndef ATH_STREAMS_REST_PREDICTOR_INL
#define ATH_STREAMS_REST_PREDICTOR_INL

#include "bits/lattice.inl"

#define REST_FORGET (1.0 / 2048.0)

enum {
    REST_TERMS = 10,
    REST_OWN_TERMS = 8,
    CONNECTED_TERMS = 6,
    REST_GUESSES = 9,
    REST_OWN_GUESSES = 7,
    REST_PHASES = 256,
    REST_FILTERS = 6
};

/* Weights of the terms for all axes, found by recursive least squares. */
typedef struct {
    double weight[REST_TERMS], spread[REST_TERMS][REST_TERMS], noise;
} rest_filter;

/* Memory of the last vertices of a kind: mean squared errors of the guesses, mean magnitudes of the integers. */
typedef struct {
    double error[REST_GUESSES][3];
    uint32_t mean[3];
} rest_memory;

typedef struct {
    rest_filter filters[REST_FILTERS];
    rest_memory all, phases[REST_PHASES]; /* for all vertices, and by the place within the lag */
    double increments[REST_PHASES][3];
} rest_predictor;

/* The terms and guesses of one vertex. */
typedef struct {
    rest_filter *filter;
    rest_memory *phase;
    double *increment;
    double base[3], terms[REST_TERMS][3], guesses[REST_GUESSES][3];
    int32_t term_count, guess_count;
} rest_guess;

/* Guess 6 is usually a bad one, and the last two know the layer before. */
static void rest_memory_init(rest_memory *memory)
{
    for (int32_t k = 0; k < 3; k++) {
        for (int32_t g = 0; g < REST_GUESSES; g++) memory->error[g][k] = g < 6 ? 32.0 : g == 6 ? 128.0 : 4.0;
        memory->mean[k] = 128;
    }
}

static void rest_predictor_init(rest_predictor *predictor)
{
    memset(predictor, 0, sizeof *predictor);
    for (int32_t f = 0; f < REST_FILTERS; f++) {
        for (int32_t j = 0; j < REST_TERMS; j++) predictor->filters[f].spread[j][j] = 1.0;
        predictor->filters[f].weight[3] = 1.0;
        predictor->filters[f].noise = 16.0;
    }
    rest_memory_init(&predictor->all);
    for (int32_t p = 0; p < REST_PHASES; p++) rest_memory_init(&predictor->phases[p]);
}

/* Returns vertex j of a stem, the attach vertex for -1; null: there is none. */
ATH_INLINE const double *rest_on_stem(const ath_branch *branch, const double *rest, int32_t j)
{
    if (j >= 0) return rest + 3 * (size_t)(branch->first + j);
    return j == -1 && branch->attach >= 0 ? rest + 3 * (size_t)branch->attach : 0;
}

ATH_INLINE void rest_term(double term[3], const double *from, const double *to, double per_unit)
{
    for (int32_t k = 0; k < 3; k++) term[k] = from && to ? (to[k] - from[k]) * per_unit : 0.0;
}

ATH_INLINE int rest_is_far(double units) { return !(units > -1e9 && units < 1e9); }

static void rest_guess_all(const rest_filter *filter, rest_guess *at)
{
    for (int32_t k = 0; k < 3; k++) {
        double sum = 0.0;
        for (int32_t j = 0; j < at->term_count; j++) sum = sum + filter->weight[j] * at->terms[j][k];
        at->guesses[0][k] = 0.0;
        at->guesses[1][k] = at->terms[0][k];
        at->guesses[2][k] = at->terms[3][k];
        at->guesses[3][k] = at->terms[5][k];
        at->guesses[4][k] = at->terms[5][k] + at->terms[6][k];
        at->guesses[5][k] = rest_is_far(sum) ? 0.0 : sum;
        at->guesses[6][k] = at->terms[7][k];
        at->guesses[7][k] = at->terms[8][k];
        at->guesses[8][k] = at->terms[9][k];
    }
}

/* before: the rest pose of the layer before, or null. */
static void rest_look_around(rest_predictor *predictor, const ath_branch *branch, const double *rest,
                             const double *before, int32_t i, double per_unit, rest_guess *at)
{
    static const double origin[3] = {0.0, 0.0, 0.0};
    int32_t lag = branch->lag > 1 ? branch->lag : 1, back = i >= lag && lag > 1 ? i - lag : -2,
            phase = i % lag % (REST_PHASES - 1);
    const double *base = rest_on_stem(branch, rest, i - 1), *row = rest_on_stem(branch, rest, back);
    at->filter = predictor->filters + (i == 0 ? 0 : lag <= 4 ? 1 + i % lag : REST_FILTERS - 1);
    at->phase = predictor->phases + (i == 0 ? 0 : 1 + phase);
    at->increment = predictor->increments[i == 0 ? 0 : 1 + phase];
    for (int32_t j = 0; j < 3; j++)
        rest_term(at->terms[j], rest_on_stem(branch, rest, i - j - 2), rest_on_stem(branch, rest, i - j - 1), per_unit);
    if (i >= lag)
        rest_term(at->terms[3], rest_on_stem(branch, rest, i - lag - 1), row, per_unit);
    else
        memcpy(at->terms[3], at->increment, sizeof at->terms[3]);
    if (!base) base = origin;
    rest_term(at->terms[4], row, lag > 1 ? rest_on_stem(branch, rest, back + 1) : 0, per_unit);
    rest_term(at->terms[5], base, row, per_unit);
    rest_term(at->terms[6], row && i >= 2 * (int64_t)lag ? rest_on_stem(branch, rest, i - 2 * lag) : 0, row, per_unit);
    rest_term(at->terms[7], base, origin, per_unit);
    if (before) {
        const double *known = rest_on_stem(branch, before, i), *known_base = rest_on_stem(branch, before, i - 1);
        rest_term(at->terms[8], base, known, per_unit);
        rest_term(at->terms[9], known_base ? known_base : origin, known, per_unit);
    } else {
        memset(at->terms + REST_OWN_TERMS, 0, sizeof at->terms[0] * (REST_TERMS - REST_OWN_TERMS));
    }
    at->term_count = before ? REST_TERMS : REST_OWN_TERMS;
    at->guess_count = before ? REST_GUESSES : REST_OWN_GUESSES;
    memcpy(at->base, base, sizeof at->base);
    rest_guess_all(at->filter, at);
}

/* Returns the weighted mean of the guesses on one axis. Guesses that were good nearby weigh by far the most. */
static double rest_expected(const rest_memory *all, const rest_guess *at, int32_t k)
{
    double sum = 0.0, weights = 0.0, error[REST_GUESSES], least = 0.0;
    for (int32_t g = 0; g < at->guess_count; g++) {
        error[g] = (all->error[g][k] + 0.05) * (at->phase->error[g][k] + 0.05);
        if (g == 0 || error[g] < least) least = error[g];
    }
    for (int32_t g = 0; g < at->guess_count; g++) {
        double weight = least / error[g];
        weight = weight * weight;
        weight = weight * weight;
        sum = sum + weight * at->guesses[g][k];
        weights = weights + weight;
    }
    return sum / weights;
}

/* Clips large errors, so that outliers do not spoil the mean. */
ATH_INLINE void rest_note_error(double *mean, double error, double rate)
{
    double most = 4.0 * *mean + 16.0;
    *mean = *mean + ((error < most ? error : most) - *mean) * rate;
}

/* Takes a step of recursive least squares. Older samples lose weight only in the direction that is learned from. The
 * matrix is symmetric. */
ATH_INLINE void rest_learn_axis(int32_t n, rest_filter *filter, const rest_guess *at, int32_t k, double noise,
                                double offset)
{
    double gain[REST_TERMS] = {0.0}, part[REST_TERMS], known = 0.0, error = offset;
    for (int32_t l = 0; l < n; l++)
        for (int32_t j = 0; j < n; j++) gain[j] = gain[j] + filter->spread[l][j] * at->terms[l][k];
    for (int32_t j = 0; j < n; j++) {
        known = known + gain[j] * at->terms[j][k];
        error = error - filter->weight[j] * at->terms[j][k];
    }
    if (!(known > 0.0)) return;
    double step = error / (noise + known);
    double less = (known - REST_FORGET * noise) / (known * (noise + known));
    for (int32_t j = 0; j < n; j++) {
        part[j] = gain[j] * less;
        filter->weight[j] = filter->weight[j] + gain[j] * step;
    }
    for (int32_t l = 0; l < n; l++) {
        for (int32_t j = 0; j < n; j++) filter->spread[l][j] = filter->spread[l][j] - part[j] * gain[l];
        for (int32_t j = 0; j < l; j++) filter->spread[l][j] = filter->spread[j][l];
    }
}

/* Notes the errors of the guesses for a vertex at `offset`, and its coded integers. */
ATH_HOT static void rest_note(rest_memory *memory, const rest_guess *at, const double offset[3],
                              const int32_t integers[3], double rate)
{
    double repeated[3 * REST_GUESSES], *mean = (double *)memory->error;
    const double *guess = (const double *)at->guesses;
    for (int32_t i = 0; i < 3 * REST_GUESSES; i++) repeated[i] = offset[i % 3];
    for (int32_t i = 0; i < 3 * at->guess_count; i++) {
        double error = repeated[i] - guess[i];
        rest_note_error(mean + i, error * error, rate);
    }
    for (int32_t k = 0; k < 3; k++) memory->mean[k] = averaged(memory->mean[k], integers[k]);
}

ATH_HOT static void rest_learn(rest_predictor *predictor, rest_guess *at, double per_unit, const double point[3],
                               const int32_t integers[3])
{
    double offset[3], squares = 0.0, usual, noise;
    rest_term(offset, at->base, point, per_unit);
    rest_note(&predictor->all, at, offset, integers, 0.06);
    rest_note(at->phase, at, offset, integers, 0.1);
    for (int32_t k = 0; k < 3; k++) {
        double error = offset[k] - at->guesses[5][k];
        squares = squares + error * error;
    }
    squares = squares / 3.0;
    usual = 0.3 + at->filter->noise;
    noise = usual + squares + 0.1 * squares * (squares / usual);
    for (int32_t k = 0; k < 3; k++)
        if (at->term_count == REST_OWN_TERMS) /* Code for a constant is much faster. */
            rest_learn_axis(REST_OWN_TERMS, at->filter, at, k, noise, offset[k]);
        else if (at->term_count == CONNECTED_TERMS)
            rest_learn_axis(CONNECTED_TERMS, at->filter, at, k, noise, offset[k]);
        else
            rest_learn_axis(at->term_count, at->filter, at, k, noise, offset[k]);
    double most = 8.0 * at->filter->noise + 4.0;
    at->filter->noise = at->filter->noise + ((squares < most ? squares : most) - at->filter->noise) * 0.1;
    memcpy(at->increment, offset, sizeof offset);
}

#endif
