/* From branches to pieces and nodes: cuts stems, attaches pieces, assigns them to the streams of stages. */
#include "model/plan.h"

/* Smallest second moment that counts as a direction, relative to the largest. */
#define RANK_TOLERANCE 1e-4

static int32_t divide_up(int32_t a, int32_t b) { return (a + b - 1) / b; }

/* Pieces consist of whole rings. On a stem without rings, every vertex counts as a ring. */
static int32_t pieces_of(const ath_branch *branch)
{
    int32_t ring = ath_max(branch->ring, 1);
    return divide_up(divide_up(branch->count, ring), ATH_PIECE_VERTICES / ring);
}

int32_t ath_count_pieces(ath_branch *branches, int32_t branch_count, int32_t vertex_count)
{
    int32_t total = 0, next = 0;
    for (int32_t b = 0; b < branch_count; b++) {
        ath_branch *branch = branches + b;
        if (branch->parent >= b || branch->parent < -1 || branch->count < 1 || branch->count > vertex_count - next)
            return 0;
        branch->first = next;
        branch->subtree = 1;
        branch->depth = 0;
        if (branch->parent >= 0) {
            const ath_branch *parent = branches + branch->parent;
            branch->depth = parent->depth + 1;
            if (branch->attach < parent->first || branch->attach >= parent->first + parent->count) return 0;
        } else if (branch->attach != -1) {
            return 0;
        }
        next += branch->count;
        total += pieces_of(branch);
    }
    for (int32_t b = branch_count - 1; b > 0; b--)
        if (branches[b].parent >= 0) branches[branches[b].parent].subtree += branches[b].subtree;
    for (int32_t b = 1; b < branch_count; b++) { /* depth-first order: a branch lies inside its parent's subtree */
        int32_t parent = branches[b].parent;
        if (parent >= 0 && b + branches[b].subtree > parent + branches[parent].subtree) return 0;
    }
    return next == vertex_count ? total : 0;
}

/* Returns the branch of the next node: a leaf of the ATH takes its whole subtree. */
static int32_t next_node(const ath_branch *branches, int32_t b)
{
    return branches[b].flags & ATH_WHOLE ? b + branches[b].subtree : b + 1;
}

int32_t ath_count_nodes(const ath_branch *branches, int32_t branch_count)
{
    int32_t count = 0;
    for (int32_t b = 0; b < branch_count; b = next_node(branches, b)) count++;
    return count;
}

static int32_t subtree_vertices(const ath_branch *branches, int32_t b)
{
    const ath_branch *last = branches + b + branches[b].subtree - 1;
    return last->first + last->count - branches[b].first;
}

static void split_branch(const ath_branch *branches, int32_t b, ath_piece *pieces, int32_t next,
                         int32_t *piece_of_vertex)
{
    const ath_branch *branch = branches + b;
    int32_t parts = pieces_of(branch), ring = ath_max(branch->ring, 1), rings = divide_up(branch->count, ring);
    for (int32_t j = 0; j < parts; j++) {
        ath_piece *piece = pieces + next + j;
        int32_t from = ring * (int32_t)((int64_t)rings * j / parts);
        int32_t to = ath_min(ring * (int32_t)((int64_t)rings * (j + 1) / parts), branch->count);
        memset(piece, 0, sizeof *piece);
        piece->first = branch->first + from;
        piece->count = to - from;
        piece->attach = j == 0 ? branch->attach : piece->first - 1;
        piece->parent = piece->attach < 0 ? -1 : piece_of_vertex[piece->attach];
        piece->branch = b;
        piece->flags = j == 0 ? branch->flags : branch->flags & ~ATH_LOOSE;
        piece->ring = branch->ring;
        piece->rank = piece->count;
        piece->low_stage = -1;
        piece->attach_cache = piece->last_attached = -1;
        for (int32_t v = piece->first; v < piece->first + piece->count; v++) piece_of_vertex[v] = next + j;
    }
}

/* Places attach caches on a stack, since in depth-first order those on top are done with first. A cache is freed when
 * the last piece has been attached to it, before that piece gets its own: a long chain never holds more than one. */
static void place_attach_caches(ath_plan *plan, ath_piece *pieces, int32_t *stack, int keep)
{
    int64_t used = 0;
    int32_t height = 0;
    plan->attach_cache_rows = 0;
    plan->longest = 0;
    for (int32_t p = 0; p < plan->piece_count; p++) plan->longest = ath_max(plan->longest, pieces[p].count);
    for (int32_t p = 0; p < plan->piece_count; p++)
        if (pieces[p].parent >= 0) {
            ath_piece *parent = pieces + pieces[p].parent;
            uint64_t vertex = (uint64_t)1 << (pieces[p].attach - parent->first);
            parent->attached |= vertex >> 1 | vertex | vertex << 1; /* The neighbours give the tangent. */
            parent->last_attached = p;
        }
    for (int32_t p = 0; p < plan->piece_count; p++) {
        while (!keep && height > 0 && pieces[stack[height - 1]].last_attached <= p)
            used = pieces[stack[--height]].attach_cache;
        if (pieces[p].last_attached < 0) continue;
        stack[height++] = p;
        pieces[p].attach_cache = used;
        used += pieces[p].count + ATH_ATTACH_CACHE_FRAMES;
        if (used > plan->attach_cache_rows) plan->attach_cache_rows = used;
    }
}

