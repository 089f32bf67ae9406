/* The encoder's part of the core. The Python package is its only user, and players leave it out. Segments are analysed,
 * measured and written stage by stage.
 *
 * Motion arrays are vertex-major: element (vertex v, axis, frame t) of a segment of T frames stands at (v * 3 + axis) *
 * T + t. Vertices are in file order. */
#ifndef ATH_ENCODE_ENCODE_H
#define ATH_ENCODE_ENCODE_H

#include "container/container.h"
#include "model/mesh.h"
#include "model/basis.h"
#include "model/corrections.h"
#include "model/maps.h"
#include "model/refine.h"
#include "model/rotations.h"

/* The integers of one segment, which belong to the streams of an ath_motion. */
typedef struct ath_integers {
    int32_t *coefficients; /* rows of 3 x frames: mode m of piece p is row first_rows[p] + m */
    int32_t *tracks;       /* piece_count x 2 x 3 x frames: rotation, translation */
    int32_t *node_tracks;  /* node_count x 4 x 3 x frames: columns of the map, translation */
    int32_t *node_steps;   /* node_count: exponents of half-octave steps */
    int32_t *predicted;    /* null unless this is a refinement; as large as coefficients and tracks */
    int32_t *predicted_tracks;
    const int32_t *first_rows;   /* piece_count; rigid pieces have no rows */
    const int32_t *shape_counts; /* piece_count; null: no piece has shapes */
    const int64_t *shape_first;  /* piece_count: where a piece's shapes begin in `shapes` */
    const double *shapes;        /* ATH_SHAPE_NUMBERS of each */
    const double *duals;         /* ATH_SHAPE_NUMBERS of each: take the modes' tracks to the shape's */
} ath_integers;

/* The layer before, from which a refinement predicts. Its pieces are placed again, one at a time. */
typedef struct ath_coarse {
    const ath_plan *plan;
    const ath_motion *motion; /* with its attach caches */
    const ath_integers *integers;
    double *turn_steps;     /* piece_count x 3, filled with rotation steps; below 0 where a piece is not rigid */
    const int32_t *nothing; /* zeros in place of the modes of rigid pieces: longest x 3 x frames */
} ath_coarse;

ATH_INLINE ath_piece_rows ath_rows_of_piece(const ath_integers *integers, int32_t frames, int32_t p)
{
    ath_piece_rows rows;
    rows.modes = ath_row(integers->coefficients, integers->first_rows[p], frames);
    rows.rotation = ath_row(integers->tracks, 2 * p, frames);
    rows.shift = ath_row(integers->tracks, 2 * p + 1, frames);
    rows.counts = 0;
    rows.predicted_modes = integers->predicted ? ath_row(integers->predicted, integers->first_rows[p], frames) : 0;
    rows.predicted_rotation = integers->predicted ? ath_row(integers->predicted_tracks, 2 * p, frames) : 0;
    rows.predicted_shift = integers->predicted ? ath_row(integers->predicted_tracks, 2 * p + 1, frames) : 0;
    rows.shape_count = integers->shape_counts ? integers->shape_counts[p] : 0;
    rows.shapes = rows.shape_count > 0 ? integers->shapes + integers->shape_first[p] * ATH_SHAPE_NUMBERS : 0;
    return rows;
}

ATH_INLINE void ath_coarse_rows(const ath_motion *motion, int32_t p, ath_piece_rows *rows)
{
    const ath_coarse *before = motion->before;
    ath_piece_rows coarse = ath_rows_of_piece(before->integers, motion->frames, p);
    int known = motion->known[p], alike = (coarse.shape_count > 0) == (rows->shape_count > 0);
    const int32_t *modes = before->plan->pieces[p].flags & ATH_RIGID ? before->nothing : coarse.modes;
    rows->coarse_turn_steps = before->turn_steps[3 * p] >= 0.0 ? before->turn_steps + 3 * (size_t)p : 0;
    rows->coarse_modes = known && alike ? modes : 0;
    rows->coarse_rotation = known ? coarse.rotation : 0;
    rows->coarse_shift = known ? coarse.shift : 0;
}

