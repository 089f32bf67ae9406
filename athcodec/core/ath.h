/* athcodec: the C API.
 *
 * Decoding runs the stages of FORMAT.md one by one: the hierarchy and the rest pose make a plan (pieces, nodes, bases)
 * that every segment shares; a segment's streams make integers; the integers make positions. Nothing here allocates,
 * recurses or keeps state: the caller owns every buffer, sizes come from the functions that say so, and functions on
 * different buffers may run in parallel. Functions that read bytes return ATH_OK or a code of ath_result; they never
 * read beyond `size` nor write beyond what the counts given say. Units are those of the scene; lengths of time are
 * frames; matrices are row-major.
 *
 * Motion arrays are vertex-major: element (vertex v, axis, frame t) of a segment of T frames stands at
 * (v * 3 + axis) * T + t. Vertices are in file order. */
#ifndef ATH_H
#define ATH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#define ATH_API __declspec(dllexport)
#elif defined(__GNUC__)
#define ATH_API __attribute__((visibility("default")))
#else
#define ATH_API
#endif

enum {
    ATH_PIECE_VERTICES = 64,   /* longest piece of a stem */
    ATH_SEGMENT_FRAMES = 256   /* longest segment */
};

typedef enum ath_result {
    ATH_OK = 0,
    ATH_BAD_STREAM = 1    /* a stream's content is not valid */
} ath_result;

enum { ATH_SHEET = 1, ATH_LOOSE = 2, ATH_WHOLE = 4 };

/* A branch in file order: depth-first, parents before children. */
typedef struct ath_branch {
    int32_t parent;       /* branch, below its own index; -1 for a root */
    int32_t count;        /* vertices of its stem, at least 1 */
    int32_t attach;       /* vertex of the parent's stem, -1 for a root */
    int32_t flags;        /* ATH_SHEET: affine basis first; ATH_LOOSE: carries a translation; ATH_WHOLE: its subtree is a leaf of the ATH */
    int32_t lag;          /* of the rest pose's predictor */
    int32_t first;        /* its first vertex */
    int32_t subtree;      /* branches in its subtree, itself included */
    int32_t depth;
} ath_branch;

/* A run of at most ATH_PIECE_VERTICES vertices of one stem, with one spatial basis. The first piece of a branch hangs
 * on the parent's stem, the others on the last vertex of the piece before. */
typedef struct ath_piece {
    int64_t modes;        /* its cantilever modes in the bases */
    int64_t basis;        /* its basis: `rank` rows of `count` */
    int32_t first, count; /* vertices */
    int32_t parent;       /* piece, -1 for a root */
    int32_t attach;       /* vertex, -1 for a root */
    int32_t branch;
    int32_t flags;
    int32_t rank;
    int32_t level;        /* whose stream completes it */
    int32_t low_level;    /* whose stream holds its tracks and first modes, -1 when `level` does */
    int32_t low_modes;
    int32_t carrier;      /* first of its vertices among the carriers', -1 when nothing hangs on it */
    int32_t carrier_index;
} ath_piece;

/* A node of the ATH: the subtree of a branch, moved by one affine map per frame at levels `level` to `last`. */
typedef struct ath_node {
    double whitening[9];  /* rows: functionals that are orthonormal over the subtree's rest vertices */
    int32_t branch, piece;
    int32_t first, count; /* vertices of the subtree */
    int32_t level, last;
    int32_t coded;        /* 1: its map has a stream of its own; 0: it follows from the stem's first modes */
    int32_t rank;         /* of the rest vertices about the attach point */
} ath_node;

/* What all segments share. */
typedef struct ath_shape {
    int32_t vertex_count, branch_count, piece_count, node_count;
    int32_t carrier_vertices, carrier_pieces;
    int32_t height;       /* deepest node: levels run from 0 to height + 1 */
    int32_t reserved;
    const ath_branch *branches;
    const ath_piece *pieces;
    const ath_node *nodes;
    const double *rest;   /* vertex_count x 3, relative to the origin */
    const double *bases;
} ath_shape;

/* How the integers of one level and segment are to be read. */
typedef struct ath_stream {
    double step;             /* quantisation step, scene units */
    double omega;            /* step factor of rotation tracks, 0: none are coded */
    const double *temporal;  /* temporal_rank x frames, orthonormal rows */
    int32_t temporal_rank;
    int32_t reserved;
} ath_stream;

