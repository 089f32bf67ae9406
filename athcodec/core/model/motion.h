/* Steps of the motion model that decoding and analysis share (FORMAT.md, "Reconstruction"). */
#ifndef ATH_MODEL_MOTION_H
#define ATH_MODEL_MOTION_H

#include "model/plan.h"

enum { ATH_NO_ROOT = -1 }; /* root of streams without a learned basis */

/* How the integers of one stage and segment are to be read. */
typedef struct ath_stream {
    double step;                 /* quantisation step, scene units */
    double rotation_step_factor; /* step of rotation tracks over `step`; 0: no rotations are coded */
    const double *temporal;      /* temporal_rank x frames, orthonormal rows */
    int32_t temporal_rank;
    int32_t root;     /* stage of the first stream whose learned basis begins with the same rows, or ATH_NO_ROOT */
    double turn_step; /* largest rotation step of rigid pieces; 0: no limit */
} ath_stream;

/* The inputs and memory from which the pieces and nodes of one segment are placed. */
typedef struct ath_motion {
    const ath_stream *streams;       /* one per stage, 0 to height + 1 */
    const double *waves;             /* frames x frames, see ath_waves: the basis of node maps */
    double *attach_caches;           /* ath_attach_cache_size(attach_cache_rows, frames) doubles */
    double *work;                    /* ath_motion_work(longest, frames) doubles */
    const struct ath_coarse *before; /* encoder: the layer before; null unless this is a refinement */
    const uint8_t *known; /* encoder: whether the integers of a piece stand for the same in the layer before */
    int32_t frames;
    int32_t ratio; /* refinements: the steps of the layer before over this one's */
} ath_motion;

/* The integers of one piece. */
typedef struct {
    int32_t *modes; /* `rank` rows */
    int32_t *rotation, *shift;
    int32_t *counts;      /* ATH_SLOTS: frequencies that each row holds; null: as many as the stream may */
    int32_t shape_count;  /* above 0: axis a of row r is the track of shape 3 r + a, where there is one */
    const double *shapes; /* shape_count x ATH_SHAPE_NUMBERS: axis a of mode m at 3 m + a */
    int32_t *predicted_modes, *predicted_rotation,
        *predicted_shift;         /* null unless this is a refinement; as large as the rows */
    int32_t reach, reached_modes; /* decoder: frequencies and modes behind which all predictions are 0 */
    const int32_t *coarse_modes, *coarse_rotation,
        *coarse_shift;               /* rows of the layer before; null where their basis is another */
    const double *coarse_turn_steps; /* rotation steps of the layer before; null: the piece was not rigid there */
} ath_piece_rows;

/* A piece as the layer before has it. */
typedef struct {
    const double *placed;           /* count x 3 x frames */
    const double *rotation, *shift; /* 3 x frames; null: nothing */
    const double *frames;           /* attach point and rotation once moved and turned; null: it was not rigid */
    int32_t frequencies, modes;     /* reached by its rows; 0 frequencies: nothing is predicted */
} ath_piece_before;

/* The integers of one node: columns of its map, translation; exponent of its half-octave step. */
typedef struct {
    int32_t *rows; /* 4 rows */
    int32_t *step;
} ath_node_rows;

/* Attach frames of a piece: attach point (3 rows of `frames`) and rotation (9 rows, row-major matrix). */
typedef struct {
    double *point, *rotation;
} ath_frames;

/* The scratch memory of one piece, carved out of ath_motion.work. */
typedef struct {
    double *rows;   /* longest piece (or a map) x 3 x frames: coefficients over time */
    double *placed; /* positions, as large as `rows` */
    ath_frames at;
    double *track;            /* 3 x frames */
    double *rotation, *shift; /* 3 x frames each, contiguous: the tracks that a refinement predicts from, if coded */
} ath_scratch;

/* Where the vertices of a piece go as floats, frame by frame. */
typedef struct {
    float *first;      /* its first vertex in the first frame */
    size_t frame_size; /* floats from one frame to the next */
    const double *origin;
} ath_float_frames;

/* A piece's rotation rows are steps about axes, the rows of `axes`. */
typedef struct {
    double steps[3], axes[9];
    int own_axes; /* 0: the axes are those of the rest pose's space */
} ath_turning;

ATH_ENCODER_API size_t ath_motion_work(int32_t longest, int32_t frames);
ATH_ENCODER_API size_t ath_attach_cache_size(int64_t attach_cache_rows, int32_t frames);
ath_scratch ath_motion_scratch(const ath_plan *plan, const ath_motion *motion);

/* ---- placing ---- */

/* Fills the attach frame of a piece before its own tracks are applied. */
void ath_attach(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece, ath_frames at);
/* Applies a piece's own tracks to its attach frame in scratch->at. */
void ath_turn_attached(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_rows *rows, const ath_scratch *scratch);
/* Leaves the attach frame with the piece's own tracks applied in scratch->at. */
void ath_turned_attach(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                       const ath_scratch *scratch);
/* Places a piece from its coefficients over time (scratch->rows) in its attach frame (scratch->at), and keeps what the
 * pieces that hang on it need. Rows that are all 0 are left out. Returns its vertices, count x 3 x frames. */
