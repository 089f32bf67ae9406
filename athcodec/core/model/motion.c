/* From quantised coefficients to positions: FORMAT.md, "Reconstruction". One piece after the other, parents first;
 * what hangs on a piece is placed from that piece's decoded vertices, in doubles, in the order written here. */
#include "model/lanes.h"
#include "model/motion.h"

enum { POLAR_ITERATIONS = 4, TURN_LANES = 16, ATH_TERMS = ATH_SHAPE_NUMBERS + ATH_PIECE_VERTICES - ATH_SHAPE_MODES };
enum { PLACED_VERTICES = 2 * ATH_LANES, PLACED_FRAMES = 2 * ATH_LANES, PROJECTED_NUMBERS = 8 * ATH_LANES };

static const double LEAST_MOMENT = 0.0009765625; /* of inertia, that a rotation's step is made for, over all of them */

/* A map takes four rows. */
static size_t scratch_rows(int32_t longest, int32_t frames) { return (size_t)ath_max(longest, 4) * 3 * (size_t)frames; }

size_t ath_motion_work(int32_t longest, int32_t frames)
{
    return 2 * scratch_rows(longest, frames) + (3 + 9 + 3 + 6) * (size_t)frames;
}

size_t ath_attach_cache_size(int64_t attach_cache_rows, int32_t frames)
{
    return (size_t)attach_cache_rows * 3 * (size_t)frames;
}

ath_scratch ath_motion_scratch(const ath_plan *plan, const ath_motion *motion)
{
    size_t rows = scratch_rows(plan->longest, motion->frames);
    ath_scratch scratch;
    scratch.rows = motion->work;
    scratch.placed = scratch.rows + rows;
    scratch.at.point = scratch.placed + rows;
    scratch.at.rotation = scratch.at.point + 3 * (size_t)motion->frames;
    scratch.track = scratch.at.rotation + 9 * (size_t)motion->frames;
    scratch.rotation = scratch.track + 3 * (size_t)motion->frames;
    scratch.shift = scratch.rotation + 3 * (size_t)motion->frames;
    return scratch;
}

static double *cached_vertices(const ath_motion *motion, const ath_piece *piece)
{
    return motion->attach_caches + ath_attach_cache_size(piece->attach_cache, motion->frames);
}

static const double *cached_vertex(const ath_motion *motion, const ath_piece *piece, int32_t vertex)
{
    return motion->attach_caches + ath_attach_cache_size(piece->attach_cache + vertex - piece->first, motion->frames);
}

static ath_frames cached_frames(const ath_motion *motion, const ath_piece *piece)
{
    ath_frames at;
    at.rotation = motion->attach_caches + ath_attach_cache_size(piece->attach_cache + piece->count, motion->frames);
    at.point = at.rotation + 9 * (size_t)motion->frames;
    return at;
}

/* The rotation by the least angle that takes the parent's rest tangent, turned by R, to its tangent now; beyond a right
 * angle by less and less, so that it is R itself where they are opposed, and where the tangent vanishes. */
ATH_INLINE void turn_lanes(int32_t count, int32_t T, const double *tangent, const double *from, const double *to,
                           const double *parent, double turned[9][TURN_LANES])
{
    for (int32_t t = 0; t < count; t++) {
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
        double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        double w = 1.0 + (cosine > 0.0 ? cosine : 0.0),
               sine2 = x * x + y * y + z * z; /* a quaternion, not of length 1 */
        double h = 2.0 / (w * w + sine2), g = w * h, c = 1.0 - h * sine2;
        double b0 = c + h * x * x, b1 = h * x * y - g * z, b2 = h * x * z + g * y;
        double b3 = h * x * y + g * z, b4 = c + h * y * y, b5 = h * y * z - g * x;
        double b6 = h * x * z - g * y, b7 = h * y * z + g * x, b8 = c + h * z * z;
        turned[0][t] = b0 * r0 + b1 * r3 + b2 * r6;
        turned[1][t] = b0 * r1 + b1 * r4 + b2 * r7;
        turned[2][t] = b0 * r2 + b1 * r5 + b2 * r8;
        turned[3][t] = b3 * r0 + b4 * r3 + b5 * r6;
        turned[4][t] = b3 * r1 + b4 * r4 + b5 * r7;
        turned[5][t] = b3 * r2 + b4 * r5 + b5 * r8;
        turned[6][t] = b6 * r0 + b7 * r3 + b8 * r6;
        turned[7][t] = b6 * r1 + b7 * r4 + b8 * r7;
        turned[8][t] = b6 * r2 + b7 * r5 + b8 * r8;
    }
}

ATH_HOT static void follow_tangent(int32_t T, const double *tangent, const double *from, const double *to,
                                   const double *parent, double *out)
{
    double turned[9][TURN_LANES]; /* a local copy, which no pointer aliases: else compilers would not use SIMD */
    int32_t count;
    for (int32_t start = 0; start < T; start += count, from += count, to += count, parent += count, out += count) {
        count = ath_min(TURN_LANES, T - start);
        turn_lanes(count, T, tangent, from, to, parent, turned);
        for (int32_t k = 0; k < 9; k++)
            for (int32_t t = 0; t < count; t++) out[k * T + t] = turned[k][t];
    }
}

void ath_follow_tangent(const double tangent[3], const double from[3], const double to[3], const double R[9],
                        double turned[9])
{
    follow_tangent(1, tangent, from, to, R, turned);
}

static void copy_rows(double *to, const double *from, size_t count) { memcpy(to, from, count * sizeof(double)); }

static void attach_root(const ath_plan *plan, int32_t T, const ath_piece *piece, ath_frames at)
{
    const double *a = ath_rest_attach(plan, piece);
    for (int32_t t = 0; t < T; t++) {
        for (int32_t axis = 0; axis < 3; axis++) at.point[axis * T + t] = a[axis];
        for (int32_t k = 0; k < 9; k++) at.rotation[k * T + t] = k % 4 == 0 ? 1.0 : 0.0;
    }
}

