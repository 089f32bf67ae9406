/* The stream of branches: parents, vertices, and their numbers in the source (FORMAT.md, "HIERARCHY"). Compiled once
 * for each direction, which ENCODING tells: a value handed to a coding function is ignored when decoding. Functions
 * return 0 when what they decoded is not valid. */
#ifndef ATH_STREAMS_HIERARCHY_INL
#define ATH_STREAMS_HIERARCHY_INL

#include "bits/format.h"
#include "bits/numbers.inl"

enum { PLACES = 256, MOST_DETAIL = 255, MOST_RING = 32 };

/* Model of a permutation. A number is expected one step after the number before it, or else one step after the number
 * at the same place of an earlier run, as in a source that holds all first vertices, then all second ones. */
typedef struct {
    number_model difference;
    ath_context permuted,
        expected[2][2][3]; /* index: expectation, whether a run begins, which expectation was right before (2: none) */
    int32_t beside[PLACES], step[2], last; /* beside: the last number at each place of a run; -1: none */
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
    ath_context flag[4][2];
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
    for (int32_t i = 0; i < 4; i++)
        for (int32_t j = 0; j < 2; j++) context_init(&model->flag[i][j], 16384);
}

static int32_t code_flags(ath_coder *coder, hierarchy_model *model, int32_t before, int32_t flags)
{
    int32_t coded = 0;
    for (int32_t i = 0; i < 4; i++) coded |= coder_bit(coder, &model->flag[i][before >> i & 1], flags >> i & 1) << i;
    return coded;
}

/* Codes how far up from branch b - 1 the parent of b lies: 0 for a child of b - 1, its depth + 1 for a root. Returns
 * the parent; -2: it lies beyond a root. */
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
    if (branch->lag < 0 || branch->lag > 65535) return 0;
    branch->first = before->first + before->count;
    return 1;
}

/* Codes an attach point relative to that of the sibling before, which the parent's `subtree` holds meanwhile. */
static int code_attach(ath_coder *coder, hierarchy_model *model, ath_branch *branches, int32_t b, uint32_t *mean)
{
    ath_branch *branch = branches + b, *parent = branches + branch->parent;
    int32_t step = code_signed(coder, &model->attach, *mean, branch->attach - parent->first - parent->subtree);
    int32_t place = parent->subtree + step;
    if (place < 0 || place >= parent->count) return 0;
    branch->attach = parent->first + place;
    parent->subtree = place;
    *mean = averaged(*mean, step);
    return 1;
}

/* Codes the number at `place` of a run that is expected to begin with `start`. `source` points to it in the run. */
static int code_source_number(ath_coder *coder, permutation_model *model, int32_t start, int32_t place, int32_t count,
                              int32_t *source)
{
    int32_t known = place < PLACES ? model->beside[place] : -1, right = 2;
    int64_t given = ENCODING ? *source : 0, value; /* not initialised when decoding */
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

/* Leaves in `subtree` where each stem starts in a source that is sorted by branch. */
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

/* Codes a number per branch, which is mostly 0, about that of the last branch with the same lag. */
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
    return code_of_branches(coder, &model->rigid, branch_count, branches, &branches->rigid, ATH_LAYERS)
           && code_of_branches(coder, &model->detail, branch_count, branches, &branches->detail, MOST_DETAIL)
           && code_of_branches(coder, &model->ring, branch_count, branches, &branches->ring, MOST_RING)
           && code_branch_numbers(coder, model, branch_count, branch_source)
           && code_vertex_numbers(coder, model, branches, branch_count, vertex_count, branch_source, vertex_source);
}

#endif