/* One segment. `streams` has one entry per level, 0 to height + 1. */
typedef struct ath_motion {
    int32_t frames;
    int32_t reserved;
    const ath_stream *streams;
    const double *cosines;   /* frames x frames */
    int32_t *coefficients;   /* vertex_count x 3 x frames: mode m of a piece at slot first + m */
    int32_t *tracks;         /* piece_count x 2 x 3 x frames: rotation, translation */
    int32_t *node_tracks;    /* node_count x 4 x 3 x frames: columns of the map, translation */
    int32_t *node_steps;     /* node_count: exponents of half-octave steps */
    double *carriers;        /* carrier_vertices x 3 x frames */
    double *carrier_frames;  /* carrier_pieces x 12 x frames: rotation, attach point */
    double *work;            /* ath_motion_work(frames) doubles */
} ath_motion;

/* ---- the plan ------------------------------------------------------------------------------------------------- */

/* Completes first, subtree and depth of the branches and counts; 0 when they are not a valid hierarchy. */
ATH_API int32_t ath_count_pieces(ath_branch *branches, int32_t branch_count, int32_t vertex_count);
ATH_API int32_t ath_count_nodes(const ath_branch *branches, int32_t branch_count);

/* Fills pieces and nodes and the counts of `shape`, whose branches and counts of pieces and nodes are set.
 * `piece_of_vertex`: scratch, vertex_count. */
ATH_API void ath_plan(ath_shape *shape, ath_piece *pieces, ath_node *nodes, int32_t *piece_of_vertex);

/* Doubles that the bases need; fills the pieces' offsets. gaps: vertex_count bytes; table: ath_basis_table_size. */
ATH_API size_t ath_basis_table_size(int32_t piece_count);
ATH_API int64_t ath_basis_layout(ath_piece *pieces, int32_t piece_count, const double *rest, uint8_t *gaps,
                                 int32_t *table);
ATH_API void ath_basis_fill(ath_piece *pieces, int32_t piece_count, const double *rest, const uint8_t *gaps,
                            double *bases);
/* Completes the nodes, once the rest pose is known. */
ATH_API void ath_plan_nodes(const ath_shape *shape, ath_node *nodes);

/* frames x frames: row k is the k-th function of the orthonormal DCT-II. */
ATH_API void ath_cosine_basis(int32_t frames, double *basis);

/* ---- streams to integers --------------------------------------------------------------------------------------- */

/* Bytes of scratch memory that any of the coding functions needs as `model`. */
ATH_API size_t ath_model_size(void);

ATH_API int ath_decode_hierarchy(void *model, const uint8_t *bytes, size_t size, int32_t branch_count,
                                 int32_t vertex_count, ath_branch *branches, int32_t *branch_source,
                                 int32_t *vertex_source);
ATH_API int ath_decode_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                            int32_t branch_count, double step, double *rest);
/* An exact rest pose: positions as stored, the origin not taken off, floats or (wide) doubles. All are finite. */
ATH_API int ath_decode_exact_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                                  int32_t branch_count, int wide, double *rest);
/* Times of all frames, finite; whether they increase is for the caller to see. */
ATH_API int ath_decode_times(void *model, const uint8_t *bytes, size_t size, int32_t frame_count, double *times);
/* rank x frames integers of a learned temporal basis; `limit` stands for 1. */
ATH_API int ath_decode_temporal(void *model, const uint8_t *bytes, size_t size, int32_t rank, int32_t frames,
                                int32_t limit, int32_t *basis);
/* Coefficients and tracks of the pieces of one level; the arrays are zero on entry there. */
ATH_API int ath_decode_stems(void *model, const uint8_t *bytes, size_t size, const ath_shape *shape,
                             const ath_motion *motion, int32_t level);
ATH_API int ath_decode_affines(void *model, const uint8_t *bytes, size_t size, const ath_shape *shape,
                               const ath_motion *motion, int32_t level);
/* Adds corrections to `positions` (float, or double when `wide`), vertex-major. */
ATH_API int ath_decode_corrections(void *model, const uint8_t *bytes, size_t size, int32_t vertex_count,
                                   int32_t frames, double step, int wide, void *positions);

