/* From quantised coefficients to positions: FORMAT.md, "Reconstruction". One piece after the other, parents first;
 * what hangs on a piece is placed from that piece's decoded vertices, in doubles, in the order written here. */
#include "motion.h"

enum { POLAR_ITERATIONS = 4 };

size_t ath_motion_work(int32_t frames)
{
    return (size_t)frames * (6 * ATH_PIECE_VERTICES + 3 + 9 + 3);
}

ath_scratch ath_motion_scratch(const ath_motion *motion)
{
    size_t rows = 3 * ATH_PIECE_VERTICES * (size_t)motion->frames;
    ath_scratch scratch;
    scratch.rows = motion->work;
    scratch.placed = scratch.rows + rows;
    scratch.at.point = scratch.placed + rows;
    scratch.at.rotation = scratch.at.point + 3 * (size_t)motion->frames;
    scratch.track = scratch.at.rotation + 9 * (size_t)motion->frames;
    return scratch;
}

static double *carried_vertex(const ath_motion *motion, const ath_piece *piece, int32_t vertex)
{
    return motion->carriers + (size_t)(piece->carrier + vertex - piece->first) * 3 * (size_t)motion->frames;
}

static ath_frames carried_frames(const ath_motion *motion, const ath_piece *piece)
{
    ath_frames at;
    at.rotation = motion->carrier_frames + (size_t)piece->carrier_index * 12 * (size_t)motion->frames;
    at.point = at.rotation + 9 * (size_t)motion->frames;
    return at;
}

/* The rotation by the least angle that takes the parent's rest tangent, turned by R, to its tangent now; R itself where
 * either tangent vanishes or they are opposed. */
ATH_HOT static void follow_tangent(int32_t T, const double *tangent, const double *from, const double *to,
                                   const double *parent, double *restrict out)
{
    for (int32_t t = 0; t < T; t++) {
        double r0 = parent[t], r1 = parent[T + t], r2 = parent[2 * T + t], r3 = parent[3 * T + t];
        double r4 = parent[4 * T + t], r5 = parent[5 * T + t], r6 = parent[6 * T + t], r7 = parent[7 * T + t];
        double r8 = parent[8 * T + t];
        double ux = r0 * tangent[0] + r1 * tangent[1] + r2 * tangent[2];
        double uy = r3 * tangent[0] + r4 * tangent[1] + r5 * tangent[2];
        double uz = r6 * tangent[0] + r7 * tangent[1] + r8 * tangent[2];
        double u2 = ux * ux + uy * uy + uz * uz; /* 1 but for rounding, which must not grow along a chain */
        double straighten = 1.0 / ath_sqrt(u2 > 1e-200 ? u2 : 1.0);
        ux = ux * straighten;
        uy = uy * straighten;
        uz = uz * straighten;
        double vx = to[t] - from[t], vy = to[T + t] - from[T + t], vz = to[2 * T + t] - from[2 * T + t];
        double v2 = vx * vx + vy * vy + vz * vz;
        double inverse = 1.0 / ath_sqrt(v2 > 1e-200 ? v2 : 1.0);
        vx = vx * inverse;
        vy = vy * inverse;
        vz = vz * inverse;
        double cosine = ux * vx + uy * vy + uz * vz;
        int usable = v2 > 1e-200 && cosine > -0.9;
        double wx = uy * vz - uz * vy, wy = uz * vx - ux * vz, wz = ux * vy - uy * vx;
        double h = 1.0 / (1.0 + (usable ? cosine : 0.0));
        wx = usable ? wx : 0.0;
        wy = usable ? wy : 0.0;
        wz = usable ? wz : 0.0;
        double c = usable ? cosine : 1.0;
        double b0 = c + h * wx * wx, b1 = h * wx * wy - wz, b2 = h * wx * wz + wy;
        double b3 = h * wx * wy + wz, b4 = c + h * wy * wy, b5 = h * wy * wz - wx;
        double b6 = h * wx * wz - wy, b7 = h * wy * wz + wx, b8 = c + h * wz * wz;
        out[t] = b0 * r0 + b1 * r3 + b2 * r6;
        out[T + t] = b0 * r1 + b1 * r4 + b2 * r7;
        out[2 * T + t] = b0 * r2 + b1 * r5 + b2 * r8;
        out[3 * T + t] = b3 * r0 + b4 * r3 + b5 * r6;
        out[4 * T + t] = b3 * r1 + b4 * r4 + b5 * r7;
        out[5 * T + t] = b3 * r2 + b4 * r5 + b5 * r8;
        out[6 * T + t] = b6 * r0 + b7 * r3 + b8 * r6;
        out[7 * T + t] = b6 * r1 + b7 * r4 + b8 * r7;
        out[8 * T + t] = b6 * r2 + b7 * r5 + b8 * r8;
    }
}

