/* The reference pose by steps, and its refinements (FORMAT.md, "REST"). Compiled once for each direction. */
#ifndef ATH_STREAMS_REST_INL
#define ATH_STREAMS_REST_INL

#include "bits/refinements.inl"
#include "model/basis.h"
#include "model/lanes.h"
#include "model/motion.h"
#include "streams/rest_connected.inl"
#include "streams/rest_copies.inl"

enum { WHOLE_DETAIL = 128 }; /* the detail whose step is 1 */
enum { OF_COPY = -2 };       /* stands in `from` for a vertex that a copy has placed */
enum { REST_RUN = 32, REST_BASES = REST_RUN * (REST_RUN + 1) * (2 * REST_RUN + 1) / 6 };

/* A layer's rest pose and what it is coded about. A refinement knows the integers (`coarse`) and positions (`before`)
 * of the layer before, three per vertex. Integers of a run's modes stand with its vertices. */
typedef struct {
    const ath_branch *branches;
    int32_t branch_count;
    double step, *rest;
    const int32_t *coarse; /* null: this is no refinement */
    const double *before;
    int32_t *steps; /* filled for the next layer; may be null */
    ath_mesh *mesh; /* order of a connected pose, else null */
    /* For the encoder: how far it may move a vertex to save bits, and a copy of the source's pose, in which parts with
     * detail follow what they hang on. */
    double slack, *moved;
    /* For the encoder: the branch that each branch copies, itself if others copy it; -1: neither. */
    const int32_t *shape_of;
} rest_layer;

typedef struct {
    lattice_model lattice;
    rest_predictor predictor, connected;
} rest_vertices;

typedef struct {
    ath_coder coder; /* of a stream that is decoded for budgets */
    rest_layer layer;
    int32_t has_copies, next; /* next: the branch to code, or the place in the mesh's order */
    int32_t shape;            /* last branch whose role is a shape */
    number_model bent;        /* steps of single vertices of SOURCE_REST */
    uint32_t bent_mean[3];
    union {
        coefficient_model modes;
        refinement_model refined_modes;
    };
    uint32_t history[HISTORY_ROWS * REST_RUN];
    rest_vertices single[2]; /* for branches without detail, and with detail */
    copy_model copies;
    double work[2 * REST_RUN * REST_RUN];
    double bases[REST_BASES]; /* for runs of 1, 2, ... REST_RUN vertices, made when needed, and kept by refinements */
    uint8_t made[REST_RUN + 1];
} rest_model;

static void rest_model_init(rest_model *model, int is_refinement)
{
    number_model_init(&model->bent);
    for (int32_t k = 0; k < 3; k++) model->bent_mean[k] = 64;
    if (is_refinement)
        refinement_model_init(&model->refined_modes, REST_RUN, model->history);
    else
        coefficient_model_init(&model->modes, REST_RUN, model->history);
    if (ENCODING || !is_refinement) memset(model->made, 0, sizeof model->made);
    for (int32_t i = 0; i < 2; i++) {
        lattice_model_init(&model->single[i].lattice);
        rest_predictor_init(&model->single[i].predictor);
        rest_connected_init(&model->single[i].connected);
    }
    copy_model_init(&model->copies);
}

/* Returns the step of a branch, which its detail may make finer than `step`. */
static double rest_step(const ath_branch *branch, double step)
{
    double most = branch->detail > 0 ? ath_node_step(branch->detail - WHOLE_DETAIL) : step;
    return most < step ? most : step;
}

static rest_vertices *single_of(rest_model *model, const ath_branch *branch)
{
    return model->single + (branch->detail > 0);
}

/* Codes a point of the lattice under the mean size of the last points, of all and of those of the phase. */
static void code_rest_point(ath_coder *coder, lattice_model *lattice, const rest_memory *all, const rest_memory *phase,
                            int32_t integers[3])
{
    const uint32_t *mean = all->mean, *own = phase->mean;
    for (int32_t k = 0; k < 3; k++) {
        int32_t about = (number_class((mean[k] + mean[0] + mean[1] + mean[2]) / 4)
                         + number_class((own[k] + own[0] + own[1] + own[2]) / 4) + 1)
                        / 2;
        integers[k] = code_integer(coder, lattice, parity_of(integers, k), about, integers[k]);
    }
}

