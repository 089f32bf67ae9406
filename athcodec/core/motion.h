/* Steps of the motion model that decoding (motion.c) and analysis (analyse.c) share. */
#ifndef ATH_MOTION_H
#define ATH_MOTION_H

#include "internal.h"

/* Where a piece hangs at every frame: attach point (3 rows of `frames`) and rotation (9 rows, row-major matrix). */
typedef struct {
    double *point, *rotation;
} ath_frames;

/* The scratch memory of one piece, carved out of ath_motion.work. */
typedef struct {
    double *rows;   /* ATH_PIECE_VERTICES x 3 x frames: coefficients over time */
    double *placed; /* ATH_PIECE_VERTICES x 3 x frames: positions */
    ath_frames at;
    double *track;  /* 3 x frames */
} ath_scratch;

ath_scratch ath_motion_scratch(const ath_motion *motion);
void ath_attach(const ath_shape *shape, const ath_motion *motion, const ath_piece *piece, ath_frames at);
void ath_inverse_temporal(const ath_stream *stream, int32_t frames, double step, const int32_t *quantised, double *row);
void ath_move_point(int32_t frames, const double *track, double *point);
void ath_turn(int32_t frames, const double *omega, double *rotation);
void ath_turn_towards(const double H[9], double size2, double R[9]);
void ath_place(const ath_shape *shape, const ath_motion *motion, const ath_piece *piece, const ath_scratch *scratch);
void ath_carry(const ath_shape *shape, const ath_motion *motion, const ath_piece *piece, const ath_scratch *scratch);
double ath_omega_step(const ath_shape *shape, const ath_piece *piece, const ath_stream *stream);
double ath_shift_step(const ath_piece *piece, const ath_stream *stream);
int32_t *ath_node_track(const ath_motion *motion, int32_t n, int32_t row);
double ath_node_step(const ath_motion *motion, int32_t n);
ath_stream ath_node_stream(const ath_motion *motion, double step);
void ath_node_map(const ath_shape *shape, const ath_motion *motion, int32_t n, const ath_scratch *scratch);

ATH_INLINE const double *ath_rest_of(const ath_shape *shape, int32_t vertex)
{
    return shape->rest + 3 * (size_t)vertex;
}

/* Rest position of the point that a piece hangs on. */
ATH_INLINE const double *ath_rest_attach(const ath_shape *shape, const ath_piece *piece)
{
    return ath_rest_of(shape, piece->attach >= 0 ? piece->attach : piece->first);
}

/* The stream of a piece's rotation and translation tracks and of its first modes. */
ATH_INLINE const ath_stream *ath_base_stream(const ath_motion *motion, const ath_piece *piece)
{
    return motion->streams + (piece->low_level >= 0 ? piece->low_level : piece->level);
}

/* The stream that holds a piece's mode. */
ATH_INLINE const ath_stream *ath_mode_stream(const ath_motion *motion, const ath_piece *piece, int32_t m)
{
    return m < piece->low_modes ? ath_base_stream(motion, piece) : motion->streams + piece->level;
}

/* Modes of a cantilever are quantised finer the more of the motion they carry: what the first ones get wrong, the
 * pieces that hang on this one would have to code again. */
ATH_INLINE double ath_mode_step(const ath_motion *motion, const ath_piece *piece, int32_t m)
{
    static const double weight[4] = {0.75, 0.875, 0.9375, 1.0};
    double step = ath_mode_stream(motion, piece, m)->step;
    return piece->flags & ATH_SHEET ? step : step * (m < 4 ? weight[m] : 1.125);
}

ATH_INLINE int ath_has_shift(const ath_piece *piece) { return piece->parent < 0 || (piece->flags & ATH_LOOSE); }

ATH_INLINE int32_t *ath_omega_track(const ath_motion *motion, int32_t p)
{
    return motion->tracks + (size_t)p * 6 * (size_t)motion->frames;
}

ATH_INLINE int32_t *ath_shift_track(const ath_motion *motion, int32_t p)
{
    return ath_omega_track(motion, p) + 3 * (size_t)motion->frames;
}

ATH_INLINE int32_t *ath_coefficients_of(const ath_motion *motion, int32_t slot)
{
    return motion->coefficients + (size_t)slot * 3 * (size_t)motion->frames;
}

/* The one place where a correction meets a position. */
ATH_INLINE double ath_corrected(double position, int32_t steps, double step)
{
    return position + (double)steps * step;
}

#endif