static void copy_rows(double *to, const double *from, size_t count) { memcpy(to, from, count * sizeof(double)); }

static void attach_root(const ath_shape *shape, int32_t T, const ath_piece *piece, ath_frames at)
{
    const double *a = ath_rest_attach(shape, piece);
    for (int32_t t = 0; t < T; t++) {
        for (int32_t axis = 0; axis < 3; axis++) at.point[axis * T + t] = a[axis];
        for (int32_t k = 0; k < 9; k++) at.rotation[k * T + t] = k % 4 == 0 ? 1.0 : 0.0;
    }
}

void ath_attach(const ath_shape *shape, const ath_motion *motion, const ath_piece *piece, ath_frames at)
{
    int32_t T = motion->frames;
    if (piece->parent < 0) {
        attach_root(shape, T, piece, at);
        return;
    }
    const ath_piece *parent = shape->pieces + piece->parent;
    ath_frames base = carried_frames(motion, parent);
    const double *here = carried_vertex(motion, parent, piece->attach);
    copy_rows(at.point, here, 3 * (size_t)T);
    if (!(parent->flags & ATH_SHEET)) {
        int32_t last = parent->first + parent->count - 1;
        int32_t before = piece->attach - 1, after = ath_min(piece->attach + 1, last);
        const double *from = before < parent->first ? base.point : carried_vertex(motion, parent, before);
        const double *to = carried_vertex(motion, parent, after);
        const double *rest_from = before < parent->first ? ath_rest_attach(shape, parent) : ath_rest_of(shape, before);
        const double *rest_to = ath_rest_of(shape, after);
        double tangent[3], length2 = 0.0;
        for (int32_t k = 0; k < 3; k++) {
            tangent[k] = rest_to[k] - rest_from[k];
            length2 = length2 + tangent[k] * tangent[k];
        }
        if (length2 > 1e-200) {
            double inverse = 1.0 / ath_sqrt(length2);
            for (int32_t k = 0; k < 3; k++) tangent[k] = tangent[k] * inverse;
            follow_tangent(T, tangent, from, to, base.rotation, at.rotation);
            return;
        }
    }
    copy_rows(at.rotation, base.rotation, 9 * (size_t)T);
}

/* row = sum over k of quantised[k] * step * temporal[k], k ascending; rows of zeros stay exact zeros. */
ATH_HOT void ath_inverse_temporal(const ath_stream *stream, int32_t T, double step, const int32_t *quantised,
                                  double *restrict row)
{
    for (int32_t t = 0; t < T; t++) row[t] = 0.0;
    for (int32_t k = 0; k < stream->temporal_rank; k++) {
        if (quantised[k] == 0) continue;
        const double *wave = stream->temporal + (size_t)k * (size_t)T;
        double value = (double)quantised[k] * step;
        for (int32_t t = 0; t < T; t++) row[t] = row[t] + value * wave[t];
    }
}

void ath_move_point(int32_t T, const double *track, double *point)
{
    for (int32_t i = 0; i < 3 * T; i++) point[i] = point[i] + track[i];
}

