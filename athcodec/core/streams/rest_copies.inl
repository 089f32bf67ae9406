/* Parts of a rest pose that are copies of one shape: turned, scaled and mirrored (FORMAT.md, "Copies"). Compiled for
 * each direction. */
#ifndef ATH_STREAMS_REST_COPIES_INL
#define ATH_STREAMS_REST_COPIES_INL

#include "streams/rest_predictor.inl"

enum { REST_SHAPES = 64, COPY_COUNTS = 16 };
enum { PLAIN_PART, SHAPE_PART, COPY_PART, PART_ROLES };

#define SHAPE_FINER 0.25 /* step of a shape over that of other branches */
#define COPY_PLACE 0.5   /* unit of a copy's first vertex over that of other vertices */
#define COPY_TURN 0.9    /* units: half of how far one integer of a quaternion moves the furthest vertex */

/* Mean magnitudes of an integer, and of its difference from the last one. */
typedef struct {
    uint32_t mean[2];
} copy_number;

/* A branch that others copy, and the place of the last copy. */
typedef struct {
    int32_t branch, mirrored;
    double turn[4], scale; /* scale less 1 */
    copy_number turns[4], scales;
} rest_shape;

typedef struct {
    ath_context any, copied[PART_ROLES], is_shape[PART_ROLES], mirrored[2], largest[3];
    number_model rank, turn, scale;
    uint32_t mean_rank;
    lattice_model lattice;
    rest_memory first;                      /* memory of the first vertices of copies */
    double increment[3];                    /* from the attach vertex of the last copy to its first vertex */
    int32_t shape_count, role[COPY_COUNTS]; /* role of the last branch, by its number of vertices */
    rest_shape shapes[REST_SHAPES];         /* last used first */
} copy_model;

/* The place of a copy. */
typedef struct {
    int32_t mirrored, largest, scale, turns[4];
    double R[9]; /* rotation, scale and mirror in one */
} copy_place;

static void copy_model_init(copy_model *model)
{
    memset(model, 0, sizeof *model);
    context_init(&model->any, 2048);
    for (int32_t role = 0; role < PART_ROLES; role++) {
        context_init(&model->copied[role], 32768);
        context_init(&model->is_shape[role], 4096);
    }
    for (int32_t i = 0; i < 2; i++) context_init(&model->mirrored[i], 8192);
    for (int32_t i = 0; i < 3; i++) context_init(&model->largest[i], 32768);
    number_model_init(&model->rank);
    number_model_init(&model->turn);
    number_model_init(&model->scale);
    model->mean_rank = 16;
    lattice_model_init(&model->lattice);
    rest_memory_init(&model->first);
}

/* Returns shape number `rank` among those with `count` vertices, last used first; -1: there is none. */
static int32_t shape_of_rank(const copy_model *model, const ath_branch *branches, int32_t count, int32_t rank)
{
    for (int32_t i = 0; i < model->shape_count; i++)
        if (branches[model->shapes[i].branch].count == count && rank-- == 0) return i;
    return -1;
}

static void move_to_front(copy_model *model, int32_t at)
{
    rest_shape used = model->shapes[at];
    for (; at > 0; at--) model->shapes[at] = model->shapes[at - 1];
    model->shapes[0] = used;
}

static void add_shape(copy_model *model, int32_t branch)
{
    rest_shape shape = {branch, 0, {1.0, 0.0, 0.0, 0.0}, 0.0, {{{0, 0}}}, {{0, 0}}};
    for (int32_t c = 0; c < 4; c++) shape.turns[c].mean[0] = shape.turns[c].mean[1] = 512;
    model->shape_count = ath_min(model->shape_count + 1, REST_SHAPES);
    model->shapes[model->shape_count - 1] = shape;
    move_to_front(model, model->shape_count - 1);
}

/* Codes an integer about 0 or the last one, whichever has been closer. */
static int code_copy_number(ath_coder *coder, number_model *model, copy_number *known, int32_t last, int32_t *value)
{
    int repeated = known->mean[1] < known->mean[0];
    int32_t about = repeated ? last : 0;
    int64_t coded = (int64_t)about + code_signed(coder, model, known->mean[repeated], ENCODING ? *value - about : 0);
    if (coded <= -(1 << 29) || coded >= 1 << 29) return 0;
    *value = (int32_t)coded;
    for (int32_t i = 0; i < 2; i++) known->mean[i] = averaged(known->mean[i], *value - (i ? last : 0));
    return 1;
}