ATH_INLINE ath_node_rows ath_rows_of_node(const ath_integers *integers, int32_t frames, int32_t n)
{
    ath_node_rows rows;
    rows.rows = ath_row(integers->node_tracks, 4 * n, frames);
    rows.step = integers->node_steps + n;
    return rows;
}

/* Name, offset and size of an entry in the table of layouts: a struct, then its fields as "struct.field". Null behind the
 * last entry. */
ATH_ENCODER_API const char *ath_layout(int32_t index, size_t *offset, size_t *size);

/* Returns the bytes of scratch memory that any of the writers below needs as `model`. */
ATH_ENCODER_API size_t ath_model_size(void);

/* Fills the maps of pieces in each frame: matrix, its inverse, and centroid; and where `mean` is not null, measures
 * residuals: their mean distance from the rest pose in each frame, the largest, and the most vertices beyond xi in a frame
 * (from those given). stems: first vertices, and the number of all. order: pieces, each behind its parent. links, 5 per
 * piece: first and last stem + 1, parent or -1, rank, and whether others inherit its rotation. shapes, 21 per piece:
 * centroid, principal axes and pseudo-inverse of the rest pose. rest: 3 x vertices; positions: 3 x frames x vertices.
 * work: 12 x (stem_count + 1) + 9 x piece_count. */
ATH_ENCODER_API void ath_fit(int32_t vertex_count, int32_t frames, int32_t stem_count, const int64_t *stems,
                             int32_t piece_count, const int64_t *order, const int64_t *links, const double *shapes,
                             const double *rest, const double *positions, double xi, double *work, double *linear,
                             double *inverse, double *centroid, double *mean, double *largest, int32_t *most_beyond);

/* Adds the squared second differences over time of rows of positions, float or (is_float64) double, to `sums`, frames -
 * 2. */
ATH_ENCODER_API void ath_add_bends(int64_t rows, int32_t frames, int is_float64, const void *positions, double *sums);

/* Gathers some of the source's positions, (frames, source_count, 3) in its order, float or (is_float64) double, into
 * vertex-major doubles less the origin. */
ATH_ENCODER_API void ath_gather(int32_t vertex_count, int32_t frames, const int32_t *vertex_source,
                                int32_t source_count, int is_float64, const void *source, const double origin[3],
                                double *out);

enum { ATH_END_PARTS = 3 };

/* How numbers become integers. Below `dead_zone` steps they are 0. `ends` weighs the errors of a row's value, slope and
 * bend at either end, in squared steps; 0: they do not count. roots_turn: whether only the first pieces of roots, and
 * rigid ones, are turned, the former like what bends least of their trees; the others keep the rotation that they are
 * predicted to have. */
typedef struct ath_rounding {
    double dead_zone, ends[ATH_END_PARTS];
    int32_t roots_turn, reserved;
} ath_rounding;

/* Quantise the coefficients and tracks of pieces in closed loop, and the maps of nodes. source: vertex-major doubles
 * less the origin. A map's step is that of its stage (height + 2 lengths) over the root of its number of vertices, so
 * that equal errors of all vertices together cost the same everywhere. Attach caches have to be kept (ath_build_plan).
 * Only pieces, or nodes, first to stop - 1 are analysed: several threads may work on ranges of one segment, each with
 * its own scratch memory, once the pieces that theirs hang on are done. positions: see ath_pose; may be null.
 * bent: leave out rigid pieces on which nothing hangs. */
ATH_ENCODER_API void ath_analyse(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers,
                                 int32_t first, int32_t stop, const double *source, const ath_rounding *rounding,
                                 int bent, const double origin[3], int is_float64, void *positions);
ATH_ENCODER_API void ath_analyse_nodes(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers,
                                       int32_t first, int32_t stop, const double *source, const double *stage_steps,
                                       const ath_rounding *rounding);