/* The rotation (row-major) of the quaternion normalize(1, x, y, z) squared. */
ATH_INLINE void rational_rotation(double x, double y, double z, double q[9])
{
    double n2 = x * x + y * y + z * z, scale = 1.0 / (1.0 + n2);
    double w = (1.0 - n2) * scale;
    x = 2.0 * x * scale;
    y = 2.0 * y * scale;
    z = 2.0 * z * scale;
    q[0] = 1.0 - 2.0 * (y * y + z * z);
    q[1] = 2.0 * (x * y - w * z);
    q[2] = 2.0 * (x * z + w * y);
    q[3] = 2.0 * (x * y + w * z);
    q[4] = 1.0 - 2.0 * (x * x + z * z);
    q[5] = 2.0 * (y * z - w * x);
    q[6] = 2.0 * (x * z - w * y);
    q[7] = 2.0 * (y * z + w * x);
    q[8] = 1.0 - 2.0 * (x * x + y * y);
}

/* R := R Q(omega), Q being the rotation of the quaternion normalize(1, omega / 4) squared. */
ATH_HOT void ath_turn(int32_t T, const double *omega, double *restrict R)
{
    for (int32_t t = 0; t < T; t++) {
        double q[9];
        rational_rotation(0.25 * omega[t], 0.25 * omega[T + t], 0.25 * omega[2 * T + t], q);
        for (int32_t i = 0; i < 3; i++) {
            double *r = R + 3 * i * T;
            double r0 = r[t], r1 = r[T + t], r2 = r[2 * T + t];
            r[t] = r0 * q[0] + r1 * q[3] + r2 * q[6];
            r[T + t] = r0 * q[1] + r1 * q[4] + r2 * q[7];
            r[2 * T + t] = r0 * q[2] + r1 * q[5] + r2 * q[8];
        }
    }
}

/* placed = c + R (x0 - a + sum over modes of basis * row), modes ascending, rows of zeros left out. */
ATH_HOT static void place_vertex(int32_t T, int32_t rank, const double *basis, size_t stride, const uint8_t *used,
                                 const double *rows, const double *d, const ath_frames *at, double *restrict out)
{
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t t = 0; t < T; t++) out[axis * T + t] = d[axis];
    for (int32_t m = 0; m < rank; m++) {
        if (!used[m]) continue;
        double weight = basis[(size_t)m * stride];
        const double *row = rows + (size_t)m * 3 * (size_t)T;
        for (int32_t i = 0; i < 3 * T; i++) out[i] = out[i] + weight * row[i];
    }
    const double *R = at->rotation, *c = at->point;
    for (int32_t t = 0; t < T; t++) {
        double x = out[t], y = out[T + t], z = out[2 * T + t];
        out[t] = c[t] + (R[t] * x + R[T + t] * y + R[2 * T + t] * z);
        out[T + t] = c[T + t] + (R[3 * T + t] * x + R[4 * T + t] * y + R[5 * T + t] * z);
        out[2 * T + t] = c[2 * T + t] + (R[6 * T + t] * x + R[7 * T + t] * y + R[8 * T + t] * z);
    }
}

static int any_nonzero(const double *row, int32_t count)
{
    for (int32_t i = 0; i < count; i++)
        if (row[i] != 0.0) return 1;
    return 0;
}

void ath_place(const ath_shape *shape, const ath_motion *motion, const ath_piece *piece, const ath_scratch *scratch)
{
    int32_t T = motion->frames;
    uint8_t used[ATH_PIECE_VERTICES];
    const double *a = ath_rest_attach(shape, piece);
    for (int32_t m = 0; m < piece->rank; m++)
        used[m] = (uint8_t)any_nonzero(scratch->rows + (size_t)m * 3 * (size_t)T, 3 * T);
    for (int32_t i = 0; i < piece->count; i++) {
        const double *x0 = ath_rest_of(shape, piece->first + i);
        double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
        place_vertex(T, piece->rank, shape->bases + piece->basis + i, (size_t)piece->count, used, scratch->rows, d,
                     &scratch->at, scratch->placed + (size_t)i * 3 * (size_t)T);
    }
}

