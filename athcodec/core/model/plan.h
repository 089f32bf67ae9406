/* What all segments share (FORMAT.md, "Plan"): branches cut into pieces, nodes, the rest pose and its bases. */
#ifndef ATH_PLAN_H
#define ATH_PLAN_H

#include "bits/internal.h"

enum { ATH_RIGID = 8 }; /* of a piece: it turns and moves as it is */

/* A run of at most ATH_PIECE_VERTICES vertices of one stem, with one spatial basis. The first piece of a branch hangs
 * on the parent's stem, the others on the last vertex of the piece before. */
typedef struct ath_piece {
    int64_t modes;        /* its cantilever modes in the bases */
    int64_t basis;        /* its basis: `rank` rows of `count` */
    int64_t attach_cache; /* where its frames are kept for the pieces that hang on it, in vertices; -1: none does */
    int32_t first, count; /* vertices */
    int32_t parent;       /* piece, -1 for a root */
    int32_t attach;       /* vertex, -1 for a root */
    int32_t branch;
    int32_t flags;
    int32_t rank;
    int32_t level;     /* whose stream completes it */
    int32_t low_level; /* whose stream holds its tracks and first modes, -1 when `level` does */
    int32_t low_modes;
    int32_t last_attached; /* last piece that hangs on it, -1: none */
    int32_t ring;          /* vertices of each of its rings, 0: it has none */
} ath_piece;

/* A node of the ATH: the subtree of a branch, moved by one affine map per frame at levels `level` to `last`. */
typedef struct ath_node {
    double whitening[9]; /* rows: functionals that are orthonormal over the subtree's rest vertices */
    int32_t branch, piece;
    int32_t first, count; /* vertices of the subtree */
    int32_t level, last;
    int32_t coded; /* 1: its map has a stream of its own; 0: it follows from the stem's first modes */
    int32_t rank;  /* of the rest vertices about the attach point */
} ath_node;

typedef struct ath_plan {
    int32_t vertex_count, branch_count, piece_count, node_count;
    int64_t attach_cache_rows; /* memory of all attach caches, in vertices */
    int32_t height;            /* deepest node: levels run from 0 to height + 1 */
    int32_t longest;           /* vertices of the longest piece */
    const ath_branch *branches;
    const ath_piece *pieces;
    const ath_node *nodes;
    const double *rest; /* vertex_count x 3, relative to the origin */
    const double *bases;
} ath_plan;

/* The frames of an attach cache, an attach point and a rotation, take the place of four vertices. */
enum { ATH_ATTACH_CACHE_FRAMES = 4 };

/* Completes first, subtree and depth of the branches and counts their pieces; 0 when they are no valid hierarchy. */
ATH_ENCODER_API int32_t ath_count_pieces(ath_branch *branches, int32_t branch_count, int32_t vertex_count);
ATH_ENCODER_API int32_t ath_count_nodes(const ath_branch *branches, int32_t branch_count);

/* Fills pieces and nodes, and height, longest and attach_cache_rows of `plan`, whose branches and counts are set.
 * Attach caches are kept for the whole pass over the pieces (keep), or until the last piece that hangs on them has
 * been attached. `memory`: scratch, vertex_count. */
ATH_ENCODER_API void ath_build_plan(ath_plan *plan, ath_piece *pieces, ath_node *nodes, int32_t *memory, int keep);

/* Marks the pieces of branches that are rigid in a layer. */
ATH_ENCODER_API void ath_plan_rigid(const ath_plan *plan, ath_piece *pieces, int32_t layer);

/* Of predicted motion, whose levels have maps of nodes alone, all of them coded: no piece begins at their levels. */
ATH_ENCODER_API void ath_without_stems(const ath_plan *plan, ath_piece *pieces, ath_node *nodes);

/* Doubles that the bases need; fills the pieces' offsets. gaps: vertex_count bytes; table: ath_basis_table_size. */
ATH_ENCODER_API size_t ath_basis_table_size(int32_t piece_count);
ATH_ENCODER_API int64_t ath_basis_layout(ath_piece *pieces, int32_t piece_count, const double *rest, uint8_t *gaps,
                                         int32_t *table);
/* What the last vertex of a piece counts in the products of its modes, which are orthonormal so: twice in a cantilever that
 * is not far from straight, whose errors are largest there. */
double ath_tip_weight(const ath_piece *piece, const double *rest);
/* before: a plan of the same pieces about another rest pose, with bases, which are taken from there where they are the same;
 * may be null. work: ATH_BASIS_WORK doubles. */
enum { ATH_BASIS_WORK = 2 * ATH_PIECE_VERTICES * ATH_PIECE_VERTICES };
void ath_basis_fill(ath_piece *pieces, int32_t piece_count, const double *rest, const uint8_t *gaps,
                    const ath_plan *before, double *work, double *bases);
/* The same by ranges of pieces, in two passes: the sheets of one need the modes of any. */
ATH_ENCODER_API void ath_basis_modes(const ath_piece *pieces, int32_t first, int32_t stop, const double *rest,
                                     const uint8_t *gaps, double *work, double *bases);
ATH_ENCODER_API void ath_basis_sheets(ath_piece *pieces, int32_t first, int32_t stop, const double *rest,
                                      double *bases);
/* n x n: the modes of an evenly spaced beam that leaves its base in any direction; work: 2 n x n doubles. */
void ath_rest_basis(int32_t n, double *basis, double *work);
/* Eigenvalues, in descending order, and eigenvectors, a row each, of symmetric n x n matrices, which are destroyed;
 * n: at most ATH_SEGMENT_FRAMES. work: n x n. */
ATH_ENCODER_API void ath_principal(int32_t count, int32_t n, double *matrices, double *work, double *values,
                                   double *vectors);
/* Completes the nodes, once the rest pose is known. */
ATH_ENCODER_API void ath_plan_nodes(const ath_plan *plan, ath_node *nodes);

/* Eigenvectors of third differences, Fourier series, and modes of a free beam. */
enum { ATH_SMOOTH, ATH_PERIODIC, ATH_BEAM, ATH_WAVE_KINDS };
/* frames x frames, orthonormal: row k is the k-th wave of its kind. */
ATH_ENCODER_API void ath_waves(int32_t frames, int32_t kind, double *waves);

/* tan(x / 2) for 0 <= x < pi, by the series of sine and cosine. */
double ath_tan_of_half(double x);

ATH_INLINE const double *ath_rest_of(const ath_plan *plan, int32_t vertex) { return plan->rest + 3 * (size_t)vertex; }

/* Rest position of the point that a piece hangs on. */
ATH_INLINE const double *ath_rest_attach(const ath_plan *plan, const ath_piece *piece)
{
    return ath_rest_of(plan, piece->attach >= 0 ? piece->attach : piece->first);
}

ATH_INLINE int ath_is_shown(const ath_node *node, int32_t level) { return node->level <= level && level <= node->last; }

ATH_INLINE int32_t ath_base_level(const ath_piece *piece)
{
    return piece->low_level >= 0 ? piece->low_level : piece->level;
}

/* Modes that it moves by. */
ATH_INLINE int32_t ath_rank(const ath_piece *piece) { return piece->flags & ATH_RIGID ? 0 : piece->rank; }

/* Rings of a piece that has some; the last one may lack vertices. */
ATH_INLINE int32_t ath_rings(const ath_piece *piece) { return (piece->count + piece->ring - 1) / piece->ring; }

ATH_INLINE int ath_has_shift(const ath_piece *piece) { return piece->parent < 0 || (piece->flags & ATH_LOOSE); }

#endif