/* ---- integers to positions ------------------------------------------------------------------------------------- */

ATH_API size_t ath_motion_work(int32_t frames);

/* Positions of the segment at `level`, origin added, vertex-major, float or (wide) double. */
ATH_API void ath_pose(const ath_shape *shape, const ath_motion *motion, int32_t level, const double origin[3],
                      int wide, void *positions);

/* The nodes' maps at the levels they are shown: node_count x 12 x frames, 3x4 matrices that take absolute rest
 * positions to absolute positions; those of nodes not shown at `level` are left alone. ath_pose must have run. */
ATH_API void ath_node_matrices(const ath_shape *shape, const ath_motion *motion, int32_t level,
                               const double origin[3], double *matrices);

/* Vertex-major file order to frame-major source order (frames from..to-1), and back to doubles less the origin. */
ATH_API void ath_scatter(int32_t vertex_count, int32_t frames, const int32_t *vertex_source, int wide,
                         const void *positions, int32_t from, int32_t to, void *out);
ATH_API void ath_gather(int32_t vertex_count, int32_t frames, const int32_t *vertex_source, int wide,
                        const void *source, const double origin[3], double *out);

/* CRC-32C (Castagnoli) of `size` bytes, continuing from `crc` (0 to start). */
ATH_API uint32_t ath_crc32c(uint32_t crc, const uint8_t *bytes, size_t size);

/* ---- encoding --------------------------------------------------------------------------------------------------- */

/* Quantised coefficients and tracks of all pieces in closed loop, then the maps of the nodes in between.
 * source: vertex-major doubles less the origin. A map's step is that of its level (height + 2 lengths) over the root of
 * its number of vertices: the same error in all of them together costs the same everywhere. */
ATH_API void ath_analyse(const ath_shape *shape, const ath_motion *motion, const double *source, double dead_zone);
ATH_API void ath_analyse_nodes(const ath_shape *shape, const ath_motion *motion, const double *source,
                               const double *level_steps, double dead_zone);

/* Largest distance and sum of squared distances between positions and source (plus origin). */
ATH_API void ath_error(int32_t vertex_count, int32_t frames, int wide, const void *positions, const double *source,
                       const double origin[3], double *max_error, double *sum_squares);

/* Finds the corrections that bring every vertex within `limit`, applies them to `positions` and fills rows of
 * (vertex, frame, x, y, z). Returns their number; when it is above `capacity` nothing was applied. */
ATH_API int64_t ath_find_corrections(int32_t vertex_count, int32_t frames, int wide, void *positions,
                                     const double *source, const double origin[3], double limit, double step,
                                     int32_t *corrections, int64_t capacity);

/* Writers of the streams above: the size written, -1 when `capacity` is too small, -2 when the input cannot be
 * expressed. */
ATH_API int64_t ath_encode_hierarchy(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                     int32_t branch_count, int32_t vertex_count, const int32_t *branch_source,
                                     const int32_t *vertex_source);
ATH_API int64_t ath_encode_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                int32_t branch_count, double step, const double *source, double *rest);
ATH_API int64_t ath_encode_exact_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                      int32_t branch_count, int wide, const double *rest);
ATH_API int64_t ath_encode_times(void *model, uint8_t *bytes, size_t capacity, int32_t frame_count,
                                 const double *times);
ATH_API int64_t ath_encode_temporal(void *model, uint8_t *bytes, size_t capacity, int32_t rank, int32_t frames,
                                    int32_t limit, const int32_t *basis);
ATH_API int64_t ath_encode_stems(void *model, uint8_t *bytes, size_t capacity, const ath_shape *shape,
                                 const ath_motion *motion, int32_t level);
ATH_API int64_t ath_encode_affines(void *model, uint8_t *bytes, size_t capacity, const ath_shape *shape,
                                   const ath_motion *motion, int32_t level);
ATH_API int64_t ath_encode_corrections(void *model, uint8_t *bytes, size_t capacity, int32_t vertex_count,
                                       int32_t frames, const int32_t *corrections, int64_t count);

#ifdef __cplusplus
}
#endif
#endif
