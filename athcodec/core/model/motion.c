/* From quantised coefficients to positions (FORMAT.md, "Reconstruction"), piece by piece, parents first. A piece is
 * placed from the decoded vertices that it hangs on, in doubles, in the order written here. */
#include "model/motion.h"
#include "model/basis.h"
#include "model/lanes.h"
#include "model/rotations.h"

enum { POLAR_ITERATIONS = 4, ATH_TERMS = ATH_SHAPE_NUMBERS + ATH_PIECE_VERTICES - ATH_SHAPE_MODES };
enum { PLACED_VERTICES = 4 * ATH_LANES, PLACED_FRAMES = 2 * ATH_LANES };

static const double LEAST_MOMENT =
    0.0009765625; /* smallest moment of inertia that sets a rotation step, over the sum of all moments */

/* A map needs four rows. */
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
    if (!(parent->flags & (ATH_SHEET | ATH_RIGID | ATH_STILL))) {
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
            ath_follow_tangents(T, tangent, from, to, base.rotation, at.rotation);
            return;
        }
    }
    copy_rows(at.rotation, base.rotation, 9 * (size_t)T);
}

/* The sum runs over k ascending and leaves out integers of 0. */
ATH_HOT void ath_inverse_temporal(const ath_stream *stream, int32_t T, int32_t count, double step,
                                  const int32_t *quantised, double *row)
{
    double value[ATH_SEGMENT_FRAMES];
    const double *wave[ATH_SEGMENT_FRAMES];
    int32_t used = 0;
    for (int32_t k = 0; k < count; k++) {
        value[used] = (double)quantised[k] * step; /* no branch, which would be mispredicted */
        wave[used] = stream->temporal + (size_t)k * (size_t)T;
        used += quantised[k] != 0;
    }
    lanes_sum(T, used, value, wave, 0.0, row);
}

void ath_move_point(int32_t T, const double *track, double *point)
{
    for (int32_t i = 0; i < 3 * T; i++) point[i] = point[i] + track[i];
}

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