/* One Newton step from R towards the rotation nearest to H (column k: what rest axis k became): with C = H R', the
 * turn omega solves (trace(C) - sym(C)) omega = axial(C). Where that matrix is not safely positive (mirrored H), a
 * step down the gradient serves. `size2` is the scale of H. */
void ath_turn_towards(const double H[9], double size2, double R[9])
{
    double C[9];
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            C[3 * i + j] = H[3 * i] * R[3 * j] + H[3 * i + 1] * R[3 * j + 1] + H[3 * i + 2] * R[3 * j + 2];
    double wx = C[7] - C[5], wy = C[2] - C[6], wz = C[3] - C[1];
    double a = C[4] + C[8], b = C[0] + C[8], c = C[0] + C[4];
    double d = -0.5 * (C[1] + C[3]), e = -0.5 * (C[2] + C[6]), f = -0.5 * (C[5] + C[7]);
    double ab = a * b - d * d, least = 1e-9 * size2;
    double xx = b * c - f * f, xy = e * f - d * c, xz = d * f - e * b;
    double determinant = a * xx + d * xy + e * xz;
    double x, y, z;
    if (a > least && ab > least * least && determinant > least * least * least) {
        double scale = 0.25 / determinant;
        double yy = a * c - e * e, yz = d * e - a * f;
        x = (xx * wx + xy * wy + xz * wz) * scale;
        y = (xy * wx + yy * wy + yz * wz) * scale;
        z = (xz * wx + yz * wy + ab * wz) * scale;
    } else {
        double trace = C[0] + C[4] + C[8];
        double scale = 0.25 / ((trace < 0.0 ? -trace : trace) + least);
        x = wx * scale;
        y = wy * scale;
        z = wz * scale;
    }
    double q[9];
    rational_rotation(x, y, z, q);
    for (int32_t k = 0; k < 3; k++) {
        double r0 = R[k], r1 = R[3 + k], r2 = R[6 + k];
        for (int32_t i = 0; i < 3; i++) R[3 * i + k] = q[3 * i] * r0 + q[3 * i + 1] * r1 + q[3 * i + 2] * r2;
    }
}

/* How a sheet as a whole has turned: the rotation nearest to its decoded vertices, its own R as the prior. */
static void turn_with_sheet(const ath_shape *shape, int32_t T, const ath_piece *piece, const ath_scratch *scratch,
                            double *rotation)
{
    const double *a = ath_rest_attach(shape, piece);
    for (int32_t t = 0; t < T; t++) {
        double H[9] = {0}, R[9], size2 = 0.0;
        for (int32_t i = 0; i < piece->count; i++) {
            const double *x0 = ath_rest_of(shape, piece->first + i);
            const double *x = scratch->placed + (size_t)i * 3 * (size_t)T;
            for (int32_t k = 0; k < 3; k++) {
                double d = x0[k] - a[k];
                size2 = size2 + d * d;
                for (int32_t j = 0; j < 3; j++)
                    H[3 * j + k] = H[3 * j + k] + (x[j * T + t] - scratch->at.point[j * T + t]) * d;
            }
        }
        for (int32_t k = 0; k < 9; k++) {
            R[k] = scratch->at.rotation[k * T + t];
            H[k] = H[k] + 0.01 * size2 * R[k];
        }
        if (size2 > 1e-200)
            for (int32_t step = 0; step < POLAR_ITERATIONS; step++) ath_turn_towards(H, size2, R);
        for (int32_t k = 0; k < 9; k++) rotation[k * T + t] = R[k];
    }
}

/* Keeps what the pieces that hang on this one need. */
void ath_carry(const ath_shape *shape, const ath_motion *motion, const ath_piece *piece, const ath_scratch *scratch)
{
    int32_t T = motion->frames;
    if (piece->carrier < 0) return;
    ath_frames at = carried_frames(motion, piece);
    copy_rows(carried_vertex(motion, piece, piece->first), scratch->placed, (size_t)piece->count * 3 * (size_t)T);
    copy_rows(at.point, scratch->at.point, 3 * (size_t)T);
    if (piece->flags & ATH_SHEET)
        turn_with_sheet(shape, T, piece, scratch, at.rotation);
    else
        copy_rows(at.rotation, scratch->at.rotation, 9 * (size_t)T);
}

