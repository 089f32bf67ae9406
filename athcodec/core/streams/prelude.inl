/* What each stream of FORMAT.md holds, in which order. Compiled once for each direction, which ENCODING tells;
 * a value handed to a coding function is ignored when decoding. Functions return 0 when what they decoded is not
 * valid. */
#ifndef ATH_STREAMS_H
#define ATH_STREAMS_H

#include "bits/exact.inl"
#include "model/motion.h"
#include "bits/refinements.inl"
#include "streams/rest_connected.inl"
#include "streams/rest_copies.inl"

/* ---- hierarchy ---- */

enum { PLACES = 256, MOST_LAYERS = 8, MOST_DETAIL = 255, MOST_RING = 32, WHOLE_DETAIL = 128 /* of step 1 */ };

/* Of numbers in an order of their own: each is expected one step after the number before it, or else one step after that
 * at the same place of the last run that has one there, as in a source that holds all first vertices, then all second. */
typedef struct {
    number_model difference;
    ath_context permuted,
        expected[2][2][3]; /* by expectation; whether a run begins; which one was right before, 2: none */
    int32_t beside[PLACES], step[2], last; /* beside: -1: none yet */
    uint32_t mean;
} permutation_model;

typedef struct {
    ath_context any;
    number_model difference;
} branch_number_model;

typedef struct {
    number_model up, count, attach, lag;
    branch_number_model rigid, detail, ring;
    permutation_model branch_source, vertex_source;
    ath_context flag[3][2];
} hierarchy_model;

static void permutation_model_init(permutation_model *model)
{
    number_model_init(&model->difference);
    context_init(&model->permuted, 32768);
    for (int32_t i = 0; i < 12; i++) context_init(&model->expected[i / 6][i / 3 % 2][i % 3], 32768);
    for (int32_t i = 0; i < PLACES; i++) model->beside[i] = -1;
    model->step[0] = model->step[1] = 1;
    model->last = 0;
    model->mean = 64;
}

static void branch_number_model_init(branch_number_model *model)
{
    context_init(&model->any, 2048);
    number_model_init(&model->difference);
}

static void hierarchy_model_init(hierarchy_model *model)
{
    number_model_init(&model->up);
    number_model_init(&model->count);
    number_model_init(&model->attach);
    number_model_init(&model->lag);
    branch_number_model_init(&model->rigid);
    branch_number_model_init(&model->detail);
    branch_number_model_init(&model->ring);
    permutation_model_init(&model->branch_source);
    permutation_model_init(&model->vertex_source);
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 2; j++) context_init(&model->flag[i][j], 16384);
}

static int32_t code_flags(ath_coder *coder, hierarchy_model *model, int32_t before, int32_t flags)
{
    int32_t coded = 0;
    for (int32_t i = 0; i < 3; i++) coded |= coder_bit(coder, &model->flag[i][before >> i & 1], flags >> i & 1) << i;
    return coded;
}

/* How far up from branch b - 1 the parent of b lies: 0 = child of b - 1, its depth + 1 = a root. Returns the parent,
 * or -2 when it lies beyond a root. */
static int32_t code_parent(ath_coder *coder, hierarchy_model *model, const ath_branch *branches, int32_t b,
                           int32_t *last_up)
{
    int32_t up = 0, parent = b - 1;
    if (ENCODING) {
        for (; parent != branches[b].parent && parent >= 0; parent = branches[parent].parent) up++;
        parent = b - 1;
    }
    up = (int32_t)code_unsigned(coder, &model->up, (uint32_t)ath_min(*last_up, 1000) * 16, (uint32_t)up);
    *last_up = up;
    for (; up > 0 && parent >= 0; up--) parent = branches[parent].parent;
    return up > 0 ? -2 : parent;
}