/* Returns the largest distance of a branch's vertices from its first one. */
static double copy_lever(const ath_branch *shape, const double *rest)
{
    const double *first = rest + 3 * (size_t)shape->first;
    double most = 0.0;
    for (int32_t i = 1; i < shape->count; i++) {
        double x = first[3 * i] - first[0], y = first[3 * i + 1] - first[1], z = first[3 * i + 2] - first[2];
        double square = x * x + y * y + z * z;
        if (square > most) most = square;
    }
    return ath_sqrt(most);
}

ATH_INLINE double copy_quantum(double lever, double unit) { return lever > 0.0 ? COPY_TURN * unit / lever : 1.0; }
ATH_INLINE int is_copy_scale(double s) { return s > 1e-3 && s < 1e3; }

/* Makes the matrix of a copy from its integers and notes it in `shape`. Returns 0 if it is not valid. */
static int copy_matrix(copy_place *place, double quantum, rest_shape *shape)
{
    double scale = (double)place->scale * quantum, s = 1.0 + scale, squares = 0.0, *q = shape->turn;
    for (int32_t c = 0; c < 4; c++) {
        if (c == place->largest) continue;
        q[c] = (double)place->turns[c] * (quantum / s);
        squares = squares + q[c] * q[c];
    }
    if (!(squares <= 1.0)) return 0;
    q[place->largest] = ath_sqrt(1.0 - squares);
    double w = q[0], x = q[1], y = q[2], z = q[3], m = place->mirrored ? -s : s;
    place->R[0] = m * (1.0 - 2.0 * (y * y + z * z));
    place->R[1] = s * (2.0 * (x * y - w * z));
    place->R[2] = s * (2.0 * (x * z + w * y));
    place->R[3] = m * (2.0 * (x * y + w * z));
    place->R[4] = s * (1.0 - 2.0 * (x * x + z * z));
    place->R[5] = s * (2.0 * (y * z - w * x));
    place->R[6] = m * (2.0 * (x * z - w * y));
    place->R[7] = s * (2.0 * (y * z + w * x));
    place->R[8] = s * (1.0 - 2.0 * (x * x + y * y));
    shape->scale = scale;
    shape->mirrored = place->mirrored;
    return 1;
}

ATH_INLINE void copy_way(const double R[9], const double from[3], const double to[3], double way[3])
{
    double x = to[0] - from[0], y = to[1] - from[1], z = to[2] - from[2];
    for (int32_t k = 0; k < 3; k++) way[k] = R[3 * k] * x + R[3 * k + 1] * y + R[3 * k + 2] * z;
}

/* Fills the guesses of a copy's first vertex: the attach vertex, and as far from it as on the last copy or the
 * shape. */
static void copy_guess(const copy_model *model, const ath_branch *branch, const ath_branch *shape,
                       const copy_place *place, const double *rest, double per_unit, rest_guess *at)
{
    const double *base = rest_on_stem(branch, rest, -1), *from = rest_on_stem(shape, rest, -1);
    memset(at, 0, sizeof *at);
    if (base) memcpy(at->base, base, sizeof at->base);
    memcpy(at->guesses[1], model->increment, sizeof model->increment);
    if (from && base) copy_way(place->R, from, rest_on_stem(shape, rest, 0), at->guesses[2]);
    at->guess_count = 3;
    for (int32_t g = 0; g < 3; g++)
        for (int32_t k = 0; k < 3; k++) at->guesses[g][k] = at->guesses[g][k] * per_unit;
}

static void copy_start(const copy_model *model, const ath_branch *branch, const ath_branch *shape,
                       const copy_place *place, const double *rest, double own, rest_guess *at, double expected[3])
{
    copy_guess(model, branch, shape, place, rest, 1.0 / own, at);
    at->phase = (rest_memory *)&model->first;
    for (int32_t k = 0; k < 3; k++) expected[k] = at->base[k] + rest_expected(&model->first, at, k) * own;
}