/* omega is weighted by its lever, so that its error moves the piece's vertices like any other coefficient's. */
double ath_omega_step(const ath_shape *shape, const ath_piece *piece, const ath_stream *stream)
{
    const double *a = ath_rest_attach(shape, piece);
    double lever2 = 0.0;
    for (int32_t i = 0; i < piece->count; i++) {
        const double *x0 = ath_rest_of(shape, piece->first + i);
        for (int32_t k = 0; k < 3; k++) lever2 = lever2 + (x0[k] - a[k]) * (x0[k] - a[k]);
    }
    if (!(lever2 > 0.0) || !(stream->omega > 0.0)) return 0.0;
    return stream->omega * stream->step / ath_sqrt(lever2 * 2.0 / 3.0);
}

double ath_shift_step(const ath_piece *piece, const ath_stream *stream)
{
    return stream->step / ath_sqrt((double)piece->count);
}

static void inverse_track(const ath_stream *stream, int32_t T, double step, const int32_t *quantised, double *track)
{
    for (int32_t axis = 0; axis < 3; axis++)
        ath_inverse_temporal(stream, T, step, quantised + axis * T, track + axis * T);
}

static void reconstruct_modes(const ath_shape *shape, const ath_motion *motion, int32_t p, const ath_scratch *scratch)
{
    const ath_piece *piece = shape->pieces + p;
    for (int32_t m = 0; m < piece->rank; m++) {
        inverse_track(ath_mode_stream(motion, piece, m), motion->frames, ath_mode_step(motion, piece, m),
                      ath_coefficients_of(motion, piece->first + m), scratch->rows + (size_t)m * 3 * (size_t)motion->frames);
    }
}

/* ---- nodes ---- */

static double half_octave(int32_t exponent)
{
    double value = exponent & 1 ? 1.4142135623730951 : 1.0;
    int32_t doublings = (exponent - (exponent & 1)) / 2;
    for (; doublings > 0; doublings--) value = value * 2.0;
    for (; doublings < 0; doublings++) value = value * 0.5;
    return value;
}

double ath_node_step(const ath_motion *motion, int32_t n) { return half_octave(motion->node_steps[n]); }

int32_t *ath_node_track(const ath_motion *motion, int32_t n, int32_t row)
{
    return motion->node_tracks + ((size_t)n * 4 + (size_t)row) * 3 * (size_t)motion->frames;
}

/* The stream that node maps use: cosines, the node's own step. */
ath_stream ath_node_stream(const ath_motion *motion, double step)
{
    ath_stream stream = {step, 0.0, motion->cosines, motion->frames, 0};
    return stream;
}

/* E += columns x functional: axis i of track r adds track[i] * functional[k] to E[i][k]. E: 9 rows. */
ATH_HOT static void add_outer(int32_t T, const double *track, const double functional[3], double *restrict E)
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; k < 3; k++) {
            double *out = E + (3 * i + k) * T;
            for (int32_t t = 0; t < T; t++) out[t] = out[t] + track[i * T + t] * functional[k];
        }
}

/* g = mean over the node's vertices of mode(x) (x0 - a), through the whitening twice: the affine part of a mode. */
static void affine_part(const ath_shape *shape, const ath_node *node, const double *mode, double g[3])
{
    const double *a = ath_rest_attach(shape, shape->pieces + node->piece);
    double moment[3] = {0.0, 0.0, 0.0};
    for (int32_t i = 0; i < node->count; i++) {
        const double *x0 = ath_rest_of(shape, node->first + i);
        for (int32_t k = 0; k < 3; k++) moment[k] = moment[k] + mode[i] * (x0[k] - a[k]);
    }
    for (int32_t k = 0; k < 3; k++) g[k] = 0.0;
    for (int32_t r = 0; r < node->rank; r++) {
        const double *w = node->whitening + 3 * r;
        double dot = (w[0] * moment[0] + w[1] * moment[1] + w[2] * moment[2]) / (double)node->count;
        for (int32_t k = 0; k < 3; k++) g[k] = g[k] + dot * w[k];
    }
}