static int code_branch(ath_coder *coder, hierarchy_model *model, ath_branch *branches, int32_t b, int32_t vertices_left,
                       int32_t *last_up, uint32_t *mean_count)
{
    static const ath_branch none = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    ath_branch *branch = branches + b;
    const ath_branch *before = b == 0 ? &none : branch - 1;
    branch->parent = b == 0 ? -1 : code_parent(coder, model, branches, b, last_up);
    if (branch->parent < -1) return 0;
    int32_t depth = branch->parent < 0 ? 0 : branches[branch->parent].depth + 1, kind = ath_min(depth, 15);
    branch->depth = depth;
    uint32_t more = code_unsigned(coder, &model->count, mean_count[kind], (uint32_t)(branch->count - 1));
    if (more >= (uint32_t)vertices_left) return 0;
    branch->count = (int32_t)more + 1;
    mean_count[kind] = averaged(mean_count[kind], (int32_t)more);
    branch->flags = code_flags(coder, model, before->flags, branch->flags);
    branch->lag = code_signed(coder, &model->lag, 0, branch->lag - before->lag) + before->lag;
    if (branch->lag < 0 || branch->lag > 65535 || (branch->parent < 0 && branch->flags & ATH_LOOSE)) return 0;
    branch->first = before->first + before->count;
    return 1;
}

/* Attach points relative to that of the sibling before; `subtree` serves as memory of it while coding. */
static int code_attach(ath_coder *coder, hierarchy_model *model, ath_branch *branches, int32_t b, uint32_t *mean)
{
    ath_branch *branch = branches + b, *parent = branches + branch->parent;
    int32_t step = code_signed(coder, &model->attach, *mean, branch->attach - parent->first - parent->subtree);
    int32_t place = parent->subtree + step;
    if (step < -(1 << 28) || step > 1 << 28 || place < 0 || place >= parent->count) return 0;
    branch->attach = parent->first + place;
    parent->subtree = place;
    *mean = averaged(*mean, step);
    return 1;
}

/* The number at `place` of a run that is expected to begin with `start`; `source` points at it, behind those before. */
static int code_source_number(ath_coder *coder, permutation_model *model, int32_t start, int32_t place, int32_t count,
                              int32_t *source)
{
    int32_t known = place < PLACES ? model->beside[place] : -1, right = 2;
    int64_t given = ENCODING ? *source : 0, value; /* when decoding, it is not initialised */
    int64_t following = place == 0 ? start : (int64_t)source[-1] + 1;
    int64_t along = place == 0 ? start : (int64_t)source[-1] + model->step[0];
    int64_t beside = (int64_t)known + model->step[1];
    ath_context(*expected)[2][3] = model->expected;
    if (coder_bit(coder, &expected[0][place == 0][model->last], given == along)) {
        right = 0;
        value = along;
    } else if (known >= 0 && coder_bit(coder, &expected[1][place == 0][model->last], given == beside)) {
        right = 1;
        value = beside;
    } else {
        int32_t difference = code_signed(coder, &model->difference, model->mean, (int32_t)(given - following));
        model->mean = averaged(model->mean, difference);
        value = following + difference;
    }
    if (value < 0 || value >= count) return 0;
    *source = (int32_t)value;
    model->last = right;
    if (place > 0) model->step[0] = *source - source[-1];
    if (known >= 0) model->step[1] = *source - known;
    if (place < PLACES) model->beside[place] = *source;
    return 1;
}

static int code_branch_numbers(ath_coder *coder, hierarchy_model *model, int32_t count, int32_t *source)
{
    permutation_model *own = &model->branch_source;
    int regular = 1;
    if (ENCODING)
        for (int32_t b = 0; b < count; b++) regular = regular && source[b] == b;
    regular = !coder_bit(coder, &own->permuted, !regular);
    for (int32_t b = 0; b < count; b++) {
        if (regular)
            source[b] = b;
        else if (!code_source_number(coder, own, 0, b, count, source + b))
            return 0;
    }
    return 1;
}

/* Where each stem starts in a source that is sorted by branch; `subtree` of the branches serves as memory. */
static void expect_starts(ath_branch *branches, int32_t branch_count, const int32_t *branch_source)
{
    int32_t start = 0;
    for (int32_t b = 0; b < branch_count; b++) branches[b].subtree = 0;
    for (int32_t b = 0; b < branch_count; b++) branches[branch_source[b]].subtree = branches[b].count;
    for (int32_t b = 0; b < branch_count; b++) {
        int32_t count = branches[b].subtree;
        branches[b].subtree = start;
        start += count;
    }
}