/* Codes a vertex as a point of a lattice about its prediction. Branches with detail have no slack. */
static void code_expected_vertex(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branch,
                                 rest_predictor *predictor, rest_guess *at, int32_t v, double unit,
                                 const double *source, double *rest)
{
    double per_unit = 1.0 / unit, expected[3], *out = rest + 3 * (size_t)v;
    int32_t integers[3] = {0, 0, 0};
    for (int32_t k = 0; k < 3; k++) expected[k] = at->base[k] + rest_expected(&predictor->all, at, k) * unit;
#ifdef ATH_ENCODING
    double units[3];
    rest_term(units, expected, source + (out - rest), per_unit);
    nearest_of_lattice(units, branch->detail > 0 ? 0.0 : layer->slack * per_unit, at->phase->mean, integers);
#endif
    (void)source, (void)layer;
    code_rest_point(coder, &single_of(model, branch)->lattice, &predictor->all, at->phase, integers);
    for (int32_t k = 0; k < 3; k++) out[k] = expected[k] + (double)integers[k] * unit;
    rest_learn(predictor, at, per_unit, out, integers);
}

/* Codes vertex i of a stem about those before it. */
static void code_single_vertex(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branch,
                               int32_t i, double step, const double *source, double *rest)
{
    rest_predictor *predictor = &single_of(model, branch)->predictor;
    double unit = LATTICE_UNIT * step;
    rest_guess at;
    rest_look_around(predictor, branch, rest, layer->before, i, 1.0 / unit, &at);
    code_expected_vertex(coder, model, layer, branch, predictor, &at, branch->first + i, unit, source, rest);
}

/* Codes a branch as a copy of the shape used last. place: the encoder's choice. */
static int code_copy(ath_coder *coder, copy_model *model, const rest_layer *layer, const ath_branch *branches,
                     const ath_branch *branch, double step, copy_place *place, const double *source, double *rest)
{
    const ath_branch *shape = branches + model->shapes[0].branch;
    const double *from = rest + 3 * (size_t)shape->first;
    double unit = LATTICE_UNIT * step, own = COPY_PLACE * unit, offset[3], expected[3];
    double *out = rest + 3 * (size_t)branch->first;
    int32_t integers[3] = {0, 0, 0};
    rest_guess at;
    if (!code_copy_place(coder, model, model->shapes, copy_lever(shape, rest), unit, place)) return 0;
    copy_start(model, branch, shape, place, rest, own, &at, expected);
#ifdef ATH_ENCODING
    double target[3], units[3];
    double slack = copy_target(branch, shape, place, unit, layer->slack, expected, source, rest, target);
    rest_term(units, expected, target, 1.0 / own);
    nearest_of_lattice(units, slack / own, model->first.mean, integers);
#endif
    (void)source;
    code_rest_point(coder, &model->lattice, &model->first, &model->first, integers);
    for (int32_t k = 0; k < 3; k++) out[k] = expected[k] + (double)integers[k] * own;
    rest_term(model->increment, at.base, out, 1.0);
    rest_term(offset, at.base, out, 1.0 / own);
    rest_note(&model->first, &at, offset, integers, 0.1);
    for (int32_t i = 1; i < branch->count; i++) {
        double way[3];
        copy_way(place->R, from, from + 3 * i, way);
        for (int32_t k = 0; k < 3; k++) out[3 * i + k] = out[k] + way[k];
    }
    if (layer->steps) memset(layer->steps + (out - rest), 0, 3 * (size_t)branch->count * sizeof *layer->steps);
    return 1;
}