static int code_copy_place(ath_coder *coder, copy_model *model, rest_shape *shape, double lever, double unit,
                           copy_place *place)
{
    place->mirrored = coder_bit(coder, &model->mirrored[shape->mirrored], place->mirrored);
    double quantum = copy_quantum(lever, unit), s;
    if (!code_copy_number(coder, &model->scale, &shape->scales, steps_in(shape->scale, quantum, 0.5), &place->scale))
        return 0;
    s = 1.0 + (double)place->scale * quantum;
    if (!is_copy_scale(s)) return 0;
    int32_t high = coder_bit(coder, &model->largest[0], place->largest >> 1);
    place->largest = high << 1 | coder_bit(coder, &model->largest[1 + high], place->largest & 1);
    for (int32_t c = 0; c < 4; c++) {
        int32_t last = steps_in(shape->turn[c], quantum / s, 0.5);
        if (c != place->largest && !code_copy_number(coder, &model->turn, shape->turns + c, last, place->turns + c))
            return 0;
    }
    return copy_matrix(place, quantum, shape);
}

#ifdef ATH_ENCODING

enum { JACOBI_SWEEPS = 12, LEAST_COPIES = 2 };
#define OF_TOLERANCE 0.4 /* largest RMS error of a copy before rounding, over the tolerance */

/* A similarity that takes a shape to a part. off: RMS of the residual. */
typedef struct {
    double q[4], scale, off;
} copy_fit;

/* Makes a symmetric matrix diagonal. Its eigenvectors are the columns of V. */
static void jacobi4(double A[4][4], double V[4][4])
{
    for (int32_t i = 0; i < 16; i++) V[i / 4][i % 4] = i / 4 == i % 4;
    for (int32_t sweep = 0; sweep < JACOBI_SWEEPS; sweep++) {
        double left = 0.0, whole = 0.0;
        for (int32_t i = 0; i < 4; i++) {
            whole += A[i][i] * A[i][i];
            for (int32_t j = 0; j < i; j++) left += A[i][j] * A[i][j];
        }
        if (left <= 1e-28 * whole) break;
        for (int32_t p = 0; p < 3; p++)
            for (int32_t r = p + 1; r < 4; r++) {
                if (A[p][r] == 0.0) continue;
                double theta = (A[r][r] - A[p][p]) / (2.0 * A[p][r]);
                double t = (theta < 0.0 ? -1.0 : 1.0) / ((theta < 0.0 ? -theta : theta) + ath_sqrt(theta * theta + 1));
                double c = 1.0 / ath_sqrt(t * t + 1.0), s = t * c;
                for (int32_t k = 0; k < 4; k++) {
                    double a = A[k][p], b = A[k][r];
                    A[k][p] = c * a - s * b;
                    A[k][r] = s * a + c * b;
                }
                for (int32_t k = 0; k < 4; k++) {
                    double a = A[p][k], b = A[r][k];
                    A[p][k] = c * a - s * b;
                    A[r][k] = s * a + c * b;
                    a = V[k][p], b = V[k][r];
                    V[k][p] = c * a - s * b;
                    V[k][r] = s * a + c * b;
                }
            }
    }
}

static void mean_point(const double *points, int32_t count, double mean[3])
{
    for (int32_t k = 0; k < 3; k++) {
        mean[k] = 0.0;
        for (int32_t i = 0; i < count; i++) mean[k] += points[3 * i + k];
        mean[k] /= (double)count;
    }
}