static int code_vertex_numbers(ath_coder *coder, hierarchy_model *model, ath_branch *branches, int32_t branch_count,
                               int32_t vertex_count, const int32_t *branch_source, int32_t *source)
{
    permutation_model *own = &model->vertex_source;
    int regular = 1;
    expect_starts(branches, branch_count, branch_source);
    if (ENCODING)
        for (int32_t b = 0; b < branch_count; b++)
            for (int32_t i = 0; i < branches[b].count; i++)
                regular = regular && source[branches[b].first + i] == branches[branch_source[b]].subtree + i;
    regular = !coder_bit(coder, &own->permuted, !regular);
    for (int32_t b = 0; b < branch_count; b++) {
        int32_t start = branches[branch_source[b]].subtree, *entry = source + branches[b].first;
        if (start + branches[b].count > vertex_count) return 0; /* branch_source is no permutation */
        for (int32_t i = 0; i < branches[b].count; i++) {
            if (regular)
                entry[i] = start + i;
            else if (!code_source_number(coder, own, start, i, vertex_count, entry + i))
                return 0;
        }
    }
    return 1;
}

/* A number that most branches have none of, each expected to be that of the last branch of such a lag. */
static int code_of_branches(ath_coder *coder, branch_number_model *model, int32_t branch_count, ath_branch *branches,
                            int32_t *number, int32_t most)
{
    size_t stride = sizeof *branches / sizeof *number;
    int32_t any = 0, last[16] = {0};
    for (int32_t b = 0; ENCODING && b < branch_count; b++) any |= number[(size_t)b * stride] != 0;
    any = coder_bit(coder, &model->any, any);
    for (int32_t b = 0; b < branch_count; b++) {
        int32_t *own = number + (size_t)b * stride, *expected = last + ath_min(branches[b].lag, 15);
        if (any) *expected += code_signed(coder, &model->difference, 0, ENCODING ? *own - *expected : 0);
        if (*expected < 0 || *expected > most) return 0;
        *own = *expected;
    }
    return 1;
}

static int code_hierarchy(ath_coder *coder, hierarchy_model *model, int32_t branch_count, int32_t vertex_count,
                          ath_branch *branches, int32_t *branch_source, int32_t *vertex_source)
{
    int32_t last_up = 0, left = vertex_count;
    uint32_t mean_attach = 64, mean_count[16];
    hierarchy_model_init(model);
    for (int32_t i = 0; i < 16; i++) mean_count[i] = 128;
    for (int32_t b = 0; b < branch_count; b++) {
        if (!code_branch(coder, model, branches, b, left, &last_up, mean_count)) return 0;
        left -= branches[b].count;
        branches[b].subtree = 0;
    }
    if (left != 0) return 0;
    for (int32_t b = 0; b < branch_count; b++) {
        if (branches[b].parent < 0)
            branches[b].attach = -1;
        else if (!code_attach(coder, model, branches, b, &mean_attach))
            return 0;
    }
    return code_of_branches(coder, &model->rigid, branch_count, branches, &branches->rigid, MOST_LAYERS)
           && code_of_branches(coder, &model->detail, branch_count, branches, &branches->detail, MOST_DETAIL)
           && code_of_branches(coder, &model->ring, branch_count, branches, &branches->ring, MOST_RING)
           && code_branch_numbers(coder, model, branch_count, branch_source)
           && code_vertex_numbers(coder, model, branches, branch_count, vertex_count, branch_source, vertex_source);
}

/* ---- rest pose ---- */

enum { OF_COPY = -2 }; /* in place of the vertex that one was seen from */
enum { REST_RUN = 32, REST_BASES = REST_RUN * (REST_RUN + 1) * (2 * REST_RUN + 1) / 6 };

/* The rest pose of the layer before, which a refinement is coded about: positions, and integers, three for each vertex; those of
 * a run's modes stand with its vertices. */
