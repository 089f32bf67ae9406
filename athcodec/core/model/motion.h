/* Steps of the motion model that decoding and analysis share (FORMAT.md, "Reconstruction"). */
#ifndef ATH_MOTION_H
#define ATH_MOTION_H

#include "model/plan.h"

/* Of streams in no learned basis: the waves of stems, those of nodes. */
enum ath_root { ATH_STEM_ROOT = -1, ATH_NODE_ROOT = -2 };

/* How the integers of one level and segment are to be read. */
typedef struct ath_stream {
    double step;                 /* quantisation step, scene units */
    double rotation_step_factor; /* of rotation tracks; 0: none are coded */
    const double *temporal;      /* temporal_rank x frames, orthonormal rows */
    int32_t temporal_rank;
    int32_t root;     /* level of the first stream whose learned basis begins with the same rows, or an ath_root */
    double turn_step; /* largest step of the rotations of rigid pieces, 0: any */
} ath_stream;

/* The layer before, from which a refinement predicts: what all pieces have become there. */
typedef struct ath_coarse {
    double *placed;                           /* vertex_count x 3 x frames: positions less the origin */
    const int32_t *integers, *integer_tracks; /* vertex_count x 3 x frames, piece_count x 2 x 3 x frames */
    const int32_t *shape_counts;              /* piece_count; null: no piece has shapes */
    double *tracks;     /* piece_count x 2 x 3 x frames: rotation, translation over time; 0 where none is coded */
    double *frames;     /* piece_count x 12 x frames: point and rotation of rigid pieces, moved and turned */
    int32_t *extents;   /* piece_count x 2: frequencies and modes that its rows reach */
    double *turn_steps; /* piece_count x 3: of rotations; below 0 where a piece is not rigid */
} ath_coarse;

/* What the pieces and nodes of one segment are placed with. */
typedef struct ath_motion {
    const ath_stream *streams; /* one per level, 0 to height + 1 */
    const double *waves;       /* frames x frames, of the maps of nodes: ath_waves */
    double *attach_caches;     /* ath_attach_cache_size(attach_cache_rows, frames) doubles */
    double *work;              /* ath_motion_work(longest, frames) doubles */
    const ath_coarse *before;  /* of a refinement; else null */
    const uint8_t *known; /* of a refinement, encoder: whether integers of a piece before stand for the same here */
    ath_coarse *decoded;  /* encoder: filled for the next layer; may be null */
    int32_t frames;
    int32_t ratio; /* of a refinement: the steps of the layer before over this one's */
} ath_motion;

/* Rows of integers over temporal frequency, 3 x frames each. */
enum { SHIFT_SLOT = ATH_PIECE_VERTICES, ROTATION_SLOT, ATH_SLOTS };

/* Learned shapes are made of a piece's first modes, three axes each. */
enum { ATH_SHAPE_MODES = 16, ATH_SHAPE_NUMBERS = 3 * ATH_SHAPE_MODES };

/* The integers of one piece. */
typedef struct {
    int32_t *modes; /* rank rows */
    int32_t *rotation, *shift;
    int32_t *counts;      /* ATH_SLOTS: frequencies that each row holds; null: as many as the stream may */
    int32_t shape_count;  /* above 0: axis a of row r is the track of shape 3 r + a, where there is one */
    const double *shapes; /* shape_count x ATH_SHAPE_NUMBERS: axis a of mode m at 3 m + a */
    int32_t *predicted_modes, *predicted_rotation,
        *predicted_shift; /* of a refinement, as large as the rows; else null */
    const int32_t *coarse_modes, *coarse_rotation,
        *coarse_shift;               /* rows of the layer before; null: of other functions */
    const double *coarse_turn_steps; /* of rotations there; null: the piece was not rigid */
} ath_piece_rows;

/* A piece as the layer before has it. */
typedef struct {
    const double *placed;           /* count x 3 x frames */
    const double *rotation, *shift; /* 3 x frames */
    const double *frames;           /* where it hung once moved and turned: point, rotation; null: it was not rigid */
    int32_t frequencies, modes;     /* that its rows reach; 0 frequencies: nothing is predicted from it */
} ath_piece_before;

/* The integers of one node: columns of its map, translation; exponent of its half-octave step. */
typedef struct {
    int32_t *rows; /* 4 rows */
    int32_t *step;
} ath_node_rows;

/* Where a piece hangs at every frame: attach point (3 rows of `frames`) and rotation (9 rows, row-major matrix). */
typedef struct {
    double *point, *rotation;
} ath_frames;

/* The scratch memory of one piece, carved out of ath_motion.work. */
typedef struct {
    double *rows;   /* of the longest piece, or of a map, x 3 x frames: coefficients over time */
    double *placed; /* as many: positions */
    ath_frames at;
    double *track;            /* 3 x frames */
    double *rotation, *shift; /* 3 x frames: what a refinement is to know of these tracks, one behind the other */
} ath_scratch;