void ath_attach(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece, ath_frames at)
{
    int32_t T = motion->frames;
    if (piece->parent < 0) {
        attach_root(plan, T, piece, at);
        return;
    }
    const ath_piece *parent = plan->pieces + piece->parent;
    ath_frames base = cached_frames(motion, parent);
    const double *here = cached_vertex(motion, parent, piece->attach);
    copy_rows(at.point, here, 3 * (size_t)T);
    if (!(parent->flags & (ATH_SHEET | ATH_RIGID))) {
        int32_t last = parent->first + parent->count - 1;
        int32_t before = piece->attach - 1, after = ath_min(piece->attach + 1, last);
        const double *from = before < parent->first ? base.point : cached_vertex(motion, parent, before);
        const double *to = cached_vertex(motion, parent, after);
        const double *rest_from = before < parent->first ? ath_rest_attach(plan, parent) : ath_rest_of(plan, before);
        const double *rest_to = ath_rest_of(plan, after);
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

/* row = sum over k of quantised[k] * step * temporal[k], k ascending, those of 0 left out. */
ATH_HOT void ath_inverse_temporal(const ath_stream *stream, int32_t T, int32_t count, double step,
                                  const int32_t *quantised, double *row)
{
    double value[ATH_SEGMENT_FRAMES];
    const double *wave[ATH_SEGMENT_FRAMES];
    int32_t used = 0;
    for (int32_t k = 0; k < count; k++) {
        value[used] = (double)quantised[k] * step; /* without a branch, which would be guessed wrong */
        wave[used] = stream->temporal + (size_t)k * (size_t)T;
        used += quantised[k] != 0;
    }
    lanes_sum(T, used, value, wave, 0.0, row);
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
ATH_HOT void ath_turn(int32_t T, const double *omega, double *ATH_RESTRICT R)
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

/* x := c + R x */
ATH_HOT void ath_move(int32_t T, const ath_frames *at, double *ATH_RESTRICT out)
{
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

/* What a piece is placed by: tracks over time, of modes three, one behind the other. */
typedef struct {
    const double *track[ATH_TERMS];
    int32_t shape[ATH_TERMS]; /* of the first shape_count terms, which are the same for all axes */
    int32_t mode[ATH_TERMS];  /* of those behind */
    int32_t shape_count, count, frames;
} placing_terms;

static placing_terms terms_of(const ath_piece *piece, const ath_piece_rows *rows, int32_t T, const uint8_t *used,
                              const double *tracks)
{
    placing_terms terms;
    int32_t from = rows->shape_count > 0 ? ath_shape_modes(piece) : 0;
    terms.frames = T;
    terms.shape_count = terms.count = 0;
    for (int32_t s = 0; s < rows->shape_count; s++) {
        const double *track = tracks + (size_t)s * (size_t)T;
        if (!used[s / 3] || !any_nonzero(track, T)) continue;
        terms.track[terms.count] = track;
        terms.shape[terms.count++] = s;
    }
    terms.shape_count = terms.count;
    for (int32_t m = from; m < ath_rank(piece); m++) {
        if (!used[m]) continue;
        terms.track[terms.count] = tracks + (size_t)m * 3 * (size_t)T;
        terms.mode[terms.count++] = m;
    }
    return terms;
}

/* A few vertices side by side: where they are at rest, less the attach point, and how far each term moves them. */
typedef struct {
    double rest[3][PLACED_VERTICES], weight[ATH_TERMS][3][PLACED_VERTICES]; /* of modes the same for all axes */
} placed_vertices;

/* `mode`: of each of a shape's modes the numbers of the vertices. */
ATH_INLINE void weigh_shape(int32_t modes, const double *shape, double mode[][PLACED_VERTICES],
                            double weight[3][PLACED_VERTICES])
{
    for (int32_t v = 0; v < PLACED_VERTICES; v += ATH_LANES) {
        ath_lanes x, y, z;
        lanes_set(&x, 0.0);
        lanes_set(&y, 0.0);
        lanes_set(&z, 0.0);
        for (int32_t m = 0; m < modes; m++) {
            lanes_add_scaled(&x, shape[3 * m], mode[m] + v);
            lanes_add_scaled(&y, shape[3 * m + 1], mode[m] + v);
            lanes_add_scaled(&z, shape[3 * m + 2], mode[m] + v);
        }
        lanes_store(weight[0] + v, &x);
        lanes_store(weight[1] + v, &y);
        lanes_store(weight[2] + v, &z);
    }
}

ATH_INLINE void weigh_terms(const ath_plan *plan, const ath_piece *piece, const ath_piece_rows *rows,
                            const placing_terms *terms, int32_t first, int32_t count, placed_vertices *vertices)
{
    const double *basis = plan->bases + piece->basis + first, *a = ath_rest_attach(plan, piece);
    double mode[ATH_SHAPE_MODES][PLACED_VERTICES];
    for (int32_t i = 0; i < count; i++) {
        const double *x0 = ath_rest_of(plan, piece->first + first + i);
        for (int32_t k = 0; k < 3; k++) vertices->rest[k][i] = x0[k] - a[k];
    }
    if (terms->shape_count > 0)
        for (int32_t m = 0; m < ath_shape_modes(piece); m++)
            for (int32_t i = 0; i < PLACED_VERTICES; i++) mode[m][i] = i < count ? basis[m * piece->count + i] : 0.0;
    for (int32_t j = 0; j < terms->shape_count; j++)
        weigh_shape(ath_shape_modes(piece), rows->shapes + terms->shape[j] * ATH_SHAPE_NUMBERS, mode,
                    vertices->weight[j]);
    for (int32_t j = terms->shape_count; j < terms->count; j++)
        for (int32_t i = 0; i < count; i++) vertices->weight[j][0][i] = basis[terms->mode[j] * piece->count + i];
}

/* What the terms make of vertex v in PLACED_FRAMES frames from t on. */
ATH_INLINE void add_terms(int32_t t, const placing_terms *terms, const placed_vertices *vertices, int32_t v,
                          double sum[3][PLACED_FRAMES])
{
    ath_lanes x0, x1, y0, y1, z0, z1;
    int32_t T = terms->frames, j = 0;
    lanes_set(&x0, vertices->rest[0][v]);
    lanes_set(&y0, vertices->rest[1][v]);
    lanes_set(&z0, vertices->rest[2][v]);
    x1 = x0;
    y1 = y0;
    z1 = z0;
    for (; j < terms->shape_count; j++) {
        const double *track = terms->track[j] + t;
        lanes_add_scaled(&x0, vertices->weight[j][0][v], track);
        lanes_add_scaled(&x1, vertices->weight[j][0][v], track + ATH_LANES);
        lanes_add_scaled(&y0, vertices->weight[j][1][v], track);
        lanes_add_scaled(&y1, vertices->weight[j][1][v], track + ATH_LANES);
        lanes_add_scaled(&z0, vertices->weight[j][2][v], track);
        lanes_add_scaled(&z1, vertices->weight[j][2][v], track + ATH_LANES);
    }
    for (; j < terms->count; j++) {
        const double *track = terms->track[j] + t;
        double weight = vertices->weight[j][0][v];
        lanes_add_scaled(&x0, weight, track);
        lanes_add_scaled(&x1, weight, track + ATH_LANES);
        lanes_add_scaled(&y0, weight, track + T);
        lanes_add_scaled(&y1, weight, track + T + ATH_LANES);
        lanes_add_scaled(&z0, weight, track + 2 * T);
        lanes_add_scaled(&z1, weight, track + 2 * T + ATH_LANES);
    }
    lanes_store(sum[0], &x0);
    lanes_store(sum[0] + ATH_LANES, &x1);
    lanes_store(sum[1], &y0);
    lanes_store(sum[1] + ATH_LANES, &y1);
    lanes_store(sum[2], &z0);
    lanes_store(sum[2] + ATH_LANES, &z1);
}

/* x := c + R x of `count` vertices in ATH_LANES frames, T frames apart. */
ATH_INLINE void move_vertices(int32_t T, int32_t count, const double *R, const double *c,
                              double sums[][3][PLACED_FRAMES], int32_t from, double *out)
{
    ath_lanes rows[3][3], centre[3], x[3];
    for (int32_t k = 0; k < 3; k++) {
        for (int32_t j = 0; j < 3; j++) lanes_load(&rows[k][j], R + (3 * k + j) * T);
        lanes_load(&centre[k], c + k * T);
    }
    for (int32_t i = 0; i < count; i++, out += 3 * T) {
        for (int32_t k = 0; k < 3; k++) lanes_load(&x[k], sums[i][k] + from);
        for (int32_t k = 0; k < 3; k++) lanes_move(out + k * T, &centre[k], rows[k], x);
    }
}

/* Vertex v at one frame. */
ATH_INLINE void place_frame(int32_t t, const placing_terms *terms, const placed_vertices *vertices, int32_t v,
                            const ath_frames *at, double *out)
{
    int32_t T = terms->frames, shapes = terms->shape_count;
    const double *R = at->rotation + t, *c = at->point + t;
    double x[3];
    for (int32_t k = 0; k < 3; k++) {
        x[k] = vertices->rest[k][v];
        for (int32_t j = 0; j < shapes; j++) x[k] = x[k] + vertices->weight[j][k][v] * terms->track[j][t];
        for (int32_t j = shapes; j < terms->count; j++)
            x[k] = x[k] + vertices->weight[j][0][v] * terms->track[j][k * T + t];
    }
    for (int32_t k = 0; k < 3; k++, R += 3 * T)
        out[k * T + t] = c[k * T] + (R[0] * x[0] + R[T] * x[1] + R[2 * T] * x[2]);
}

/* placed = c + R (x0 - a + sum over terms of weight * track), shapes first, tracks of zeros left out. A few vertices
 * pass through a few frames at a time, while tracks and attach frames stay in the innermost cache. */
ATH_HOT static void place(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                          const ath_piece_rows *rows, const uint8_t *used, const ath_scratch *scratch)
{
    int32_t T = motion->frames, count;
    placing_terms terms = terms_of(piece, rows, T, used, scratch->rows);
    placed_vertices vertices;
    double sums[PLACED_VERTICES][3][PLACED_FRAMES], *out = scratch->placed;
    const double *R = scratch->at.rotation, *c = scratch->at.point;
    for (int32_t first = 0; first < piece->count; first += count, out += count * 3 * T) {
        int32_t t = 0;
        count = ath_min(PLACED_VERTICES, piece->count - first);
        weigh_terms(plan, piece, rows, &terms, first, count, &vertices);
        for (; t + PLACED_FRAMES <= T; t += PLACED_FRAMES) {
            for (int32_t i = 0; i < count; i++) add_terms(t, &terms, &vertices, i, sums[i]);
            for (int32_t from = 0; from < PLACED_FRAMES; from += ATH_LANES)
                move_vertices(T, count, R + t + from, c + t + from, sums, from, out + t + from);
        }
        for (; t < T; t++)
            for (int32_t i = 0; i < count; i++) place_frame(t, &terms, &vertices, i, &scratch->at, out + i * 3 * T);
    }
}

/* One step of Newton's method from R towards the rotation nearest to H, which has a Frobenius norm of 1 (column k: what
 * rest axis k became): with C = H R', the turn omega solves (trace(C) - sym(C)) omega = axial(C). Far from that rotation
 * the trace is small, and 1 in its place keeps the matrix positive definite. */
static void turn_towards(const double H[9], double R[9])
{
    double C[9];
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            C[3 * i + j] = H[3 * i] * R[3 * j] + H[3 * i + 1] * R[3 * j + 1] + H[3 * i + 2] * R[3 * j + 2];
    double wx = C[7] - C[5], wy = C[2] - C[6], wz = C[3] - C[1];
    double trace = C[0] + C[4] + C[8];
    double most = (trace > 1.0 ? trace : 1.0) + 1e-6;
    double a = most - C[0], b = most - C[4], c = most - C[8];
    double d = -0.5 * (C[1] + C[3]), e = -0.5 * (C[2] + C[6]), f = -0.5 * (C[5] + C[7]);
    double xx = b * c - f * f, xy = e * f - d * c, xz = d * f - e * b;
    double yy = a * c - e * e, yz = d * e - a * f, zz = a * b - d * d;
    double scale = 0.25 / (a * xx + d * xy + e * xz);
    double x = (xx * wx + xy * wy + xz * wz) * scale;
    double y = (xy * wx + yy * wy + yz * wz) * scale;
    double z = (xz * wx + yz * wy + zz * wz) * scale;
    double q[9];
    rational_rotation(x, y, z, q);
    for (int32_t k = 0; k < 3; k++) {
        double r0 = R[k], r1 = R[3 + k], r2 = R[6 + k];
        for (int32_t i = 0; i < 3; i++) R[3 * i + k] = q[3 * i] * r0 + q[3 * i + 1] * r1 + q[3 * i + 2] * r2;
    }
}

void ath_turn_to(const double H[9], int32_t steps, double R[9])
{
    double unit[9], norm2 = 0.0;
    for (int32_t k = 0; k < 9; k++) norm2 = norm2 + H[k] * H[k];
    if (!(norm2 > 1e-200)) return;
    double inverse = 1.0 / ath_sqrt(norm2);
    for (int32_t k = 0; k < 9; k++) unit[k] = H[k] * inverse;
    for (int32_t step = 0; step < steps; step++) turn_towards(unit, R);
}

/* How a sheet as a whole has turned: the rotation nearest to its decoded vertices, its own R as the prior. */
static void turn_with_sheet(const ath_plan *plan, int32_t T, const ath_piece *piece, const ath_scratch *scratch,
                            double *rotation)
{
    const double *a = ath_rest_attach(plan, piece);
    for (int32_t t = 0; t < T; t++) {
        double H[9] = {0}, R[9], size2 = 0.0;
        for (int32_t i = 0; i < piece->count; i++) {
            const double *x0 = ath_rest_of(plan, piece->first + i);
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
        ath_turn_to(H, POLAR_ITERATIONS, R);
        for (int32_t k = 0; k < 9; k++) rotation[k * T + t] = R[k];
    }
}

static void carry(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece, const ath_scratch *scratch)
{
    int32_t T = motion->frames;
    if (piece->attach_cache < 0) return;
    ath_frames at = cached_frames(motion, piece);
    copy_rows(at.point, scratch->at.point, 3 * (size_t)T);
    if (piece->flags & ATH_SHEET && !(piece->flags & ATH_RIGID))
        turn_with_sheet(plan, T, piece, scratch, at.rotation);
    else
        copy_rows(at.rotation, scratch->at.rotation, 9 * (size_t)T);
}

/* Squared distances of a piece's vertices from where it hangs. */
static double squared_lever(const ath_plan *plan, const ath_piece *piece)
{
    const double *a = ath_rest_attach(plan, piece);
    double lever2 = 0.0;
    for (int32_t i = 0; i < piece->count; i++) {
        const double *x0 = ath_rest_of(plan, piece->first + i);
        for (int32_t k = 0; k < 3; k++) lever2 = lever2 + (x0[k] - a[k]) * (x0[k] - a[k]);
    }
    return lever2;
}

static double rotation_factor(const ath_piece *piece, const ath_stream *stream)
{
    int rigid = (piece->flags & ATH_RIGID) != 0;
    return rigid && !(stream->rotation_step_factor > 0.0) ? 1.0 : stream->rotation_step_factor;
}

int ath_has_rotation(const ath_plan *plan, const ath_piece *piece, const ath_stream *stream)
{
    return rotation_factor(piece, stream) > 0.0 && squared_lever(plan, piece) > 0.0;
}

/* Of inertia about the point that a piece hangs on, the largest moment first. */
static void axes_of_inertia(const ath_plan *plan, const ath_piece *piece, double lever2, double moments[3],
                            double axes[9])
{
    const double *a = ath_rest_attach(plan, piece);
    double M[9] = {lever2, 0.0, 0.0, 0.0, lever2, 0.0, 0.0, 0.0, lever2}, work[9];
    for (int32_t v = 0; v < piece->count; v++) {
        const double *x0 = ath_rest_of(plan, piece->first + v);
        double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
        for (int32_t i = 0; i < 3; i++)
            for (int32_t k = 0; k < 3; k++) M[3 * i + k] = M[3 * i + k] - d[i] * d[k];
    }
    ath_principal(1, 3, M, work, moments, axes);
}

/* Rotations are weighted by their lever, so that an error moves the piece's vertices like any other coefficient's. */
ath_turning ath_turning_of(const ath_plan *plan, const ath_piece *piece, const ath_stream *stream)
{
    ath_turning turning = {{0.0}, {0.0}, (piece->flags & ATH_RIGID) != 0};
    double lever2 = squared_lever(plan, piece), moments[3], least = LEAST_MOMENT * lever2;
    double step = rotation_factor(piece, stream) * stream->step;
    if (!(lever2 > 0.0)) return turning;
    if (turning.own_axes) axes_of_inertia(plan, piece, lever2, moments, turning.axes);
    for (int32_t k = 0; k < 3; k++) {
        double moment = turning.own_axes ? moments[k] > least ? moments[k] : least : lever2 * 2.0 / 3.0;
        turning.steps[k] = step / ath_sqrt(moment);
        if (turning.own_axes && stream->turn_step > 0.0 && stream->turn_step < turning.steps[k])
            turning.steps[k] = stream->turn_step;
    }
    return turning;
}

void ath_turn_ratios(const ath_motion *motion, const ath_turning *turning, const double *coarse_steps,
                     uint32_t ratios[3])
{
    for (int32_t k = 0; k < 3; k++) {
        double ratio = coarse_steps ? coarse_steps[k] / turning->steps[k] + 0.5 : (double)motion->ratio;
        ratios[k] = ratio >= 65535.0 ? 65535 : ratio >= 1.0 ? (uint32_t)ratio : 1;
    }
}

void ath_into_axes(int32_t T, const ath_turning *turning, double *track)
{
    const double *A = turning->axes;
    for (int32_t t = 0; turning->own_axes && t < T; t++) {
        double x = track[t], y = track[T + t], z = track[2 * T + t];
        for (int32_t k = 0; k < 3; k++) track[k * T + t] = A[3 * k] * x + A[3 * k + 1] * y + A[3 * k + 2] * z;
    }
}

void ath_out_of_axes(int32_t T, const ath_turning *turning, double *track)
{
    const double *A = turning->axes;
    for (int32_t t = 0; turning->own_axes && t < T; t++) {
        double x = track[t], y = track[T + t], z = track[2 * T + t];
        for (int32_t k = 0; k < 3; k++) track[k * T + t] = A[k] * x + A[3 + k] * y + A[6 + k] * z;
    }
}

double ath_shift_step(const ath_piece *piece, const ath_stream *stream)
{
    return stream->step / ath_sqrt((double)piece->count);
}

static void inverse_track(const ath_stream *stream, int32_t T, int32_t count, double step, const int32_t *quantised,
                          double *track)
{
    for (int32_t axis = 0; axis < 3; axis++)
        ath_inverse_temporal(stream, T, count, step, quantised + axis * T, track + axis * T);
}

static void rotation_track(const ath_stream *stream, int32_t T, int32_t count, const ath_turning *turning,
                           const int32_t *quantised, double *track)
{
    for (int32_t axis = 0; axis < 3; axis++)
        ath_inverse_temporal(stream, T, count, turning->steps[axis], quantised + axis * T, track + axis * T);
    ath_out_of_axes(T, turning, track);
}

static int32_t count_of(const ath_piece_rows *rows, int32_t slot, const ath_stream *stream)
{
    return rows->counts ? rows->counts[slot] : stream->temporal_rank;
}

void ath_turned_attach(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                       const ath_scratch *scratch)
{
    int32_t T = motion->frames;
    const ath_piece *piece = plan->pieces + p;
    const ath_stream *base = ath_base_stream(motion, piece);
    ath_attach(plan, motion, piece, scratch->at);
    memset(scratch->rotation, 0, 6 * (size_t)T * sizeof(double));
    if (ath_has_shift(piece)) {
        inverse_track(base, T, count_of(rows, SHIFT_SLOT, base), ath_shift_step(piece, base), rows->shift,
                      scratch->shift);
        ath_move_point(T, scratch->shift, scratch->at.point);
    }
    if (ath_has_rotation(plan, piece, base)) {
        ath_turning turning = ath_turning_of(plan, piece, base);
        rotation_track(base, T, count_of(rows, ROTATION_SLOT, base), &turning, rows->rotation, scratch->rotation);
        ath_turn(T, scratch->rotation, scratch->at.rotation);
    }
}

static void inverse_row(const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows, int32_t r,
                        double *track)
{
    const ath_stream *stream = ath_mode_stream(motion, piece, r);
    inverse_track(stream, motion->frames, count_of(rows, r, stream), ath_row_step(motion, piece, rows, r),
                  ath_row(rows->modes, r, motion->frames), track);
}

static const double *place_used(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                                const ath_piece_rows *rows, const uint8_t *used, const ath_scratch *scratch)
{
    ath_scratch here = *scratch;
    if (piece->attach_cache >= 0) here.placed = cached_vertices(motion, piece);
    place(plan, motion, piece, rows, used, &here);
    carry(plan, motion, piece, &here);
    return here.placed;
}

static double *row_of(const ath_motion *motion, const ath_scratch *scratch, int32_t m)
{
    return scratch->rows + (size_t)m * 3 * (size_t)motion->frames;
}

const double *ath_pose_rows(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                            const ath_scratch *scratch)
{
    const ath_piece *piece = plan->pieces + p;
    uint8_t used[ATH_PIECE_VERTICES];
    for (int32_t m = 0; m < ath_rank(piece); m++)
        used[m] = (uint8_t)any_nonzero(row_of(motion, scratch, m), 3 * motion->frames);
    return place_used(plan, motion, piece, rows, used, scratch);
}

const double *ath_pose_piece(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                             const ath_scratch *scratch)
{
    ath_turned_attach(plan, motion, p, rows, scratch);
    return ath_pose_turned(plan, motion, p, rows, scratch);
}

const double *ath_pose_turned(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                              const ath_scratch *scratch)
{
    const ath_piece *piece = plan->pieces + p;
    uint8_t used[ATH_PIECE_VERTICES];
    for (int32_t m = 0; m < ath_rank(piece); m++) {
        used[m] = 0;
        if (rows->counts && rows->counts[m] == 0) continue;
        inverse_row(motion, piece, rows, m, row_of(motion, scratch, m));
        used[m] = (uint8_t)any_nonzero(row_of(motion, scratch, m), 3 * motion->frames);
    }
    return place_used(plan, motion, piece, rows, used, scratch);
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

double ath_node_step(int32_t exponent) { return half_octave(exponent); }

/* At right angles to the rows before it, of length 1, in floats. */
static void make_orthonormal(const double *rows, int32_t before, int32_t T, double *row)
{
    double length2 = 0.0;
    for (const double *other = rows; other < rows + (size_t)before * (size_t)T; other += T) {
        double shared = 0.0;
        for (int32_t t = 0; t < T; t++) shared = shared + other[t] * row[t];
        for (int32_t t = 0; t < T; t++) row[t] = row[t] - shared * other[t];
    }
    for (int32_t t = 0; t < T; t++) length2 = length2 + row[t] * row[t];
    double inverse = 1.0 / ath_sqrt(length2 > 1e-200 ? length2 : 1.0);
    for (int32_t t = 0; t < T; t++) row[t] = (double)ath_single(row[t] * inverse);
}

void ath_add_basis_rows(const double *waves, int32_t T, int32_t known, int32_t count, const int32_t *exponents,
                        const int32_t *integers, double *rows)
{
    ath_stream stream;
    memset(&stream, 0, sizeof stream);
    stream.temporal = waves;
    for (int32_t r = 0; r < count; r++) {
        double *row = rows + (size_t)(known + r) * (size_t)T;
        ath_inverse_temporal(&stream, T, T, half_octave(exponents[r]), integers + (size_t)r * (size_t)T, row);
        make_orthonormal(rows, known + r, T, row);
    }
}

ath_stream ath_node_stream(const ath_motion *motion, double step)
{
    ath_stream stream = {step, 0.0, motion->waves, motion->frames, -1, 0.0};
    return stream;
}

/* E += columns x functional: axis i of track r adds track[i] * functional[k] to E[i][k]. E: 9 rows. */
ATH_HOT static void add_outer(int32_t T, const double *track, const double functional[3], double *ATH_RESTRICT E)
{
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; k < 3; k++) {
            double *out = E + (3 * i + k) * T;
            for (int32_t t = 0; t < T; t++) out[t] = out[t] + track[i * T + t] * functional[k];
        }
}

void ath_affine_part(const ath_plan *plan, const ath_node *node, const double *mode, double g[3])
{
    const double *a = ath_rest_attach(plan, plan->pieces + node->piece);
    double moment[3] = {0.0, 0.0, 0.0};
    for (int32_t i = 0; i < node->count; i++) {
        const double *x0 = ath_rest_of(plan, node->first + i);
        for (int32_t k = 0; k < 3; k++) moment[k] = moment[k] + mode[i] * (x0[k] - a[k]);
    }
    for (int32_t k = 0; k < 3; k++) g[k] = 0.0;
    for (int32_t r = 0; r < node->rank; r++) {
        const double *w = node->whitening + 3 * r;
        double dot = (w[0] * moment[0] + w[1] * moment[1] + w[2] * moment[2]) / (double)node->count;
        for (int32_t k = 0; k < 3; k++) g[k] = g[k] + dot * w[k];
    }
}

static void coded_map(const ath_motion *motion, const ath_node *node, const ath_node_rows *rows,
                      const ath_scratch *scratch, int shifted, double *E)
{
    int32_t T = motion->frames;
    double step = ath_node_step(*rows->step);
    ath_stream stream = ath_node_stream(motion, step);
    if (shifted) {
        inverse_track(&stream, T, T, step, ath_row(rows->rows, 3, T), scratch->track);
        ath_move_point(T, scratch->track, scratch->at.point);
    }
    for (int32_t r = 0; r < node->rank; r++) {
        inverse_track(&stream, T, T, step, ath_row(rows->rows, r, T), scratch->track);
        add_outer(T, scratch->track, node->whitening + 3 * r, E);
    }
}

static void map_of_modes(const ath_plan *plan, const ath_motion *motion, const ath_node *node,
                         const ath_piece_rows *rows, const ath_scratch *scratch, double *E)
{
    const ath_piece *piece = plan->pieces + node->piece;
    for (int32_t m = 0; m < ath_min(piece->low_modes, ath_rank(piece)); m++) {
        double g[3];
        ath_affine_part(plan, node, plan->bases + piece->basis + (size_t)m * (size_t)piece->count, g);
        inverse_row(motion, piece, rows, m, scratch->track);
        add_outer(motion->frames, scratch->track, g, E);
    }
}

/* The affine part of a shape: that of its modes. */
static void map_of_shape(int32_t modes, double functionals[][3], const double *numbers, double G[9])
{
    for (int32_t k = 0; k < 9; k++) G[k] = 0.0;
    for (int32_t m = 0; m < modes; m++)
        for (int32_t i = 0; i < 3; i++)
            for (int32_t k = 0; k < 3; k++) G[3 * i + k] = G[3 * i + k] + numbers[3 * m + i] * functionals[m][k];
}

static void map_of_shapes(const ath_plan *plan, const ath_motion *motion, const ath_node *node,
                          const ath_piece_rows *rows, const ath_scratch *scratch, double *E)
{
    const ath_piece *piece = plan->pieces + node->piece;
    int32_t T = motion->frames, count = ath_min(rows->shape_count, ath_base_shapes(piece));
    double functionals[ATH_SHAPE_MODES][3];
    for (int32_t m = 0; m < ath_shape_modes(piece); m++)
        ath_affine_part(plan, node, plan->bases + piece->basis + (size_t)m * (size_t)piece->count, functionals[m]);
    for (int32_t s = 0; s < count; s++) {
        double G[9];
        const double *track = scratch->track + s % 3 * T;
        if (s % 3 == 0) inverse_row(motion, piece, rows, s / 3, scratch->track);
        map_of_shape(ath_shape_modes(piece), functionals, rows->shapes + s * ATH_SHAPE_NUMBERS, G);
        for (int32_t k = 0; k < 9; k++)
            for (int32_t t = 0; t < T; t++) E[k * T + t] = E[k * T + t] + track[t] * G[k];
    }
}

static int unit_shape(const int32_t *integers, double *shape)
{
    double length2 = 0.0;
    for (int32_t m = 0; m < ATH_SHAPE_MODES; m++)
        for (int32_t axis = 0; axis < 3; axis++) {
            double number = (double)integers[axis * ATH_SHAPE_MODES + m];
            shape[3 * m + axis] = number;
            length2 = length2 + number * number;
        }
    if (!(length2 > 0.0)) return 0;
    double scale = 1.0 / ath_sqrt(length2);
    for (int32_t i = 0; i < ATH_SHAPE_NUMBERS; i++) shape[i] = shape[i] * scale;
    return 1;
}

int ath_unit_shapes(int32_t count, const int32_t *integers, double *shapes)
{
    for (int32_t s = 0; s < count; s++)
        if (!unit_shape(integers + s * ATH_SHAPE_NUMBERS, shapes + s * ATH_SHAPE_NUMBERS)) return 0;
    return 1;
}

/* R := R (I + E) */
ATH_HOT static void compose(int32_t T, const double *E, double *ATH_RESTRICT R)
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

void ath_node_map(const ath_plan *plan, const ath_motion *motion, int32_t n, const ath_piece_rows *piece_rows,
                  const ath_node_rows *rows, const ath_scratch *scratch)
{
    const ath_node *node = plan->nodes + n;
    double *E = scratch->rows;
    for (int32_t i = 0; i < 9 * motion->frames; i++) E[i] = 0.0;
    if (node->coded) {
        ath_attach(plan, motion, plan->pieces + node->piece, scratch->at);
        coded_map(motion, node, rows, scratch, ath_has_shift(plan->pieces + node->piece), E);
    } else {
        ath_turned_attach(plan, motion, node->piece, piece_rows, scratch);
        if (piece_rows->shape_count > 0)
            map_of_shapes(plan, motion, node, piece_rows, scratch, E);
        else
            map_of_modes(plan, motion, node, piece_rows, scratch, E);
    }
    compose(motion->frames, E, scratch->at.rotation);
}

/* ---- refinements ---- */

/* Products of one track with waves k to k + PREDICTED - 1: each sum runs over the frames in order, side by side. */
enum { PREDICTED = 8 };

ATH_HOT static void project_waves(int32_t T, const double *waves, const double *track, double sums[PREDICTED])
{
    double sum[PREDICTED] = {0.0};
    for (int32_t t = 0; t < T; t++)
        for (int32_t i = 0; i < PREDICTED; i++) sum[i] = sum[i] + waves[i * T + t] * track[t];
    for (int32_t i = 0; i < PREDICTED; i++) sums[i] = sum[i];
}

static double wave_product(int32_t T, const double *wave, const double *track)
{
    double sum = 0.0;
    for (int32_t t = 0; t < T; t++) sum = sum + wave[t] * track[t];
    return sum;
}

static int32_t nearest_or_none(double units, double least)
{
    double magnitude = units < 0.0 ? -units : units;
    if (!(magnitude >= least)) return 0;
    int32_t whole = magnitude >= 536870911.0 ? 536870911 : (int32_t)(magnitude + 0.5);
    return units < 0.0 ? -whole : whole;
}

static int is_zero(const int32_t *integers, int32_t count)
{
    int32_t i = 0;
    for (; i + PREDICTED <= count; i += PREDICTED) {
        int32_t any = 0;
        for (int32_t j = 0; j < PREDICTED; j++) any |= integers[i + j];
        if (any) return 0;
    }
    for (; i < count; i++)
        if (integers[i] != 0) return 0;
    return 1;
}

void ath_predict_track(const ath_stream *stream, int32_t T, int32_t frequencies, const double steps[3],
                       const uint32_t ratios[3], const double *track, const int32_t *coarse, int32_t *predicted)
{
    int32_t count = ath_min(frequencies, stream->temporal_rank);
    memset(predicted, 0, 3 * (size_t)T * sizeof *predicted);
    for (int32_t axis = 0; axis < 3 && count > 0; axis++) {
        const double *row = track + axis * T;
        double least = coarse ? 0.5 : 0.5 * (double)ratios[axis];
        int32_t k = 0, any = 0;
        for (int32_t t = 0; t < T && !any; t++) any = row[t] != 0.0;
        if (!any) continue;
        const int32_t *known = coarse ? coarse + axis * T : 0;
        for (; k < count; k += PREDICTED) {
            double sums[PREDICTED];
            int32_t stop = ath_min(k + PREDICTED, count), first = ath_min(k, stream->temporal_rank - PREDICTED);
            if (first < 0) break;
            if (known && is_zero(known + k, stop - k)) continue;
            project_waves(T, stream->temporal + (size_t)first * (size_t)T, row, sums);
            for (int32_t i = k; i < stop; i++)
                predicted[axis * T + i] = nearest_or_none(sums[i - first] / steps[axis], least);
        }
        for (; k < count; k++)
            predicted[axis * T + k] =
                nearest_or_none(wave_product(T, stream->temporal + (size_t)k * (size_t)T, row) / steps[axis], least);
        for (k = 0; known && k < count; k++)
            if (known[k] == 0) predicted[axis * T + k] = 0;
    }
}

/* out = R^T (x - c) - d */
ATH_INLINE void into_rest_space(int32_t T, const ath_frames *at, const double *x, const double d[3],
                                double *ATH_RESTRICT out)
{
    const double *R = at->rotation, *c = at->point;
    for (int32_t t = 0; t < T; t++) {
        double dx = x[t] - c[t], dy = x[T + t] - c[T + t], dz = x[2 * T + t] - c[2 * T + t];
        out[t] = R[t] * dx + R[3 * T + t] * dy + R[6 * T + t] * dz - d[0];
        out[T + t] = R[T + t] * dx + R[4 * T + t] * dy + R[7 * T + t] * dz - d[1];
        out[2 * T + t] = R[2 * T + t] * dx + R[5 * T + t] * dy + R[8 * T + t] * dz - d[2];
    }
}

ATH_HOT void ath_into_rest_space(int32_t T, const ath_frames *at, const double *x, double *ATH_RESTRICT out)
{
    static const double nothing[3] = {0.0, 0.0, 0.0};
    into_rest_space(T, at, x, nothing, out);
}

ATH_HOT void ath_to_local(const ath_plan *plan, int32_t T, const ath_piece *piece, const ath_frames *at,
                          const double *placed, double *local)
{
    const double *a = ath_rest_attach(plan, piece);
    for (int32_t i = 0; i < piece->count; i++) {
        const double *x0 = ath_rest_of(plan, piece->first + i);
        double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
        into_rest_space(T, at, placed + (size_t)i * 3 * (size_t)T, d, local + (size_t)i * 3 * (size_t)T);
    }
}

/* row = sum over the vertices of what each counts in a mode times its track. */
ATH_HOT static void project_modes(const ath_plan *plan, int32_t T, const ath_piece *piece, int32_t first, int32_t stop,
                                  const double *local, double *ATH_RESTRICT rows)
{
    double weight[ATH_PIECE_VERTICES], tip = ath_tip_weight(piece, plan->rest);
    const double *x[ATH_PIECE_VERTICES];
    int32_t last = piece->count - 1, count;
    for (int32_t from = 0; from < 3 * T; from += count) {
        count = ath_min(PROJECTED_NUMBERS, 3 * T - from);
        for (int32_t v = 0; v <= last; v++) x[v] = local + (size_t)v * 3 * (size_t)T + from;
        for (int32_t m = first; m < stop; m++) {
            const double *mode = plan->bases + piece->basis + (size_t)m * (size_t)piece->count;
            for (int32_t v = 0; v <= last; v++) weight[v] = v == last ? mode[v] * tip : mode[v];
            lanes_sum(count, piece->count, weight, x, 0.0, rows + (size_t)m * 3 * (size_t)T + from);
        }
    }
}

void ath_project(const ath_plan *plan, int32_t T, const ath_piece *piece, int32_t count, const double *local,
                 double *ATH_RESTRICT rows)
{
    project_modes(plan, T, piece, 0, count, local, rows);
}

/* The unit quaternion of a rotation matrix, of the two the one nearer to the last. */
static void to_quaternion(const double R[9], double q[4])
{
    double size[4] = {1.0 + R[0] + R[4] + R[8], 1.0 + R[0] - R[4] - R[8], 1.0 - R[0] + R[4] - R[8],
                      1.0 - R[0] - R[4] + R[8]};
    double symmetric[6] = {R[7] - R[5], R[2] - R[6], R[3] - R[1], R[1] + R[3], R[2] + R[6], R[5] + R[7]};
    static const int8_t row[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};
    int32_t largest = 0;
    double p[4], length2 = 0.0, towards = 0.0;
    for (int32_t i = 1; i < 4; i++)
        if (size[i] > size[largest]) largest = i;
    for (int32_t i = 0; i < 4; i++) {
        p[i] = i == largest ? size[i] : symmetric[row[largest][i]];
        length2 = length2 + p[i] * p[i];
        towards = towards + p[i] * q[i];
    }
    double scale = (towards < 0.0 ? -1.0 : 1.0) / ath_sqrt(length2);
    for (int32_t i = 0; i < 4; i++) q[i] = p[i] * scale;
}

void ath_rotation_vector(const double R[9], double q[4], double omega[3])
{
    to_quaternion(R, q);
    if (q[0] < -0.9) /* beyond about 310 degrees: the same rotation the other way round */
        for (int32_t i = 0; i < 4; i++) q[i] = -q[i];
    for (int32_t k = 0; k < 3; k++) omega[k] = 4.0 * q[k + 1] / (1.0 + q[0]);
}

/* From the rotations `from`, 9 x frames, to others. */
static void rotations_between(int32_t T, const double *from, const double *to, double *omega)
{
    double q[4] = {1.0, 0.0, 0.0, 0.0};
    for (int32_t t = 0; t < T; t++) {
        double R[9], own[3];
        for (int32_t i = 0; i < 3; i++)
            for (int32_t k = 0; k < 3; k++)
                R[3 * i + k] = from[i * T + t] * to[k * T + t] + from[(3 + i) * T + t] * to[(3 + k) * T + t]
                               + from[(6 + i) * T + t] * to[(6 + k) * T + t];
        ath_rotation_vector(R, q, own);
        for (int32_t k = 0; k < 3; k++) omega[k * T + t] = own[k];
    }
}

static void predict_evenly(const ath_stream *stream, const ath_motion *motion, int32_t frequencies, double step,
                           const double *track, const int32_t *coarse, int32_t *predicted)
{
    uint32_t ratio = (uint32_t)motion->ratio, ratios[3] = {ratio, ratio, ratio};
    double steps[3] = {step, step, step};
    ath_predict_track(stream, motion->frames, frequencies, steps, ratios, track, coarse, predicted);
}

void ath_predict_shift(const ath_motion *motion, const ath_piece *piece, const ath_piece_before *before,
                       const ath_scratch *scratch, ath_piece_rows *rows)
{
    const ath_stream *stream = ath_base_stream(motion, piece);
    const double *track = before->shift;
    if (before->frames && before->frequencies > 0) {
        for (int32_t i = 0; i < 3 * motion->frames; i++) scratch->shift[i] = before->frames[i] - scratch->at.point[i];
        track = scratch->shift;
    }
    predict_evenly(stream, motion, before->frequencies, ath_shift_step(piece, stream), track, rows->coarse_shift,
                   rows->predicted_shift);
}

void ath_predict_rotation(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                          const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows)
{
    const ath_stream *stream = ath_base_stream(motion, piece);
    ath_turning turning = ath_turning_of(plan, piece, stream);
    int32_t T = motion->frames;
    uint32_t ratios[3];
    const double *track = before->rotation;
    ath_turn_ratios(motion, &turning, rows->coarse_turn_steps, ratios);
    if (before->frames && before->frequencies > 0) {
        rotations_between(T, scratch->at.rotation, before->frames + 3 * (size_t)T, scratch->rotation);
        ath_into_axes(T, &turning, scratch->rotation);
        track = scratch->rotation;
    }
    ath_predict_track(stream, T, before->frequencies, turning.steps, ratios, track, rows->coarse_rotation,
                      rows->predicted_rotation);
}

void ath_predict_tracks(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                        const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows)
{
    if (before->frames) ath_attach(plan, motion, piece, scratch->at);
    if (ath_has_shift(piece)) ath_predict_shift(motion, piece, before, scratch, rows);
    if (ath_has_rotation(plan, piece, ath_base_stream(motion, piece)))
        ath_predict_rotation(plan, motion, piece, before, scratch, rows);
}

/* Three tracks of shapes at a time: the products of the modes with each. */
ATH_HOT static void shape_tracks(int32_t T, const ath_piece *piece, const ath_piece_rows *rows, int32_t r,
                                 const double *modes, double *track)
{
    int32_t count = 3 * ath_shape_modes(piece);
    const double *x[ATH_SHAPE_NUMBERS];
    for (int32_t j = 0; j < count; j++) x[j] = modes + (size_t)j * (size_t)T;
    for (int32_t s = 3 * r; s < 3 * r + 3; s++, track += T)
        lanes_sum(T, s < rows->shape_count ? count : 0, rows->shapes + s * ATH_SHAPE_NUMBERS, x, 0.0, track);
}

void ath_predict_modes(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_before *before, const ath_scratch *scratch, ath_piece_rows *rows)
{
    int32_t T = motion->frames, modes = before->frequencies > 0 ? ath_min(before->modes, ath_rank(piece)) : 0;
    if (modes > 0 && rows->shape_count > 0) modes = ath_max(modes, ath_shape_modes(piece));
    if (modes > 0) {
        ath_to_local(plan, T, piece, &scratch->at, before->placed, scratch->placed);
        if (rows->shape_count > 0) ath_project(plan, T, piece, modes, scratch->placed, scratch->rows);
    }
    for (int32_t r = 0; r < modes; r++) {
        const ath_stream *stream = ath_mode_stream(motion, piece, r);
        const int32_t *coarse = rows->coarse_modes ? rows->coarse_modes + (size_t)r * 3 * (size_t)T : 0;
        double *track = scratch->rows + (size_t)r * 3 * (size_t)T;
        int has_prediction = !coarse || !is_zero(coarse, 3 * T);
        if (has_prediction && rows->shape_count == 0)
            project_modes(plan, T, piece, r, r + 1, scratch->placed, scratch->rows);
        if (has_prediction && ath_is_shape_row(piece, rows, r)) {
            shape_tracks(T, piece, rows, r, scratch->rows, scratch->track);
            track = scratch->track;
        }
        predict_evenly(stream, motion, has_prediction ? before->frequencies : 0, ath_row_step(motion, piece, rows, r),
                       track, coarse, ath_row(rows->predicted_modes, r, T));
    }
    for (int32_t r = modes; r < ath_rank(piece); r++)
        memset(ath_row(rows->predicted_modes, r, T), 0, 3 * (size_t)T * sizeof(int32_t));
}

int32_t ath_row_extent(const int32_t *row, int32_t T, int32_t most)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3; axis++) {
        const int32_t *own = row + axis * T;
        int32_t k = most;
        while (k - count >= PREDICTED && is_zero(own + k - PREDICTED, PREDICTED)) k -= PREDICTED;
        while (k > count && own[k - 1] == 0) k--;
        count = k;
    }
    return count;
}