typedef struct {
    const int32_t *coarse; /* null: nothing is known */
    const double *before;
    int32_t *steps; /* filled for the next layer; may be null */
    ath_mesh *mesh; /* null: not connected; else it gives the order */
    /* An encoder's: how far from its place it may put a vertex to save bits; a copy of the source's pose, in which what
     * has detail goes along with what it hangs on. */
    double slack, *moved;
    /* Likewise: of each branch the one that it is a copy of, itself where others are copies of it, -1: neither. */
    const int32_t *shape_of;
} rest_layer;

typedef struct {
    lattice_model lattice;
    rest_predictor predictor, connected;
} rest_vertices;

typedef struct {
    number_model bent; /* of the vertices of SOURCE_REST */
    uint32_t bent_mean[3];
    union {
        coefficient_model modes;
        refinement_model refined_modes;
    };
    uint32_t history[HISTORY_ROWS * REST_RUN];
    double bases[REST_BASES]; /* of runs of 1, 2, ... REST_RUN vertices, each made when it is first needed */
    double work[2 * REST_RUN * REST_RUN];
    uint8_t made[REST_RUN + 1];
    rest_vertices single[2]; /* of branches without detail, and with it */
    copy_model copies;
} rest_model;

static void rest_model_init(rest_model *model, int is_refinement)
{
    number_model_init(&model->bent);
    for (int32_t k = 0; k < 3; k++) model->bent_mean[k] = 64;
    if (is_refinement)
        refinement_model_init(&model->refined_modes, REST_RUN, model->history);
    else
        coefficient_model_init(&model->modes, REST_RUN, model->history);
    memset(model->made, 0, sizeof model->made);
    for (int32_t i = 0; i < 2; i++) {
        lattice_model_init(&model->single[i].lattice);
        rest_predictor_init(&model->single[i].predictor);
        rest_connected_init(&model->single[i].connected);
    }
    copy_model_init(&model->copies);
}

/* The step of a branch's rest pose, where `step` is that of others. */
static double rest_step(const ath_branch *branch, double step)
{
    double most = branch->detail > 0 ? ath_node_step(branch->detail - WHOLE_DETAIL) : step;
    return most < step ? most : step;
}

/* Where vertex i of a stem is expected: the last step, or the one `lag` vertices ago, is taken again. */
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

static rest_vertices *single_of(rest_model *model, const ath_branch *branch)
{
    return model->single + (branch->detail > 0);
}

/* A point of the lattice, of about the size of the last ones, of all and of those of the phase. */
static void code_rest_point(ath_coder *coder, lattice_model *lattice, const rest_memory *all, const rest_memory *phase,
                            int32_t integers[3])
{
    const uint32_t *mean = all->mean, *own = phase->mean;
    for (int32_t k = 0; k < 3; k++) {
        int32_t about = (number_class((mean[k] + mean[0] + mean[1] + mean[2]) / 4)
                         + number_class((own[k] + own[0] + own[1] + own[2]) / 4) + 1)
                        / 2;
        integers[k] = code_integer(coder, lattice, parity_of(integers, k), about, 0, integers[k]);
    }
}

/* A vertex of a branch as a point of a lattice about where it is expected; what has detail has no slack. */
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

/* Vertex i of a stem, by those before it on the stem. */
static void code_single_vertex(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branch,
                               int32_t i, double step, const double *source, double *rest)
{
    rest_predictor *predictor = &single_of(model, branch)->predictor;
    double unit = LATTICE_UNIT * step;
    rest_guess at;
    rest_look_around(predictor, branch, rest, layer->before, i, 1.0 / unit, &at);
    code_expected_vertex(coder, model, layer, branch, predictor, &at, branch->first + i, unit, source, rest);
}

/* A branch as a copy of the shape used last; `place`: what an encoder has chosen. */
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

/* An encoder's choice: is branch b a copy of a shape, and which one, by `rank` among those of as many vertices? */
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

/* What branch b is: a copy, which is coded at once, a shape, or neither. -1: not valid. */
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

