/* The plan that all segments share (FORMAT.md, "Plan"): pieces of branches, nodes, the rest pose, its bases. */
#ifndef ATH_MODEL_PLAN_H
#define ATH_MODEL_PLAN_H

#include "bits/format.h"

enum { ATH_RIGID = 16 }; /* flag of a piece that turns and moves without bending */

/* A run of at most ATH_PIECE_VERTICES vertices of one stem, with one spatial basis. The first piece of a branch hangs
 * on the parent's stem, the others on the last vertex of the piece before. */
typedef struct ath_piece {
    int64_t modes;        /* offset of its cantilever modes in the bases */
    int64_t basis;        /* offset of its basis in the bases: `rank` rows of `count` */
    int64_t attach_cache; /* place, in vertices, of its frames for the pieces that hang on it; -1: none does */
    uint64_t attached;    /* bit v: its frames need vertex v where pieces hang on it */
    int32_t first, count; /* vertices */
    int32_t parent;       /* piece, -1 for a root */
    int32_t attach;       /* vertex, -1 for a root */
    int32_t branch;
    int32_t flags;
    int32_t rank;
    int32_t stage;     /* stage whose stream completes it */
    int32_t low_stage; /* stage whose stream holds its tracks and first modes, -1 when `stage` does */
    int32_t low_modes;
    int32_t last_attached; /* last piece that hangs on it, -1: none */
    int32_t ring;          /* vertices of each of its rings, 0: it has none */
    int32_t modes_stage;   /* first stage that takes its modes; -1: an earlier piece has the same */
    int32_t tip_weight;    /* weight of its last vertex in products of its modes, which are orthonormal under it */
} ath_piece;

/* A node of the ATH: the subtree of a branch, moved by one affine map per frame at stages `stage` to `last_stage`. */
typedef struct ath_node {
    double whitening[9]; /* rows: functionals that are orthonormal over the subtree's rest vertices */
    int32_t branch, piece;
    int32_t first, count; /* vertices of the subtree */
    int32_t stage, last_stage;
    int32_t coded; /* 1: its map has a stream of its own; 0: it follows from the stem's first modes */
    int32_t rank;  /* dimensions that the rest vertices span about the attach point */
} ath_node;

typedef struct ath_plan {
    int32_t vertex_count, branch_count, piece_count, node_count;
    int64_t attach_cache_rows; /* memory of all attach caches, in vertices */
    int32_t height;            /* deepest node: stages run from 0 to height + 1 */
    int32_t longest;           /* vertices of the longest piece */
    const ath_branch *branches;
    const ath_piece *pieces;
    const ath_node *nodes;
    const double *rest; /* vertex_count x 3, relative to the origin */
    const double *bases;
} ath_plan;

/* Vertices whose place an attach point and a rotation take at the end of an attach cache. */
enum { ATH_ATTACH_CACHE_FRAMES = 4 };

/* Completes first, subtree and depth of the branches. Returns the number of pieces; 0: the hierarchy is not valid. */
ATH_ENCODER_API int32_t ath_count_pieces(ath_branch *branches, int32_t branch_count, int32_t vertex_count);
ATH_ENCODER_API int32_t ath_count_nodes(const ath_branch *branches, int32_t branch_count);

/* Fills pieces and nodes, and height, longest and attach_cache_rows of a plan whose branches and counts are set. If
 * `keep` is 1, attach caches last for the whole pass over the pieces, else until the last piece that hangs on them has
 * been attached. memory: vertex_count, scratch. */
ATH_ENCODER_API void ath_build_plan(ath_plan *plan, ath_piece *pieces, ath_node *nodes, int32_t *memory, int keep);

/* Marks the pieces of branches that are rigid in a layer. */
ATH_ENCODER_API void ath_plan_rigid(const ath_plan *plan, ath_piece *pieces, int32_t layer);

/* Adapts a plan to predicted motion: every node's map is coded, and no piece begins at the stages of nodes. */
ATH_ENCODER_API void ath_without_stems(const ath_plan *plan, ath_piece *pieces, ath_node *nodes);

/* Completes the nodes once the rest pose is known. */
ATH_ENCODER_API void ath_plan_nodes(const ath_plan *plan, ath_node *nodes, int32_t low_stage, int32_t high_stage);

ATH_INLINE const double *ath_rest_of(const ath_plan *plan, int32_t vertex) { return plan->rest + 3 * (size_t)vertex; }

/* Returns the rest position of the point that a piece hangs on. */
ATH_INLINE const double *ath_rest_attach(const ath_plan *plan, const ath_piece *piece)
{
    return ath_rest_of(plan, piece->attach >= 0 ? piece->attach : piece->first);
}

ATH_INLINE int ath_is_shown(const ath_node *node, int32_t stage)
{
    return node->stage <= stage && stage <= node->last_stage;
}

ATH_INLINE int32_t ath_base_stage(const ath_piece *piece)
{
    return piece->low_stage >= 0 ? piece->low_stage : piece->stage;
}

/* Returns how many modes move a piece. */
ATH_INLINE int32_t ath_rank(const ath_piece *piece) { return piece->flags & ATH_RIGID ? 0 : piece->rank; }

/* Returns the rings of a piece that has some. The last one may lack vertices. */
ATH_INLINE int32_t ath_rings(const ath_piece *piece) { return (piece->count + piece->ring - 1) / piece->ring; }
ATH_INLINE int ath_has_shift(const ath_piece *piece) { return piece->parent < 0 || (piece->flags & ATH_LOOSE); }

#endif