static void coded_map(const ath_motion *motion, const ath_node *node, int32_t n, const ath_scratch *scratch,
                      int shifted, double *E)
{
    double step = ath_node_step(motion, n);
    ath_stream stream = ath_node_stream(motion, step);
    if (shifted) {
        inverse_track(&stream, motion->frames, step, ath_node_track(motion, n, 3), scratch->track);
        ath_move_point(motion->frames, scratch->track, scratch->at.point);
    }
    for (int32_t r = 0; r < node->rank; r++) {
        inverse_track(&stream, motion->frames, step, ath_node_track(motion, n, r), scratch->track);
        add_outer(motion->frames, scratch->track, node->whitening + 3 * r, E);
    }
}

/* Attach frame of a piece with its own tracks applied. */
static void turned_attach(const ath_shape *shape, const ath_motion *motion, int32_t p, const ath_scratch *scratch)
{
    const ath_piece *piece = shape->pieces + p;
    const ath_stream *base = ath_base_stream(motion, piece);
    double omega_step = ath_omega_step(shape, piece, base);
    ath_attach(shape, motion, piece, scratch->at);
    if (ath_has_shift(piece)) {
        inverse_track(base, motion->frames, ath_shift_step(piece, base), ath_shift_track(motion, p), scratch->track);
        ath_move_point(motion->frames, scratch->track, scratch->at.point);
    }
    if (omega_step > 0.0) {
        inverse_track(base, motion->frames, omega_step, ath_omega_track(motion, p), scratch->track);
        ath_turn(motion->frames, scratch->track, scratch->at.rotation);
    }
}

static void map_of_modes(const ath_shape *shape, const ath_motion *motion, const ath_node *node,
                         const ath_scratch *scratch, double *E)
{
    const ath_piece *piece = shape->pieces + node->piece;
    const ath_stream *base = ath_base_stream(motion, piece);
    for (int32_t m = 0; m < ath_min(piece->low_modes, piece->rank); m++) {
        double g[3];
        affine_part(shape, node, shape->bases + piece->basis + (size_t)m * (size_t)piece->count, g);
        inverse_track(base, motion->frames, ath_mode_step(motion, piece, m),
                      ath_coefficients_of(motion, piece->first + m), scratch->track);
        add_outer(motion->frames, scratch->track, g, E);
    }
}

/* R := R (I + E) */
ATH_HOT static void compose(int32_t T, const double *E, double *restrict R)
{
    for (int32_t i = 0; i < 3; i++) {
        double *r = R + 3 * i * T;
        for (int32_t t = 0; t < T; t++) {
            double r0 = r[t], r1 = r[T + t], r2 = r[2 * T + t];
            r[t] = r0 + (r0 * E[t] + r1 * E[3 * T + t] + r2 * E[6 * T + t]);
            r[T + t] = r1 + (r0 * E[T + t] + r1 * E[4 * T + t] + r2 * E[7 * T + t]);
            r[2 * T + t] = r2 + (r0 * E[2 * T + t] + r1 * E[5 * T + t] + r2 * E[8 * T + t]);
        }
    }
}

/* The node's map x = point + rotation (x0 - a), left in scratch->at. */
void ath_node_map(const ath_shape *shape, const ath_motion *motion, int32_t n, const ath_scratch *scratch)
{
    const ath_node *node = shape->nodes + n;
    double *E = scratch->rows;
    for (int32_t i = 0; i < 9 * motion->frames; i++) E[i] = 0.0;
    if (node->coded) {
        ath_attach(shape, motion, shape->pieces + node->piece, scratch->at);
        coded_map(motion, node, n, scratch, ath_has_shift(shape->pieces + node->piece), E);
    } else {
        turned_attach(shape, motion, node->piece, scratch);
        map_of_modes(shape, motion, node, scratch, E);
    }
    compose(motion->frames, E, scratch->at.rotation);
}