ATH_ENCODER_API size_t ath_motion_work(int32_t longest, int32_t frames);
ATH_ENCODER_API size_t ath_attach_cache_size(int64_t attach_cache_rows, int32_t frames);

ath_scratch ath_motion_scratch(const ath_plan *plan, const ath_motion *motion);
void ath_attach(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece, ath_frames at);
/* Attach frame of a piece with its own tracks applied, in scratch->at. */
void ath_turned_attach(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                       const ath_scratch *scratch);
/* Places a piece from its coefficients over time (scratch->rows) in its attach frame (scratch->at), and keeps what the
 * pieces that hang on it need. Rows that are all 0 are left out. Returns its vertices, count x 3 x frames. */
const double *ath_pose_rows(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                            const ath_scratch *scratch);
/* The same from its integers. */
const double *ath_pose_piece(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                             const ath_scratch *scratch);
/* The same where ath_turned_attach has been called. */
const double *ath_pose_turned(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                              const ath_scratch *scratch);
/* The frequencies up to which a row is not all 0, at most `most`. */
int32_t ath_row_extent(const int32_t *row, int32_t frames, int32_t most);
/* The node's map x = point + rotation (x0 - a), left in scratch->at. */
void ath_node_map(const ath_plan *plan, const ath_motion *motion, int32_t n, const ath_piece_rows *piece_rows,
                  const ath_node_rows *rows, const ath_scratch *scratch);

/* g = mean over the node's vertices of mode(x) (x0 - a), through the whitening twice: the affine part of a mode. */
void ath_affine_part(const ath_plan *plan, const ath_node *node, const double *mode, double g[3]);

/* Integers of three axes over temporal frequency that a track would have in `steps` of the axes, nearest, where they are at least
 * half of their ratio, the step of the layer before over this one's; 0 elsewhere and from `frequencies` on. */
void ath_predict_track(const ath_stream *stream, int32_t frames, int32_t frequencies, const double steps[3],
                       const uint32_t ratios[3], const double *track, const int32_t *coarse, int32_t *predicted);
/* Those of a piece's translation and rotation, which make its attach frame; scratch->at is that without them. */
void ath_predict_shift(const ath_motion *motion, const ath_piece *piece, const ath_piece_before *before,
                       const ath_scratch *scratch, ath_piece_rows *rows);
void ath_predict_rotation(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                          const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows);
/* Both. */
void ath_predict_tracks(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                        const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows);
/* The same for the modes of a piece, from its vertices in the layer before seen from its attach frame now (scratch->at). */
void ath_predict_modes(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows);
/* out = R^T (x - c), 3 x frames */
void ath_into_rest_space(int32_t frames, const ath_frames *at, const double *x, double *out);
/* Vertices of a piece in its attach frame, less those of the rest pose. */
void ath_to_local(const ath_plan *plan, int32_t frames, const ath_piece *piece, const ath_frames *at,
                  const double *placed, double *local);
/* Tracks of `count` modes from that, 3 x frames each. */
void ath_project(const ath_plan *plan, int32_t frames, const ath_piece *piece, int32_t count, const double *local,
                 double *rows);
/* Adds rows to a learned basis, rows x frames, of which `known` are there: integers of waves by steps of the square root of
 * 2 to these exponents, made orthonormal. */
ATH_ENCODER_API void ath_add_basis_rows(const double *waves, int32_t frames, int32_t known, int32_t count,
                                        const int32_t *exponents, const int32_t *integers, double *rows);
void ath_inverse_temporal(const ath_stream *stream, int32_t frames, int32_t count, double step,
                          const int32_t *quantised, double *row);
/* x := c + R x, 3 x frames. */
void ath_move(int32_t frames, const ath_frames *at, double *x);
void ath_move_point(int32_t frames, const double *track, double *point);
void ath_turn(int32_t frames, const double *omega, double *rotation);
/* R and the least rotation behind it that takes a tangent, as R turns it, to the way from one point to another. */
void ath_follow_tangent(const double tangent[3], const double from[3], const double to[3], const double R[9],
                        double turned[9]);
/* Turns R towards the rotation nearest to H, column k of which is what rest axis k became; not where H vanishes. */
void ath_turn_to(const double H[9], int32_t steps, double R[9]);
/* A rotation matrix as ath_turn takes it, from the unit quaternion that is nearer to the last, `q`. */
void ath_rotation_vector(const double R[9], double q[4], double omega[3]);

/* What the rows of a piece's rotation are: steps about axes, which are the rows of `axes`. */
typedef struct {
    double steps[3], axes[9];
    int own_axes; /* 0: those of the rest pose's space */
} ath_turning;

/* Whether rotations of a piece are coded. */
int ath_has_rotation(const ath_plan *plan, const ath_piece *piece, const ath_stream *stream);
ath_turning ath_turning_of(const ath_plan *plan, const ath_piece *piece, const ath_stream *stream);
/* Of a refinement, the steps of rotations in the layer before over this one's. */
void ath_turn_ratios(const ath_motion *motion, const ath_turning *turning, const double *coarse_steps,
                     uint32_t ratios[3]);