/* Puts decoded vertices, less the origin, into positions as ath_pose does. */
void ath_store_positions(const double *placed, int32_t first, int32_t count, int32_t frames, const double origin[3],
                         int is_float64, void *positions);

/* Fill positions at `stage` as a decoder has them before corrections: with the origin, vertex-major, float or
 * (is_float64) double. First call ranges of pieces, under the rule above, then ranges of nodes. */
ATH_ENCODER_API void ath_pose(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers,
                              int32_t first, int32_t stop, int32_t stage, const double origin[3], int is_float64,
                              void *positions);
ATH_ENCODER_API void ath_pose_nodes(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers,
                                    int32_t first, int32_t stop, int32_t stage, const double origin[3], int is_float64,
                                    void *positions);

/* Fills the steps of a piece's first ATH_SHAPE_MODES modes over that of their stream. */
ATH_ENCODER_API void ath_mode_weights(const ath_piece *piece, double weights[ATH_SHAPE_MODES]);

/* Adds the second moments over time of rows of integers to the lower half of `moments`, frames x frames. Only rows
 * whose squares add up to more than `least` count. Returns their number. */
ATH_ENCODER_API int64_t ath_add_moments(int64_t count, int32_t frames, const int32_t *rows, double least,
                                        double *moments);

/* Fills the products of each piece's `count` rows of integers, three for each mode, with each other. first: the first
 * mode of each piece. */
ATH_ENCODER_API void ath_row_products(int64_t pieces, const int32_t *first, int32_t count, int32_t frames,
                                      const int32_t *rows, double *products);

/* Multiplies `count` pairs of matrices, rows x inner and inner x columns. a_step, b_step: numbers from one matrix to
 * the next; 0: all pairs share one. */
ATH_ENCODER_API void ath_multiply(int64_t count, int64_t rows, int64_t inner, int64_t columns, const double *a,
                                  int64_t a_step, const double *b, int64_t b_step, double *out);
/* Decomposes 3 x 3 matrices: left (columns) times the 3 singular values, in descending order, times right (rows). */
ATH_ENCODER_API void ath_decompose(int64_t count, const double *matrices, double *left, double *stretch, double *right);
/* Fills the rotation nearest to H by its singular vectors, whatever H is. */
void ath_nearest_rotation(const double H[9], double R[9]);
/* Replaces `count` times rows, n x columns, by the solution of matrix * x = rows. The matrices are positive definite and
 * are destroyed. */
ATH_ENCODER_API void ath_solve(int64_t count, int32_t n, int32_t columns, double *matrices, double *rows);

/* Measures the largest distance and the sum of squared distances between positions and source (plus origin). shown: how
 * many frames of the clip show each frame. shares: how many vertices of the source are at each place; null: one.
 * rounding: error that a decoder may add. histogram: ATH_SHORT_FLOATS counts
 * of distances, rounded up as in the error table, which are added to. */
ATH_ENCODER_API void ath_error(int32_t vertex_count, int32_t frames, const int32_t *shown, const int32_t *shares,
                               int is_float64, const void *positions, const double *source, const double origin[3],
                               double rounding, double *max_error, double *sum_squares, uint32_t *histogram);

/* Mixes the positions of `count` vertices, in frames x vertex_count x 3 floats or (is_float64) doubles, into a hash of
 * each. zeros_differ: whether 0.0 and -0.0 are different numbers. */
ATH_ENCODER_API void ath_hash_positions(int64_t count, const int32_t *vertices, int32_t frames, int32_t vertex_count,
                                        int is_float64, int zeros_differ, const void *positions, uint64_t *hashes);
/* Sets `apart` to 1 for each of `count` vertices that is not where another one is in all of the frames. */
ATH_ENCODER_API void ath_find_apart(int64_t count, const int32_t *vertices, const int32_t *others, int32_t frames,
                                    int32_t vertex_count, int is_float64, int zeros_differ, const void *positions,
                                    uint8_t *apart);