/* ---- output ---- */

static void store(const double *placed, int32_t first, int32_t count, int32_t T, const double origin[3], int wide,
                  void *positions)
{
    for (int32_t row = 0; row < 3 * count; row++) {
        const double *from = placed + (size_t)row * (size_t)T;
        size_t at = ((size_t)first * 3 + (size_t)row) * (size_t)T;
        double shift = origin[row % 3];
        if (wide)
            for (int32_t t = 0; t < T; t++) ((double *)positions)[at + (size_t)t] = from[t] + shift;
        else
            for (int32_t t = 0; t < T; t++) ((float *)positions)[at + (size_t)t] = (float)(from[t] + shift);
    }
}

static void pose_piece(const ath_shape *shape, const ath_motion *motion, int32_t p, const ath_scratch *scratch)
{
    const ath_piece *piece = shape->pieces + p;
    turned_attach(shape, motion, p, scratch);
    reconstruct_modes(shape, motion, p, scratch);
    ath_place(shape, motion, piece, scratch);
    ath_carry(shape, motion, piece, scratch);
}

static void pose_node(const ath_shape *shape, const ath_motion *motion, int32_t n, const ath_scratch *scratch,
                      const double origin[3], int wide, void *positions)
{
    const ath_node *node = shape->nodes + n;
    const double *a = ath_rest_attach(shape, shape->pieces + node->piece);
    ath_node_map(shape, motion, n, scratch);
    for (int32_t v = node->first; v < node->first + node->count; v++) {
        const double *x0 = ath_rest_of(shape, v);
        double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
        place_vertex(motion->frames, 0, 0, 0, 0, 0, d, &scratch->at, scratch->placed);
        store(scratch->placed, v, 1, motion->frames, origin, wide, positions);
    }
}

static int shown(const ath_node *node, int32_t level) { return node->level <= level && level <= node->last; }

void ath_pose(const ath_shape *shape, const ath_motion *motion, int32_t level, const double origin[3], int wide,
              void *positions)
{
    ath_scratch scratch = ath_motion_scratch(motion);
    for (int32_t p = 0; p < shape->piece_count; p++) {
        const ath_piece *piece = shape->pieces + p;
        if (piece->level > level) continue;
        pose_piece(shape, motion, p, &scratch);
        store(scratch.placed, piece->first, piece->count, motion->frames, origin, wide, positions);
    }
    for (int32_t n = 0; n < shape->node_count; n++)
        if (shown(shape->nodes + n, level)) pose_node(shape, motion, n, &scratch, origin, wide, positions);
}

void ath_node_matrices(const ath_shape *shape, const ath_motion *motion, int32_t level, const double origin[3],
                       double *matrices)
{
    ath_scratch scratch = ath_motion_scratch(motion);
    int32_t T = motion->frames;
    for (int32_t n = 0; n < shape->node_count; n++) {
        if (!shown(shape->nodes + n, level)) continue;
        const double *a = ath_rest_attach(shape, shape->pieces + shape->nodes[n].piece);
        double *out = matrices + (size_t)n * 12 * (size_t)T;
        ath_node_map(shape, motion, n, &scratch);
        for (int32_t i = 0; i < 3; i++) {
            const double *R = scratch.at.rotation + 3 * i * T, *c = scratch.at.point + i * T;
            copy_rows(out + 4 * i * T, R, 3 * (size_t)T);
            for (int32_t t = 0; t < T; t++)
                out[(4 * i + 3) * T + t] = (c[t] + origin[i])
                    - (R[t] * (a[0] + origin[0]) + R[T + t] * (a[1] + origin[1]) + R[2 * T + t] * (a[2] + origin[2]));
        }
    }
}