/* The encoder's choice of a branch's role, and of a shape by its rank among those with as many vertices. */
static int32_t wanted_role(const copy_model *model, const rest_layer *layer, const ath_branch *branches, int32_t b,
                           double step, const double *source, const double *rest, int32_t *rank, copy_place *place)
{
#ifdef ATH_ENCODING
    int32_t shape = layer->shape_of[b];
    if (shape == b) return SHAPE_PART;
    *rank = 0;
    for (int32_t i = 0; shape >= 0 && i < model->shape_count; i++) {
        if (model->shapes[i].branch == shape)
            return choose_copy(model, branches, branches + b, i, LATTICE_UNIT * step, layer->slack, source, rest, place)
                       ? COPY_PART
                       : PLAIN_PART;
        *rank += branches[model->shapes[i].branch].count == branches[b].count;
    }
#endif
    (void)model, (void)layer, (void)branches, (void)b, (void)step, (void)source, (void)rest, (void)rank, (void)place;
    return PLAIN_PART;
}

/* Codes the role of branch b, and the branch if it is a copy. Returns the role; -1: it is not valid. */
static int32_t code_part(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branches,
                         int32_t b, double step, const double *source, double *rest)
{
    copy_model *copies = &model->copies;
    const ath_branch *branch = branches + b;
    int32_t *last = copies->role + ath_min(branch->count, COPY_COUNTS) - 1, rank = 0, before = *last;
    copy_place place;
    memset(&place, 0, sizeof place);
    int32_t role = wanted_role(copies, layer, branches, b, step, source, rest, &rank, &place);
    if (shape_of_rank(copies, branches, branch->count, 0) >= 0
        && coder_bit(coder, &copies->copied[before], role == COPY_PART)) {
        *last = COPY_PART;
        rank = (int32_t)code_unsigned(coder, &copies->rank, copies->mean_rank, (uint32_t)rank);
        int32_t index = shape_of_rank(copies, branches, branch->count, rank);
        if (index < 0) return -1;
        copies->mean_rank = averaged(copies->mean_rank, rank);
        move_to_front(copies, index);
        return code_copy(coder, copies, layer, branches, branch, step, &place, source, rest) ? COPY_PART : -1;
    }
    *last = coder_bit(coder, &copies->is_shape[before], role == SHAPE_PART) ? SHAPE_PART : PLAIN_PART;
    if (*last == SHAPE_PART) add_shape(copies, b);
    return *last;
}

static const double *rest_basis(rest_model *model, int32_t n)
{
    double *basis = model->bases + (n - 1) * n * (2 * n - 1) / 6;
    if (!model->made[n]) ath_rest_basis(n, basis, model->work);
    model->made[n] = 1;
    return basis;
}

/* coarse: null, or three axes of n integers; where one is 0, so is the step. */
static void steps_of_run(int32_t n, const double *basis, double step, double half, const double base[3],
                         const double *run, const int32_t *coarse, int32_t *row)
{
    for (int32_t k = 0; k < 3; k++)
        for (int32_t m = 0; m < n; m++) {
            double sum = 0.0;
            if (coarse && coarse[k * n + m] == 0) continue;
            for (int32_t i = 0; i < n; i++) sum = sum + basis[m * n + i] * (run[3 * i + k] - base[k]);
            row[k * REST_RUN + m] = steps_in(sum, step, half);
        }
}

static void refine_rest_row(ath_coder *coder, rest_model *model, const rest_layer *layer, int32_t first, int32_t n,
                            const double *basis, double step, const double base[3], int32_t *row)
{
    int32_t predicted[3 * REST_RUN] = {0}, known[3 * REST_RUN] = {0};
    row_prediction prediction = {predicted, known, 0, REST_RUN, REST_RUN, {1, 1, 1}};
    const int32_t *coarse = layer->coarse + 3 * (size_t)first;
    steps_of_run(n, basis, step, 0.5, base, layer->before + 3 * (size_t)first, coarse, predicted);
    for (int32_t k = 0; k < 3; k++) memcpy(known + k * REST_RUN, coarse + k * n, (size_t)n * sizeof *known);
    code_refined_row(coder, &model->refined_modes, n, 0, -1, &prediction, row);
}