/* Fills for each of `count` points the first one with its label that is within a tolerance of it in all poses; itself if
 * there is none. points: count x poses x 3. pose: the one in which points lie furthest apart. table: a power of two.
 * work: table + count. */
ATH_ENCODER_API void ath_find_near(int32_t count, int32_t poses, int32_t pose, const double *points,
                                   const int32_t *labels, double tolerance, int32_t *work, uint32_t table,
                                   int32_t *leaders);
/* Raises `squares` to the square of the largest distance of each vertex from another in any of the frames. */
ATH_ENCODER_API void ath_find_far(int64_t count, const int32_t *vertices, const int32_t *others, int32_t frames,
                                  int32_t vertex_count, int is_float64, const void *positions, double *squares);

enum { ATH_CORRECTION_ROW = 6 }; /* int32_t per row */

/* How the corrections of a segment meet those of the segments beside it. At closed ends (1: first frame, 2: last frame)
 * no footprint is cut off, except for its faint end. decided: `count` rows as below, in ascending order, of corrections
 * at either end that are decided, since the segment beside shares them. A vertex that they do not serve gives them
 * up. */
typedef struct ath_met_ends {
    const int32_t *decided;
    int64_t count;
    int32_t closed, reserved;
} ath_met_ends;

/* Finds corrections that bring every vertex within its limit: up to `capacity` rows of vertex, frame and
 * ath_correction. narrow: whether a vertex's corrections must have one frame. Returns their number; -1: not with this
 * step. */
ATH_ENCODER_API int64_t ath_find_corrections(int32_t vertex_count, int32_t frames, int is_float64,
                                             const void *positions, const double *source, const double origin[3],
                                             const double *limits, const uint8_t *narrow, double step,
                                             const ath_met_ends *ends, int32_t *corrections, int64_t capacity);
/* Finds corrections that move all vertices of a part together, if one is beyond its limit and all are within it then;
 * over several frames if that serves, unless is_narrow is 1. closed: see ath_met_ends. Returns the number of rows. */
ATH_ENCODER_API int64_t ath_find_rigid_corrections(int32_t part_count, const int32_t *first, const int32_t *counts,
                                                   int32_t frames, int is_float64, const void *positions,
                                                   const double *source, const double origin[3], const double *limits,
                                                   int is_narrow, double step, int32_t closed, int32_t *corrections,
                                                   int64_t capacity);
/* The rows of one vertex must stand together, in the order of their frames. */
ATH_ENCODER_API void ath_apply_corrections(int32_t frames, int is_float64, void *positions, double step,
                                           const int32_t *corrections, int64_t count);

/* Writers of the streams return the size written; -1: `capacity` is too small; -2: the stream cannot hold the input. */
/* errors: ATH_MEASURES stored numbers per level and segment; joins: one per level and segment, ignored if there is one
 * segment; repeats: one per frame, or null. */
ATH_ENCODER_API int64_t ath_encode_front(uint8_t *bytes, size_t capacity, const ath_header *header,
                                         const ath_chunk *chunks, const int32_t *errors, const uint8_t *joins,
                                         const uint8_t *repeats);
ATH_ENCODER_API int64_t ath_encode_hierarchy(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                             int32_t branch_count, int32_t vertex_count, const int32_t *branch_source,
                                             const int32_t *vertex_source);
/* mesh: null unless the pose is connected. slack: how far a vertex may be moved to save bits. moved: scratch like
 * source. */
ATH_ENCODER_API int64_t ath_encode_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                        int32_t branch_count, double step, double slack, ath_mesh *mesh,
                                        const int32_t *coarse, const double *before, const int32_t *shape_of,
                                        int32_t *steps, const double *source, double *moved, double *rest);
/* Fills shape_of: the branch that each branch copies, itself if others copy it, or -1. uses: scratch. Returns their
 * number. */
ATH_ENCODER_API int32_t ath_find_copies(const ath_branch *branches, int32_t branch_count, const double *pose,
                                        double step, double slack, int32_t *uses, int32_t *shape_of);