/* Rotation vectors about the piece's axes, and back. */
void ath_into_axes(int32_t frames, const ath_turning *turning, double *track);
void ath_out_of_axes(int32_t frames, const ath_turning *turning, double *track);
double ath_shift_step(const ath_piece *piece, const ath_stream *stream);
double ath_node_step(int32_t exponent);
/* Shapes of unit length from the integers that a stream holds of each, 3 x ATH_SHAPE_MODES. 0: those of one are all
 * 0. */
ATH_ENCODER_API int ath_unit_shapes(int32_t count, const int32_t *integers, double *shapes);
/* The stream that node maps use: cosines, the node's own step. */
ath_stream ath_node_stream(const ath_motion *motion, double step);

/* The stream of a piece's rotation and translation tracks and of its first modes. */
ATH_INLINE const ath_stream *ath_base_stream(const ath_motion *motion, const ath_piece *piece)
{
    return motion->streams + ath_base_level(piece);
}

/* The stream that holds row m of a piece: its mode, or shapes. */
ATH_INLINE const ath_stream *ath_mode_stream(const ath_motion *motion, const ath_piece *piece, int32_t m)
{
    return m < piece->low_modes ? ath_base_stream(motion, piece) : motion->streams + piece->level;
}

/* How many of a piece's modes its shapes are made of. */
ATH_INLINE int32_t ath_shape_modes(const ath_piece *piece) { return ath_min(ath_rank(piece), ATH_SHAPE_MODES); }

/* Most shapes in the stream of the piece's base level. */
ATH_INLINE int32_t ath_base_shapes(const ath_piece *piece)
{
    return 3 * (piece->low_level >= 0 ? ath_min(piece->low_modes, ath_shape_modes(piece)) : ath_shape_modes(piece));
}

/* Whether row r holds shapes, where the piece has any: then it has no other row below ath_shape_modes. */
ATH_INLINE int ath_is_shape_row(const ath_piece *piece, const ath_piece_rows *rows, int32_t r)
{
    return rows->shape_count > 0 && r < ath_shape_modes(piece);
}

/* Steps of modes over that of their stream. Modes of a cantilever are quantised finer the more of the motion they
 * carry: an error of the first ones would have to be corrected by the pieces that hang on this one. */
ATH_INLINE double ath_mode_weight(const ath_piece *piece, int32_t m)
{
    static const double weight[4] = {0.75, 0.875, 0.9375, 1.0};
    if (piece->ring > 0 ? m >= ath_rings(piece) : (piece->flags & ATH_SHEET) != 0) return 1.0;
    return m < 4 ? weight[m] : 1.125;
}

ATH_INLINE double ath_row_step(const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows, int32_t r)
{
    double step = ath_mode_stream(motion, piece, r)->step;
    return step * (ath_is_shape_row(piece, rows, r) ? 0.875 : ath_mode_weight(piece, r));
}

ATH_INLINE int32_t *ath_row(int32_t *rows, int32_t row, int32_t frames)
{
    return rows + (size_t)row * 3 * (size_t)frames;
}

/* ---- corrections ---- */

enum { ATH_FOOTPRINTS = 3, ATH_FOOTPRINT_REACH = 3, ATH_FOOTPRINT_PARTS = 32 };

static const int32_t ath_footprint_reach[ATH_FOOTPRINTS] = {0, 1, 3};

/* What a correction of a width adds so many frames from its own, in parts of itself; nothing one and two frames beyond
 * its reach. */
ATH_INLINE int32_t ath_footprint_part(int32_t width, int32_t away)
{
    static const int32_t parts[ATH_FOOTPRINTS][ATH_FOOTPRINT_REACH + 3] = {{32}, {32, 16}, {32, 27, 16, 5}};
    return parts[width][away < 0 ? -away : away];
}

/* A vector in steps, and its footprint in time. */
typedef struct ath_correction {
    int32_t q[3], width;
} ath_correction;

/* What all corrections of a vertex add to its frames, in parts: whole numbers, so that their order does not matter. */
typedef double ath_corrected_parts[ATH_SEGMENT_FRAMES][3];

ATH_INLINE void ath_add_correction(int32_t frames, int32_t t, const ath_correction *own, ath_corrected_parts parts)
{
    int32_t reach = ath_footprint_reach[own->width];
    for (int32_t i = ath_max(0, t - reach); i <= ath_min(frames - 1, t + reach); i++)
        for (int32_t k = 0; k < 3; k++) parts[i][k] += (double)own->q[k] * ath_footprint_part(own->width, i - t);
}

/* Adds corrections to a position; nothing else does. */
ATH_INLINE double ath_corrected(double position, double parts, double step)
{
    return position + parts * (step / (double)ATH_FOOTPRINT_PARTS);
}

#endif