static void steps_of_run(int32_t n, const double *basis, double step, double half, const double base[3],
                         const double *run, int32_t *row)
{
    for (int32_t k = 0; k < 3; k++)
        for (int32_t m = 0; m < n; m++) {
            double sum = 0.0;
            for (int32_t i = 0; i < n; i++) sum = sum + basis[m * n + i] * (run[3 * i + k] - base[k]);
            row[k * REST_RUN + m] = steps_in(sum, step, half);
        }
}

static void refine_rest_row(ath_coder *coder, rest_model *model, const rest_layer *layer, int32_t first, int32_t n,
                            const double *basis, double step, const double base[3], int32_t *row)
{
    int32_t predicted[3 * REST_RUN] = {0}, known[3 * REST_RUN] = {0};
    row_prediction prediction = {predicted, known, 0, REST_RUN, {1, 1, 1}};
    steps_of_run(n, basis, step, 0.5, base, layer->before + 3 * (size_t)first, predicted);
    for (int32_t i = 0; i < 3 * n; i++) {
        int32_t at = i / n * REST_RUN + i % n;
        known[at] = layer->coarse[3 * (size_t)first + (size_t)i];
        if (known[at] == 0) predicted[at] = 0;
    }
    code_refined_row(coder, &model->refined_modes, n, 0, -1, &prediction, row);
}

/* `n` vertices of a beam from `first` on, by the modes of a beam that hangs on `base`. */
static void code_rest_run(ath_coder *coder, rest_model *model, const rest_layer *layer, int32_t first, int32_t n,
                          const double base[3], double step, const double *source, double *rest)
{
    int32_t row[3 * REST_RUN] = {0};
    const double *basis = rest_basis(model, n);
    double *run = rest + 3 * (size_t)first;
    if (ENCODING) steps_of_run(n, basis, step, 0.55, base, source + 3 * (size_t)first, row);
    if (layer->coarse)
        refine_rest_row(coder, model, layer, first, n, basis, step, base, row);
    else
        code_row(coder, &model->modes, REST_RUN, n, 0, -1, row);
    for (int32_t i = 0; layer->steps && i < 3 * n; i++)
        layer->steps[3 * (size_t)first + (size_t)i] = row[i / n * REST_RUN + i % n];
    for (int32_t i = 0; i < n; i++)
        for (int32_t k = 0; k < 3; k++) {
            double sum = 0.0;
            for (int32_t m = 0; m < n; m++) sum = sum + basis[m * n + i] * (double)row[k * REST_RUN + m];
            run[3 * i + k] = base[k] + sum * step;
        }
}

/* A beam is cut into runs of like length, each of which hangs on the vertex before it. */
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

/* That of a vertex, of branches in the order of their vertices. */
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

/* Are all vertices of a branch, of which `v` comes first, to be coded from place t of the mesh's order on? */
static int is_untouched(const ath_mesh *mesh, const ath_branch *branch, int32_t v, int32_t t)
{
    if (v != branch->first) return 0;
    for (int32_t i = 1; i < branch->count; i++)
        if (mesh->rank[v + i] < t) return 0;
    return 1;
}