/* turns: scratch, branch_count x 9. */
ATH_ENCODER_API int64_t ath_encode_source_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                               int32_t branch_count, double step, const double *reference,
                                               const double *source, double *moved, double *turns, double *rest);
ATH_ENCODER_API int64_t ath_encode_exact_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                                              int32_t branch_count, const ath_mesh *mesh, int is_float64,
                                              const double *rest);
/* memory: ath_faces_memory bytes. places: of each vertex, below place_count; not read if there are as many. has_sides:
 * whether guesses of open sides are used. */
ATH_ENCODER_API int64_t ath_encode_faces(void *memory, uint8_t *bytes, size_t capacity, const ath_polygons *shape,
                                         int32_t vertex_count, const int32_t *places, int32_t place_count,
                                         const uint32_t *counts, const int32_t *corners, int has_sides);
/* The stream of PLACES. memory: ath_faces_memory bytes for place_count vertices and places. */
ATH_ENCODER_API int64_t ath_encode_places(void *memory, uint8_t *bytes, size_t capacity, uint32_t columns,
                                          int32_t vertex_count, int32_t place_count, const int32_t *places);
ATH_ENCODER_API int64_t ath_encode_times(void *model, uint8_t *bytes, size_t capacity, int32_t frame_count,
                                         const double *times);
ATH_ENCODER_API int64_t ath_encode_temporal(void *model, uint8_t *bytes, size_t capacity, int32_t rank, int32_t frames,
                                            const int32_t *basis);
/* integers: `rank` rows of `frames` integers of waves, and rows of zeros up to a multiple of 3. */
ATH_ENCODER_API int64_t ath_encode_basis(void *model, uint8_t *bytes, size_t capacity, int32_t rank, int32_t frames,
                                         int32_t *exponents, int32_t *integers);
/* integers: ATH_SHAPE_NUMBERS of each shape, as streams hold them. */
ATH_ENCODER_API int64_t ath_encode_shapes(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                          const int32_t *shape_counts, const int64_t *shape_first, int32_t *integers,
                                          int32_t stage);
/* coarse_counts: null if the layer before has no shapes. */
ATH_ENCODER_API int64_t ath_encode_refined_shapes(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                                  const int32_t *shape_counts, const int64_t *shape_first,
                                                  int32_t *integers, const int32_t *coarse_counts,
                                                  const int64_t *coarse_first, const int32_t *coarse, int32_t shift);
/* positions, source: vertex-major, float or (is_float64) double. */
ATH_ENCODER_API int64_t ath_encode_exact(void *model, uint8_t *bytes, size_t capacity, int32_t vertex_count,
                                         int32_t frames, int is_float64, const void *positions, const void *source);
ATH_ENCODER_API int64_t ath_encode_stems(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                         const ath_motion *motion, const ath_integers *integers, int32_t stage);
ATH_ENCODER_API int64_t ath_encode_refinement(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                              const ath_motion *motion, const ath_integers *integers, int32_t stage);
ATH_ENCODER_API int64_t ath_encode_affines(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                           const ath_motion *motion, const ath_integers *integers, int32_t stage);
/* memory: ath_predicted_memory bytes. source: vertex-major doubles less the origin, `stride` numbers from row to row.
 * limits: one per vertex. block: block_frames x vertex_count x 3. Fills positions, as decoded, frames x vertex_count x
 * 3. */
ATH_ENCODER_API size_t ath_predicted_memory(int32_t vertex_count);
ATH_ENCODER_API int64_t ath_encode_predicted(void *memory, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                             const double *origin, int32_t frames, int is_float64, double step,
                                             const double *source, int64_t stride, const double *limits,
                                             int32_t block_frames, double *block, void *positions);
ATH_ENCODER_API int64_t ath_encode_corrections(void *model, uint8_t *bytes, size_t capacity, int32_t vertex_count,
                                               int32_t frames, const int32_t *corrections, int64_t count);

#endif