ATH_HOT static void sum_modes(int32_t n, const double *basis, const int32_t *steps, double *sums)
{
    double weight[REST_RUN];
    const double *modes[REST_RUN];
    for (int32_t m = 0; m < n; m++) {
        weight[m] = (double)steps[m];
        modes[m] = basis + m * n;
    }
    lanes_sum(n, n, weight, modes, 0.0, sums);
}

/* Codes `n` vertices of a beam from `first` on, by the modes of a beam that hangs on `base`. */
static void code_rest_run(ath_coder *coder, rest_model *model, const rest_layer *layer, int32_t first, int32_t n,
                          const double base[3], double step, const double *source, double *rest)
{
    int32_t row[3 * REST_RUN] = {0};
    const double *basis = rest_basis(model, n);
    double *run = rest + 3 * (size_t)first;
    if (ENCODING) steps_of_run(n, basis, step, 0.55, base, source + 3 * (size_t)first, 0, row);
    if (layer->coarse)
        refine_rest_row(coder, model, layer, first, n, basis, step, base, row);
    else
        code_row(coder, &model->modes, REST_RUN, n, 0, -1, row);
    for (int32_t k = 0; layer->steps && k < 3; k++)
        memcpy(layer->steps + 3 * first + k * n, row + k * REST_RUN, (size_t)n * sizeof *row);
    for (int32_t k = 0; k < 3; k++) {
        double sums[REST_RUN];
        sum_modes(n, basis, row + k * REST_RUN, sums);
        for (int32_t i = 0; i < n; i++) run[3 * i + k] = base[k] + sums[i] * step;
    }
}

/* Cuts a beam into runs of nearly equal length. Each hangs on the vertex before it. */
static void code_rest_beam(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branch,
                           double step, const double *source, double *rest)
{
    int32_t from = branch->attach < 0, left = branch->count - from, runs = (left + REST_RUN - 1) / REST_RUN;
    if (from) code_single_vertex(coder, model, layer, branch, 0, step, source, rest);
    for (int32_t r = 0; r < runs; r++) {
        int32_t start = from + (int32_t)((int64_t)left * r / runs),
                end = from + (int32_t)((int64_t)left * (r + 1) / runs);
        size_t before = start > 0 ? (size_t)(branch->first + start - 1) : (size_t)branch->attach;
        double base[3] = {rest[3 * before], rest[3 * before + 1], rest[3 * before + 2]};
        code_rest_run(coder, model, layer, branch->first + start, end - start, base, step, source, rest);
    }
}

/* Finds the branch of a vertex by bisection. */
static const ath_branch *branch_of(const ath_branch *branches, int32_t branch_count, int32_t v)
{
    int32_t low = 0, high = branch_count;
    while (high - low > 1) {
        int32_t middle = low + (high - low) / 2;
        if (branches[middle].first <= v)
            low = middle;
        else
            high = middle;
    }
    return branches + low;
}

/* Returns whether v begins a branch that is not coded yet at place t of the mesh's order. */
static int is_untouched(const ath_mesh *mesh, const ath_branch *branch, int32_t v, int32_t t)
{
    if (v != branch->first) return 0;
    for (int32_t i = 1; i < branch->count; i++)
        if (mesh->rank[v + i] < t) return 0;
    return 1;
}

enum { VERTEX_COST = 16 }; /* vertex-frames that coding a vertex takes */

/* Codes vertices in the order of the mesh about their neighbours. A vertex without known neighbours is coded as on a
 * stem, since all vertices before it are known. */