/* Vertices in the order of their mesh, by their neighbours; those without as elsewhere: all below them are known. */
static int code_connected_rest(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branches,
                               int32_t branch_count, int has_copies, double step, const double *source, double *rest)
{
    ath_mesh *mesh = layer->mesh;
    int32_t shape = -1; /* the last branch that is one */
    for (int32_t v = 0; v < mesh->vertex_count; v++) mesh->from[v] = -1;
    for (int32_t t = 0; t < mesh->vertex_count; t++) {
        int32_t v = mesh->order[t];
        if (mesh->from[v] == OF_COPY) continue;
        const ath_branch *branch = branch_of(branches, branch_count, v);
        rest_predictor *predictor = &single_of(model, branch)->connected;
        double step_here = rest_step(branch, step);
        rest_ring ring;
        rest_guess at;
        rest_ring_of(mesh, rest, v, &ring);
        if (has_copies && ring.base < 0 && is_untouched(mesh, branch, v, t)) {
            int32_t b = (int32_t)(branch - branches);
            int32_t role = code_part(coder, model, layer, branches, b, step_here, source, rest);
            if (role < 0) return 0;
            if (role == SHAPE_PART) shape = b;
            for (int32_t i = 0; role == COPY_PART && i < branch->count; i++) mesh->from[v + i] = OF_COPY;
            if (role == COPY_PART) continue;
        }
        if (branch == branches + shape) step_here = SHAPE_FINER * step_here;
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

/* What has detail keeps its shape: it goes where the stem is that it hangs on, of less detail, and with it what hangs
 * on it in turn. */
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

static int code_rest(ath_coder *coder, rest_model *model, const rest_layer *layer, const ath_branch *branches,
                     int32_t branch_count, double step, const double *source, double *rest)
{
    int has_copies = !layer->coarse;
    rest_model_init(model, layer->coarse != 0);
    if (has_copies) has_copies = coder_bit(coder, &model->copies.any, layer->shape_of != 0);
    if (layer->mesh)
        return code_connected_rest(coder, model, layer, branches, branch_count, has_copies, step, source, rest);
    for (int32_t b = 0; b < branch_count && !model->modes.invalid; b++) {
        double own = rest_step(branches + b, step);
        if (ENCODING) take_along(branches, branches + b, source, layer->moved, rest);
        int32_t role = PLAIN_PART;
        if (has_copies) role = code_part(coder, model, layer, branches, b, own, layer->moved, rest);
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

/* ---- rest pose of the source, about the reference pose ---- */

/* The poses less the origin; turns: of each branch the rotation that takes it from the one to the other. */
typedef struct {
    const double *reference, *source;
    double *moved; /* as rest_layer has it */
    double *rest, *turns;
    double step;
} bent_pose;

/* The rotation of what hangs on vertex v of a stem, whose vertices up to `last` are placed. */
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
    ath_follow_tangent(tangent, pose->rest + 3 * (size_t)before, pose->rest + 3 * (size_t)after, turned, turned);
}

/* Vertex v as steps from where the one before it, turned with the stem, lets it be expected; before: -1, none. */
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

/* A stem that is no beam turns as its vertices so far did, the last ones above all. */
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

/* `n` vertices of a beam from `first` on, by the modes of a beam that leaves `before` in any direction. */
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
    if (ENCODING) steps_of_run(n, basis, pose->step, 0.55, nothing, local, row);
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

/* ---- exact rest pose, times ---- */

/* The vertices of a connected pose in the order of their mesh: the mean of its parallelograms, or else of its
 * neighbours, is expected; without any, what is elsewhere. */
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

/* mesh: null, or of a connected pose. */
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

static int code_times(ath_coder *coder, exact_model *model, int32_t frame_count, double *times)
{
    int32_t length = 0;
    exact_model_init(model);
    for (int32_t i = 0; i < frame_count; i++) {
        double predicted = i > 0 ? times[i - 1] : 0.0;
        if (i > 1) predicted = predicted + (times[i - 1] - times[i - 2]);
        if (!code_exact(coder, model, 1, predicted, &length, times + i)) return 0;
    }
    return 1;
}

/* ---- learned temporal basis ---- */

static int code_temporal(ath_coder *coder, number_model *model, int32_t rank, int32_t frames, int32_t *basis)
{
    number_model_init(model);
    for (int32_t r = 0; r < rank; r++) {
        uint32_t mean = 1024;
        int32_t before = 0, slope = 0;
        for (int32_t t = 0; t < frames; t++) {
            int32_t *value = basis + (size_t)r * (size_t)frames + t;
            int32_t rest = code_signed(coder, model, mean, ENCODING ? *value - before - slope : 0);
            *value = before + slope + rest;
            if (!ENCODING && (*value < -ATH_MOST_SAMPLE || *value > ATH_MOST_SAMPLE)) return 0;
            slope = t > 0 ? *value - before : 0;
            before = *value;
            mean = averaged(mean, rest);
        }
    }
    return 1;
}

#endif