/* The tracks over time that place a piece. A mode has three, one behind the other. */
typedef struct {
    const double *track[ATH_TERMS];
    int32_t shape[ATH_TERMS]; /* shapes of the first shape_count terms, which have one track for all axes */
    int32_t mode[ATH_TERMS];  /* modes of the other terms */
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

/* A few vertices side by side: rest positions less the attach point, and how far each term moves them. Shapes have a
 * row of weights per axis, the modes behind them one each. */
typedef struct {
    double rest[3][PLACED_VERTICES], weight[3 * ATH_SHAPE_NUMBERS + ATH_PIECE_VERTICES][PLACED_VERTICES];
} placed_vertices;

ATH_INLINE void weigh_terms(const ath_plan *plan, const ath_piece *piece, const ath_piece_rows *rows,
                            const placing_terms *terms, const int32_t *place, int32_t count, placed_vertices *vertices)
{
    const double *basis = plan->bases + piece->basis, *a = ath_rest_attach(plan, piece);
    double mode[ATH_SHAPE_MODES][PLACED_VERTICES];
    for (int32_t i = 0; i < count; i++) {
        const double *x0 = ath_rest_of(plan, piece->first + place[i]);
        for (int32_t k = 0; k < 3; k++) vertices->rest[k][i] = x0[k] - a[k];
    }
    if (terms->shape_count > 0)
        for (int32_t m = 0; m < ath_shape_modes(piece); m++)
            for (int32_t i = 0; i < PLACED_VERTICES; i++)
                mode[m][i] = i < count ? basis[m * piece->count + place[i]] : 0.0;
    for (int32_t j = 0; j < terms->shape_count; j++)
        for (int32_t v = 0; v < PLACED_VERTICES; v += ATH_LANES)
            lanes_of_shape(ath_shape_modes(piece), rows->shapes + terms->shape[j] * ATH_SHAPE_NUMBERS, mode[0] + v,
                           PLACED_VERTICES, vertices->weight[3 * j] + v, PLACED_VERTICES);
    for (int32_t j = terms->shape_count; j < terms->count; j++)
        for (int32_t i = 0; i < count; i++)
            vertices->weight[2 * terms->shape_count + j][i] = basis[terms->mode[j] * piece->count + place[i]];
}

/* Sums the terms of vertex v in PLACED_FRAMES frames from t on. */
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
        lanes_add_scaled(&x0, vertices->weight[3 * j][v], track);
        lanes_add_scaled(&x1, vertices->weight[3 * j][v], track + ATH_LANES);
        lanes_add_scaled(&y0, vertices->weight[3 * j + 1][v], track);
        lanes_add_scaled(&y1, vertices->weight[3 * j + 1][v], track + ATH_LANES);
        lanes_add_scaled(&z0, vertices->weight[3 * j + 2][v], track);
        lanes_add_scaled(&z1, vertices->weight[3 * j + 2][v], track + ATH_LANES);
    }
    for (; j < terms->count; j++) {
        const double *track = terms->track[j] + t;
        double weight = vertices->weight[2 * terms->shape_count + j][v];
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

/* x := c + R x for `count` vertices in ATH_LANES frames. Vertex i goes to row 3 place[i] and the two behind it. */
ATH_INLINE void move_vertices(int32_t T, const int32_t *place, int32_t count, const double *R, const double *c,
                              double sums[][3][PLACED_FRAMES], int32_t from, double *out, int32_t row_size)
{
    ath_lanes rows[3][3], centre[3], x[3];
    for (int32_t k = 0; k < 3; k++) {
        for (int32_t j = 0; j < 3; j++) lanes_load(&rows[k][j], R + (3 * k + j) * T);
        lanes_load(&centre[k], c + k * T);
    }
    for (int32_t i = 0; i < count; i++) {
        for (int32_t k = 0; k < 3; k++) lanes_load(&x[k], sums[i][k] + from);
        for (int32_t k = 0; k < 3; k++) lanes_move(out + (3 * place[i] + k) * row_size, &centre[k], rows[k], x);
    }
}

ATH_INLINE void place_frame(int32_t t, const placing_terms *terms, const placed_vertices *vertices, int32_t v,
                            const ath_frames *at, double *out)
{
    int32_t T = terms->frames, shapes = terms->shape_count;
    const double *R = at->rotation + t, *c = at->point + t;
    double x[3];
    for (int32_t k = 0; k < 3; k++) {
        x[k] = vertices->rest[k][v];
        for (int32_t j = 0; j < shapes; j++) x[k] = x[k] + vertices->weight[3 * j + k][v] * terms->track[j][t];
        for (int32_t j = shapes; j < terms->count; j++)
            x[k] = x[k] + vertices->weight[2 * shapes + j][v] * terms->track[j][k * T + t];
    }
    for (int32_t k = 0; k < 3; k++, R += 3 * T)
        out[k * T + t] = c[k * T] + (R[0] * x[0] + R[T] * x[1] + R[2 * T] * x[2]);
}

/* Prefetches the memory behind rows of positions in a frame, which the next ones fill. */
ATH_INLINE void expect_rows(int32_t rows, const float *out)
{
    for (size_t behind = 16; behind <= 3 * PLACED_VERTICES; behind += 16)
        ath_expect_write((uintptr_t)out + ((size_t)rows + behind - 1) * sizeof *out);
}

/* Puts rows of PLACED_FRAMES positions into frames. */
ATH_INLINE void put_into_frames(int32_t rows, const double *from, int32_t row_size, const double *added, float *out,
                                size_t frame_size)
{
    for (int32_t r = 0; rows >= ATH_LANES && r < rows; r += ATH_LANES) {
        int32_t row = ath_min(r, rows - ATH_LANES);
        for (size_t t = 0; t < PLACED_FRAMES; t += ATH_LANES)
            lanes_transpose(from + row * row_size + t, (size_t)row_size, added + row % 3, out + t * frame_size + row,
                            frame_size);
    }
    for (int32_t r = 0; rows < ATH_LANES && r < rows; r++)
        for (size_t t = 0; t < PLACED_FRAMES; t++)
            out[t * frame_size + (size_t)r] = (float)(from[(size_t)(r * row_size) + t] + added[r]);
}

/* placed = c + R (x0 - a + sum over terms of weight * track), shapes first, without tracks of zeros. A few vertices
 * pass through a few frames at a time, while tracks and attach frames stay in the innermost cache. wanted: bit v asks
 * for vertex v. to: null, or the destination of all vertices, whose rows are then kept only for pieces behind. */
ATH_HOT static void place(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                          const ath_piece_rows *rows, const uint8_t *used, uint64_t wanted, const ath_scratch *scratch,
                          const ath_float_frames *to)
{
    int32_t T = motion->frames, places[ATH_PIECE_VERTICES], total = 0, count;
    placing_terms terms = terms_of(piece, rows, T, used, scratch->rows);
    placed_vertices vertices;
    double sums[PLACED_VERTICES][3][PLACED_FRAMES], tile[3 * PLACED_VERTICES * PLACED_FRAMES], added[3 + ATH_LANES];
    double *out = scratch->placed;
    const double *R = scratch->at.rotation, *c = scratch->at.point;
    int kept = !to || piece->attach_cache >= 0;
    for (int32_t v = 0; v < piece->count; v++)
        if (wanted >> v & 1) places[total++] = v;
    for (int32_t i = 0; to && i < 3 + ATH_LANES; i++) added[i] = to->origin[i % 3];
    for (const int32_t *at = places; at < places + total; at += count) {
        count = ath_min(PLACED_VERTICES, total - (int32_t)(at - places));
        weigh_terms(plan, piece, rows, &terms, at, count, &vertices);
        for (int32_t start = 0; T >= PLACED_FRAMES && start < T; start += PLACED_FRAMES) {
            int32_t t = ath_min(start, T - PLACED_FRAMES), row_size = kept ? T : PLACED_FRAMES;
            double *moved = kept ? out + t : tile;
            float *first = to ? to->first + (size_t)t * to->frame_size + 3 * at[0] : 0;
            for (int32_t i = 0; i < count; i++) {
                if (to && i < PLACED_FRAMES) expect_rows(3 * count, first + (size_t)i * to->frame_size);
                add_terms(t, &terms, &vertices, i, sums[i]);
            }
            for (int32_t from = 0; from < PLACED_FRAMES; from += ATH_LANES)
                move_vertices(T, kept ? at : places, count, R + t + from, c + t + from, sums, from, moved + from,
                              row_size);
            if (to)
                put_into_frames(3 * count, moved + (kept ? 3 * at[0] * T : 0), row_size, added, first, to->frame_size);
        }
        for (int32_t t = 0; T < PLACED_FRAMES && t < T; t++)
            for (int32_t i = 0; i < count; i++) {
                double *x = out + at[i] * 3 * T;
                place_frame(t, &terms, &vertices, i, &scratch->at, x);
                for (int32_t k = 0; to && k < 3; k++)
                    to->first[(size_t)t * to->frame_size + (size_t)(3 * at[i] + k)] = (float)(x[k * T + t] + added[k]);
            }
    }
}

/* Takes one step of Newton's method from R towards the rotation nearest to H, which has a Frobenius norm of 1. With C =
 * H R', the turn omega solves (trace(C) - sym(C)) omega = axial(C). Far from that rotation the trace is small, and 1 in
 * its place keeps the matrix positive definite. */
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

/* Fills the rotation nearest to a sheet's decoded vertices, with its own R as the prior. */
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

static int turns_with_sheet(const ath_piece *piece)
{
    return (piece->flags & (ATH_SHEET | ATH_RIGID | ATH_STILL)) == ATH_SHEET;
}

static void carry(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece, const ath_scratch *scratch)
{
    int32_t T = motion->frames;
    if (piece->attach_cache < 0) return;
    ath_frames at = cached_frames(motion, piece);
    copy_rows(at.point, scratch->at.point, 3 * (size_t)T);
    if (turns_with_sheet(piece))
        turn_with_sheet(plan, T, piece, scratch, at.rotation);
    else
        copy_rows(at.rotation, scratch->at.rotation, 9 * (size_t)T);
}

/* Returns the sum of the vertices' squared distances from the attach point. */
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

/* Fills the principal axes and moments of inertia about the attach point, the largest moment first. */
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

/* A rotation's step is divided by its lever, so that its error moves vertices like any coefficient's. */
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

/* Number k of a vector becomes its product with the numbers from k * row on, `step` apart. */
static void change_axes(int32_t T, const ath_turning *turning, int32_t row, int32_t step, double *track)
{
    for (int32_t t = 0; turning->own_axes && t < T; t++) {
        double x = track[t], y = track[T + t], z = track[2 * T + t];
        const double *A = turning->axes;
        for (int32_t k = 0; k < 3; k++, A += row) track[k * T + t] = A[0] * x + A[step] * y + A[2 * step] * z;
    }
}

void ath_into_axes(int32_t T, const ath_turning *turning, double *track) { change_axes(T, turning, 3, 1, track); }
void ath_out_of_axes(int32_t T, const ath_turning *turning, double *track) { change_axes(T, turning, 1, 3, track); }

double ath_shift_step(const ath_piece *piece, const ath_stream *stream)
{
    return stream->step / ath_sqrt((double)piece->count);
}

double ath_node_step(int32_t exponent)
{
    double value = exponent & 1 ? 1.4142135623730951 : 1.0;
    int32_t doublings = (exponent - (exponent & 1)) / 2;
    for (; doublings > 0; doublings--) value = value * 2.0;
    for (; doublings < 0; doublings++) value = value * 0.5;
    return value;
}

void ath_inverse_track(const ath_stream *stream, int32_t T, int32_t count, double step, const int32_t *quantised,
                       double *track)
{
    for (int32_t axis = 0; axis < 3; axis++)
        ath_inverse_temporal(stream, T, count, step, quantised + axis * T, track + axis * T);
}

static int32_t count_of(const ath_piece_rows *rows, int32_t slot, const ath_stream *stream)
{
    return rows->counts ? rows->counts[slot] : stream->temporal_rank;
}

void ath_turn_attached(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_rows *rows, const ath_scratch *scratch)
{
    int32_t T = motion->frames;
    const ath_stream *base = ath_base_stream(motion, piece);
    if (ath_has_shift(piece)) {
        ath_inverse_track(base, T, count_of(rows, SHIFT_SLOT, base), ath_shift_step(piece, base), rows->shift,
                          scratch->shift);
        ath_move_point(T, scratch->shift, scratch->at.point);
    }
    if (ath_has_rotation(plan, piece, base)) {
        ath_turning turning = ath_turning_of(plan, piece, base);
        for (int32_t axis = 0; axis < 3; axis++)
            ath_inverse_temporal(base, T, count_of(rows, ROTATION_SLOT, base), turning.steps[axis],
                                 rows->rotation + axis * T, scratch->rotation + axis * T);
        ath_out_of_axes(T, &turning, scratch->rotation);
        ath_turn(T, scratch->rotation, scratch->at.rotation);
    }
}

void ath_turned_attach(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                       const ath_scratch *scratch)
{
    ath_attach(plan, motion, plan->pieces + p, scratch->at);
    ath_turn_attached(plan, motion, plan->pieces + p, rows, scratch);
}

void ath_inverse_row(const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows, int32_t r,
                     double *track)
{
    const ath_stream *stream = ath_mode_stream(motion, piece, r);
    ath_inverse_track(stream, motion->frames, count_of(rows, r, stream), ath_row_step(motion, piece, rows, r),
                      ath_row(rows->modes, r, motion->frames), track);
}

const double *ath_pose_used(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                            const ath_piece_rows *rows, const uint8_t *used, uint64_t wanted,
                            const ath_scratch *scratch, const ath_float_frames *to)
{
    ath_scratch here = *scratch;
    if (piece->attach_cache >= 0) here.placed = cached_vertices(motion, piece);
    place(plan, motion, piece, rows, used, turns_with_sheet(piece) ? ATH_ALL_VERTICES : wanted, &here, to);
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
    return ath_pose_used(plan, motion, piece, rows, used, ATH_ALL_VERTICES, scratch, 0);
}

const double *ath_pose_piece(const ath_plan *plan, const ath_motion *motion, int32_t p, const ath_piece_rows *rows,
                             const ath_scratch *scratch)
{
    uint8_t used[ATH_PIECE_VERTICES];
    ath_turned_attach(plan, motion, p, rows, scratch);
    ath_pose_tracks(motion, plan->pieces + p, rows, scratch, used);
    return ath_pose_used(plan, motion, plan->pieces + p, rows, used, ATH_ALL_VERTICES, scratch, 0);
}

void ath_pose_tracks(const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows,
                     const ath_scratch *scratch, uint8_t *used)
{
    for (int32_t m = 0; m < ath_rank(piece); m++) {
        used[m] = 0;
        if (rows->counts && rows->counts[m] == 0) continue;
        ath_inverse_row(motion, piece, rows, m, row_of(motion, scratch, m));
        used[m] = (uint8_t)any_nonzero(row_of(motion, scratch, m), 3 * motion->frames);
    }
}

/* Makes a row orthogonal to those before, of length 1, and rounds it to floats. */
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
        ath_inverse_temporal(&stream, T, T, ath_node_step(exponents[r]), integers + (size_t)r * (size_t)T, row);
        make_orthonormal(rows, known + r, T, row);
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