/* Finds the best similarity from `from` to `to`. For a line, whose twist is free, q[3] is 0. */
static void fit_copy(const double *from, const double *to, int32_t count, int mirrored, double tolerance, copy_fit *fit)
{
    double a[3], b[3], H[3][3] = {{0}}, squares = 0.0, others = 0.0, A[4][4], V[4][4];
    mean_point(from, count, a);
    mean_point(to, count, b);
    for (int32_t i = 0; i < count; i++) {
        double y[3], x[3];
        for (int32_t k = 0; k < 3; k++) {
            y[k] = from[3 * i + k] - a[k];
            x[k] = to[3 * i + k] - b[k];
        }
        if (mirrored) y[0] = -y[0];
        for (int32_t j = 0; j < 3; j++) {
            squares += y[j] * y[j];
            others += x[j] * x[j];
            for (int32_t k = 0; k < 3; k++) H[j][k] += y[j] * x[k];
        }
    }
    A[0][0] = H[0][0] + H[1][1] + H[2][2];
    A[1][1] = H[0][0] - H[1][1] - H[2][2];
    A[2][2] = -H[0][0] + H[1][1] - H[2][2];
    A[3][3] = -H[0][0] - H[1][1] + H[2][2];
    A[0][1] = A[1][0] = H[1][2] - H[2][1];
    A[0][2] = A[2][0] = H[2][0] - H[0][2];
    A[0][3] = A[3][0] = H[0][1] - H[1][0];
    A[1][2] = A[2][1] = H[0][1] + H[1][0];
    A[1][3] = A[3][1] = H[2][0] + H[0][2];
    A[2][3] = A[3][2] = H[1][2] + H[2][1];
    jacobi4(A, V);
    int32_t best = 0, next = 1;
    for (int32_t i = 1; i < 4; i++)
        if (A[i][i] > A[best][best]) best = i;
    next = best == 0;
    for (int32_t i = 0; i < 4; i++)
        if (i != best && A[i][i] > A[next][next]) next = i;
    for (int32_t k = 0; k < 4; k++) fit->q[k] = V[k][best];
    if (2.0 * (A[best][best] - A[next][next]) <= 0.1 * tolerance * tolerance * count) {
        double z = V[3][best], other = V[3][next], length = ath_sqrt(z * z + other * other);
        for (int32_t k = 0; k < 4 && length > 1e-12; k++) fit->q[k] = (V[k][best] * other - V[k][next] * z) / length;
    }
    fit->scale = squares > 0.0 ? A[best][best] / squares : 1.0;
    double left = others - fit->scale * A[best][best];
    fit->off = left > 0.0 ? ath_sqrt(left / (double)count) : 0.0;
}

/* Returns whether a branch is a copy of a shape within the tolerance. */
static int looks_like_copy(const ath_branch *shape, const ath_branch *branch, const double *pose, double tolerance)
{
    const double *from = pose + 3 * (size_t)shape->first, *to = pose + 3 * (size_t)branch->first;
    double lever = copy_lever(shape, pose), size = copy_lever(branch, pose), most = OF_TOLERANCE * tolerance;
    for (int32_t i = 1; i < branch->count && lever > 0.0; i++) {
        double a = 0.0, b = 0.0;
        for (int32_t k = 0; k < 3; k++) {
            a += (from[3 * i + k] - from[k]) * (from[3 * i + k] - from[k]);
            b += (to[3 * i + k] - to[k]) * (to[3 * i + k] - to[k]);
        }
        double off = ath_sqrt(b) - ath_sqrt(a) * (size / lever);
        if (off * off > 25.0 * most * most) return 0;
    }
    for (int32_t m = 0; m < 2; m++) {
        copy_fit fit;
        fit_copy(from, to, branch->count, m, tolerance, &fit);
        if (fit.off <= most && fit.scale > 0.05 && fit.scale < 20.0) return 1;
    }
    return 0;
}

static double copy_tolerance(const ath_branch *branch, double unit, double slack)
{
    return branch->detail == 0 && slack > 0.0 ? slack : LATTICE_REACH * unit;
}

/* Rounds a similarity to integers. Returns 0 if its scale is out of range. */
static int copy_integers(const copy_fit *fit, double quantum, copy_place *place)
{
    place->scale = steps_in(fit->scale - 1.0, quantum, 0.5);
    double s = 1.0 + (double)place->scale * quantum;
    if (!is_copy_scale(s)) return 0;
    place->largest = 0;
    for (int32_t c = 1; c < 4; c++)
        if (fit->q[c] * fit->q[c] > fit->q[place->largest] * fit->q[place->largest]) place->largest = c;
    for (int32_t c = 0; c < 4; c++)
        place->turns[c] = steps_in(fit->q[place->largest] < 0.0 ? -fit->q[c] : fit->q[c], quantum / s, 0.5);
    return 1;
}

/* Returns the largest distance of a copy's vertices from the source's, if its first one is at `first`. */
static double copy_error(const copy_place *place, const double *shape, const double *first, const double *source,
                         int32_t count)
{
    double most = 0.0;
    for (int32_t i = 0; i < count; i++) {
        double way[3], square = 0.0;
        copy_way(place->R, shape, shape + 3 * i, way);
        for (int32_t k = 0; k < 3; k++) {
            double off = first[k] + way[k] - source[3 * i + k];
            square += off * off;
        }
        if (square > most) most = square;
    }
    return ath_sqrt(most);
}