const double *ath_pose_rows(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                            const ath_scratch *scratch);
/* Places a piece from its integers. */
const double *ath_pose_piece(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                             const ath_scratch *scratch);
/* After ath_turned_attach, fills the coefficients over time, and notes which rows are not all 0 (ATH_PIECE_VERTICES). */
void ath_pose_tracks(const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows,
                     const ath_scratch *scratch, uint8_t *used);
/* Places those vertices of a piece that are wanted, after ath_pose_tracks. wanted: bit v asks for vertex v. to: null, or
 * the destination of all vertices, which are then not returned. */
#define ATH_ALL_VERTICES (~(uint64_t)0)
const double *ath_pose_used(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                            const ath_piece_rows *rows, const uint8_t *used, uint64_t wanted,
                            const ath_scratch *scratch, const ath_float_frames *to);

/* Turns R towards the rotation nearest to H, whose column k is what rest axis k became. Leaves R if H vanishes. */
void ath_turn_to(const double H[9], int32_t steps, double R[9]);
/* x := c + R x, 3 x frames */
void ath_move(int32_t frames, const ath_frames *at, double *x);
void ath_move_point(int32_t frames, const double *track, double *point);
/* row = sum over k < count of quantised[k] * step * wave k */
void ath_inverse_temporal(const ath_stream *stream, int32_t frames, int32_t count, double step,
                          const int32_t *quantised, double *row);
/* Does the same for three axes. */
void ath_inverse_track(const ath_stream *stream, int32_t frames, int32_t count, double step, const int32_t *quantised,
                       double *track);
/* Does the same for row r of a piece's modes. */
void ath_inverse_row(const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows, int32_t r,
                     double *track);

/* ---- steps, learned bases, shapes ---- */

/* Returns whether rotations of a piece are coded. */
int ath_has_rotation(const ath_plan *plan, const ath_piece *piece, const ath_stream *stream);
ath_turning ath_turning_of(const ath_plan *plan, const ath_piece *piece, const ath_stream *stream);
/* Fills the rotation steps of the layer before over this one's, rounded. */
void ath_turn_ratios(const ath_motion *motion, const ath_turning *turning, const double *coarse_steps,
                     uint32_t ratios[3]);
/* Take rotation vectors to the piece's axes, and back. */
void ath_into_axes(int32_t frames, const ath_turning *turning, double *track);
void ath_out_of_axes(int32_t frames, const ath_turning *turning, double *track);
double ath_shift_step(const ath_piece *piece, const ath_stream *stream);
/* 2 to the power of exponent / 2 */
double ath_node_step(int32_t exponent);

/* Adds `count` rows to a learned basis whose first `known` rows are there. A row's integers of waves are scaled by
 * ath_node_step of its exponent, and the row is then made orthonormal to those before. */
ATH_ENCODER_API void ath_add_basis_rows(const double *waves, int32_t frames, int32_t known, int32_t count,
                                        const int32_t *exponents, const int32_t *integers, double *rows);
/* Makes shapes of unit length from their integers, 3 x ATH_SHAPE_MODES each. Returns 0 if a shape is all 0. */
ATH_ENCODER_API int ath_unit_shapes(int32_t count, const int32_t *integers, double *shapes);

/* Returns the stream of a piece's rotation and translation tracks and of its first modes. */
ATH_INLINE const ath_stream *ath_base_stream(const ath_motion *motion, const ath_piece *piece)
{
    return motion->streams + ath_base_stage(piece);
}

/* Returns the stream that holds row m of a piece: its mode, or three shapes. */
ATH_INLINE const ath_stream *ath_mode_stream(const ath_motion *motion, const ath_piece *piece, int32_t m)
{
    return m < piece->low_modes ? ath_base_stream(motion, piece) : motion->streams + piece->stage;
}

/* Returns how many of a piece's modes its shapes are made of. */
ATH_INLINE int32_t ath_shape_modes(const ath_piece *piece) { return ath_min(ath_rank(piece), ATH_SHAPE_MODES); }

/* Returns the most shapes that the stream of the piece's base stage may hold. */
ATH_INLINE int32_t ath_base_shapes(const ath_piece *piece)
{
    return 3 * (piece->low_stage >= 0 ? ath_min(piece->low_modes, ath_shape_modes(piece)) : ath_shape_modes(piece));
}

/* Returns whether row r holds shapes. A piece with shapes has no other rows below ath_shape_modes. */
ATH_INLINE int ath_is_shape_row(const ath_piece *piece, const ath_piece_rows *rows, int32_t r)
{
    return rows->shape_count > 0 && r < ath_shape_modes(piece);
}

/* Returns the step of a mode over that of its stream. Modes of a cantilever are quantised finer the more of the motion
 * they carry: the pieces that hang on this one would have to correct an error of its first modes. */
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

#endif