/* A leaf that is one short stem needs no map of its own: its first modes come with its node's stage. */
static void plan_node(const ath_plan *plan, ath_piece *pieces, ath_node *node, int32_t b, int32_t piece)
{
    const ath_branch *branch = plan->branches + b;
    memset(node, 0, sizeof *node);
    node->branch = b;
    node->piece = piece;
    node->first = branch->first;
    node->count = subtree_vertices(plan->branches, b);
    node->stage = branch->depth;
    node->last_stage = branch->flags & ATH_WHOLE ? plan->height : branch->depth;
    node->coded = branch->subtree > 1 || pieces_of(branch) > 1;
    if (!node->coded) {
        pieces[piece].low_stage = node->stage;
        pieces[piece].low_modes = branch->ring > 0 ? ath_min(ath_rings(pieces + piece), 2)
                                                   : ath_min(branch->count, branch->flags & ATH_SHEET ? 3 : 2);
    }
}

void ath_build_plan(ath_plan *plan, ath_piece *pieces, ath_node *nodes, int32_t *memory, int keep)
{
    const ath_branch *branches = plan->branches;
    int32_t next_piece = 0, node = 0, following = 0;
    plan->height = 0;
    for (int32_t b = 0; b < plan->branch_count; b = next_node(branches, b))
        plan->height = ath_max(plan->height, branches[b].depth);
    for (int32_t b = 0; b < plan->branch_count; b++) {
        int32_t parts = pieces_of(branches + b), stage = plan->height + 1;
        split_branch(branches, b, pieces, next_piece, memory);
        if (b == following) {
            plan_node(plan, pieces, nodes + node++, b, next_piece);
            following = next_node(branches, b);
            if (!(branches[b].flags & ATH_WHOLE)) stage = branches[b].depth + 1;
        }
        for (int32_t j = 0; j < parts; j++) pieces[next_piece + j].stage = stage;
        next_piece += parts;
    }
    place_attach_caches(plan, pieces, memory, keep);
}

void ath_plan_rigid(const ath_plan *plan, ath_piece *pieces, int32_t layer)
{
    for (ath_piece *piece = pieces; piece < pieces + plan->piece_count; piece++) {
        piece->flags &= ~ATH_RIGID;
        if (plan->branches[piece->branch].rigid > layer) piece->flags |= ATH_RIGID;
    }
}

/* Fills functionals w_0, w_1, w_2 with mean(w_i(d) w_j(d)) = (i == j) over the vertices of the subtree, d = x0 - a.
 * Axes are orthonormalised under the second moments, the longest remainder first, without directions of no extent. */
static void whiten(const ath_plan *plan, ath_node *node)
{
    const double *a = ath_rest_attach(plan, plan->pieces + node->piece);
    double moment[9] = {0}, largest = 0.0;
    int used[3] = {0, 0, 0};
    for (int32_t v = node->first; v < node->first + node->count; v++) {
        const double *x0 = ath_rest_of(plan, v);
        for (int32_t i = 0; i < 3; i++)
            for (int32_t j = 0; j < 3; j++) moment[3 * i + j] = moment[3 * i + j] + (x0[i] - a[i]) * (x0[j] - a[j]);
    }
    for (int32_t i = 0; i < 9; i++) moment[i] = moment[i] / (double)node->count;
    for (node->rank = 0; node->rank < 3; node->rank++) {
        double best_w[3] = {0.0, 0.0, 0.0}, best = 0.0;
        int32_t best_axis = -1;
        for (int32_t axis = 0; axis < 3; axis++) {
            if (used[axis]) continue;
            double w[3] = {0.0, 0.0, 0.0}, left = moment[4 * axis];
            w[axis] = 1.0;
            for (int32_t r = 0; r < node->rank; r++) {
                const double *earlier = node->whitening + 3 * r;
                double shared =
                    earlier[0] * moment[axis] + earlier[1] * moment[3 + axis] + earlier[2] * moment[6 + axis];
                left = left - shared * shared;
                for (int32_t k = 0; k < 3; k++) w[k] = w[k] - shared * earlier[k];
            }
            if (left > best) {
                best = left;
                best_axis = axis;
                for (int32_t k = 0; k < 3; k++) best_w[k] = w[k];
            }
        }
        if (node->rank == 0) largest = best;
        if (best_axis < 0 || !(best > largest * RANK_TOLERANCE)) break;
        used[best_axis] = 1;
        for (int32_t k = 0; k < 3; k++) node->whitening[3 * node->rank + k] = best_w[k] / ath_sqrt(best);
    }
}

void ath_without_stems(const ath_plan *plan, ath_piece *pieces, ath_node *nodes)
{
    for (int32_t n = 0; n < plan->node_count; n++) nodes[n].coded = 1;
    for (int32_t p = 0; p < plan->piece_count; p++) {
        pieces[p].low_stage = -1;
        pieces[p].low_modes = 0;
    }
}

void ath_plan_nodes(const ath_plan *plan, ath_node *nodes, int32_t low_stage, int32_t high_stage)
{
    for (int32_t n = 0; n < plan->node_count; n++) {
        if (nodes[n].stage < low_stage || nodes[n].stage > high_stage) continue;
        memset(nodes[n].whitening, 0, sizeof nodes[n].whitening);
        whiten(plan, nodes + n);
    }
}