static int code_connected_rest(ath_coder *coder, rest_model *model, const double *source, int32_t *cost)
{
    const rest_layer *layer = &model->layer;
    const ath_branch *branches = layer->branches, *branch = branches;
    ath_mesh *mesh = layer->mesh;
    double *rest = layer->rest, own = rest_step(branch, layer->step);
    for (; model->next < mesh->vertex_count; model->next++) {
        int32_t t = model->next, v = mesh->order[t];
        if (!ath_spend(cost, VERTEX_COST)) return ATH_MORE;
        if (mesh->from[v] == OF_COPY) continue;
        if (v < branch->first || v - branch->first >= branch->count) {
            branch = branch_of(branches, layer->branch_count, v);
            own = rest_step(branch, layer->step);
        }
        rest_predictor *predictor = &single_of(model, branch)->connected;
        double step_here = own;
        rest_ring ring;
        rest_guess at;
        rest_ring_of(mesh, rest, v, &ring);
        if (model->has_copies && ring.base < 0 && is_untouched(mesh, branch, v, t)) {
            int32_t b = (int32_t)(branch - branches);
            int32_t role = code_part(coder, model, layer, branches, b, step_here, source, rest);
            if (role < 0) return 0;
            if (role == SHAPE_PART) model->shape = b;
            for (int32_t i = 0; role == COPY_PART && i < branch->count; i++) mesh->from[v + i] = OF_COPY;
            if (role == COPY_PART) continue;
        }
        if (branch == branches + model->shape) step_here = SHAPE_FINER * step_here;
        double unit = LATTICE_UNIT * step_here;
        mesh->from[v] = ring.base;
        if (ring.base < 0) {
            code_single_vertex(coder, model, layer, branch, v - branch->first, step_here, source, rest);
            continue;
        }
        rest_look_beside(predictor, mesh, &ring, rest, layer->before, v, 1.0 / unit, &at);
        code_expected_vertex(coder, model, layer, branch, predictor, &at, v, unit, source, rest);
    }
    return 1;
}

/* A branch with detail keeps its shape: it moves with the coarser stem that it hangs on, and what hangs on it
 * follows. */
static void take_along(const ath_branch *branches, const ath_branch *branch, const double *source, double *moved,
                       const double *rest)
{
    if (branch->detail == 0 || branch->attach < 0) return;
    const double *there = branches[branch->parent].detail > 0 ? moved : rest;
    for (int32_t k = 0; k < 3; k++) {
        double way = there[3 * branch->attach + k] - source[3 * branch->attach + k];
        for (int32_t v = branch->first; v < branch->first + branch->count; v++) moved[3 * v + k] += way;
    }
}

/* The layer is filled in already. */
static void start_rest(ath_coder *coder, rest_model *model)
{
    const rest_layer *layer = &model->layer;
    rest_model_init(model, layer->coarse != 0);
    model->has_copies = !layer->coarse && coder_bit(coder, &model->copies.any, layer->shape_of != 0);
    model->shape = -1;
    model->next = 0;
    for (int32_t v = 0; layer->mesh && v < layer->mesh->vertex_count; v++) layer->mesh->from[v] = -1;
}

/* Returns 1; 0: the stream is not valid; ATH_MORE: the budget is spent. */
static int code_rest(ath_coder *coder, rest_model *model, const double *source, int32_t *cost)
{
    const rest_layer *layer = &model->layer;
    const ath_branch *branches = layer->branches;
    double *rest = layer->rest;
    if (layer->mesh) return code_connected_rest(coder, model, source, cost);
    for (; model->next < layer->branch_count && !model->modes.invalid; model->next++) {
        int32_t b = model->next, role = PLAIN_PART;
        double own = rest_step(branches + b, layer->step);
        if (!ath_spend(cost, VERTEX_COST * branches[b].count)) return ATH_MORE;
        if (ENCODING) take_along(branches, branches + b, source, layer->moved, rest);
        if (model->has_copies) role = code_part(coder, model, layer, branches, b, own, layer->moved, rest);
        if (role < 0) return 0;
        if (role == COPY_PART) continue;
        if (role == SHAPE_PART) own = SHAPE_FINER * own;
        if (branches[b].lag == 0)
            code_rest_beam(coder, model, layer, branches + b, own, layer->moved, rest);
        else
            for (int32_t i = 0; i < branches[b].count; i++)
                code_single_vertex(coder, model, layer, branches + b, i, own, layer->moved, rest);
    }
    return !model->modes.invalid;
}

#endif