/* Finds the best place of a copy's first vertex. Returns how far from there it may be. */
static double copy_target(const ath_branch *branch, const ath_branch *shape, const copy_place *place, double unit,
                          double slack, const double expected[3], const double *source, const double *rest,
                          double target[3])
{
    const double *points = rest + 3 * (size_t)shape->first, *wanted = source + 3 * (size_t)branch->first;
    double tolerance = copy_tolerance(branch, unit, slack), middle[3], mean[3], way[3];
    memcpy(target, expected, 3 * sizeof *target);
    if (copy_error(place, points, expected, wanted, branch->count) <= tolerance) return 0.0;
    mean_point(points, shape->count, mean);
    mean_point(wanted, branch->count, middle);
    copy_way(place->R, points, mean, way);
    for (int32_t k = 0; k < 3; k++) target[k] = middle[k] - way[k];
    double left = tolerance - copy_error(place, points, target, wanted, branch->count);
    return left > 0.0 ? left : 0.0;
}

/* Estimates a copy's cost: its bits, plus a hundredth of its error over the tolerance; huge beyond the tolerance. */
static double copy_cost(const copy_model *model, const ath_branch *branch, const ath_branch *shape,
                        const copy_place *place, double unit, double slack, const double *source, const double *rest)
{
    double tolerance = copy_tolerance(branch, unit, slack), expected[3], target[3], units[3], own = COPY_PLACE * unit;
    int32_t integers[3];
    double cost = 1.0, error;
    rest_guess at;
    copy_start(model, branch, shape, place, rest, own, &at, expected);
    double left = copy_target(branch, shape, place, unit, slack, expected, source, rest, target);
    rest_term(units, expected, target, 1.0 / own);
    nearest_of_lattice(units, left / own, model->first.mean, integers);
    for (int32_t k = 0; k < 3; k++) {
        target[k] = expected[k] + (double)integers[k] * own;
        cost *= 1.0 + magnitude_of(integers[k]);
    }
    error =
        copy_error(place, rest + 3 * (size_t)shape->first, target, source + 3 * (size_t)branch->first, branch->count);
    return error <= tolerance ? cost + 0.01 * error / tolerance : 1e300;
}

/* Finds the integers of a copy within the tolerance that are likely to take the fewest bits. Returns 0 if none do. */
static int choose_copy(const copy_model *model, const ath_branch *branches, const ath_branch *branch, int32_t index,
                       double unit, double slack, const double *source, const double *rest, copy_place *best)
{
    static const int32_t step[3] = {0, 1, -1};
    const ath_branch *shape = branches + model->shapes[index].branch;
    const double *points = rest + 3 * (size_t)shape->first, *wanted = source + 3 * (size_t)branch->first;
    double tolerance = copy_tolerance(branch, unit, slack), lever = copy_lever(shape, rest), cheapest = 1e299;
    copy_fit fits[2], *fit;
    copy_place start;
    for (int32_t m = 0; m < 2; m++) fit_copy(points, wanted, branch->count, m, tolerance, fits + m);
    start.mirrored = fits[1].off < 0.9 * fits[0].off - 1e-3 * tolerance;
    fit = fits + start.mirrored;
    double change = (fit->scale - 1.0) * lever;
    if (change * change < 0.04 * tolerance * tolerance) fit->scale = 1.0;
    if (fit->off > tolerance) return 0;
    double quantum = copy_quantum(lever, unit);
    if (!copy_integers(fit, quantum, &start)) return 0;
    for (int32_t choice = 0; choice < 27 && cheapest > 1.1; choice++) {
        copy_place tried = start;
        rest_shape memory = model->shapes[index];
        int32_t left = choice;
        for (int32_t c = 0; c < 4; c++) {
            if (c == tried.largest) continue;
            if (fit->q[c] != 0.0) tried.turns[c] += step[left % 3];
            left /= 3;
        }
        if (!copy_matrix(&tried, quantum, &memory)) continue;
        double cost = copy_cost(model, branch, shape, &tried, unit, slack, source, rest);
        if (cost >= cheapest) continue;
        cheapest = cost;
        *best = tried;
    }
    return cheapest < 1e299;
}

#endif
#endif
