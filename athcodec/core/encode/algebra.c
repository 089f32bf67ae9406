/* Products and decompositions of small matrices for the encoder, summed in one order: BLAS and LAPACK give other bits
 * with other processors and threads. Maps of pieces are fitted with them (motion/affine_fit.py). */
#include "encode/encode.h"

enum { MOST_SWEEPS = 40, SUMS = 12, LINKS = 5, SHAPE = 21 };

static const double IDENTITY[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
/* Least stretch of any direction in a map, relative to its largest where that is below 1. A frame in which the best fit
 * flattens a subtree would otherwise have no inverse, or residuals many times as long as the map's error. */
static const double MIN_STRETCH = 0.1;
static const double LEAST_SCALE = 1e-2; /* smallest stretch that MIN_STRETCH is relative to: subtrees may shrink */

ATH_HOT void ath_multiply(int64_t count, int64_t rows, int64_t inner, int64_t columns, const double *a, int64_t a_step,
                          const double *b, int64_t b_step, double *ATH_RESTRICT out)
{
    for (int64_t i = 0; i < count; i++, a += a_step, b += b_step)
        for (int64_t r = 0; r < rows; r++, out += columns) {
            for (int64_t c = 0; c < columns; c++) out[c] = 0.0;
            for (int64_t k = 0; k < inner; k++) {
                double factor = a[r * inner + k];
                for (int64_t c = 0; c < columns; c++) out[c] += factor * b[k * columns + c];
            }
        }
}

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double magnitude(double number) { return number < 0.0 ? -number : number; }

static void cross(const double *a, const double *b, double *out)
{
    for (int32_t i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static void turn_rows(double c, double s, double *a, double *b)
{
    for (int32_t i = 0; i < 3; i++) {
        double x = a[i], y = b[i];
        a[i] = c * x - s * y;
        b[i] = s * x + c * y;
    }
}

/* Makes two rows of w orthogonal and turns the rows of v alike. Returns 0 if they were orthogonal. */
static int make_orthogonal(double *w, double *v, int32_t p, int32_t q)
{
    double *a = w + 3 * p, *b = w + 3 * q, both = dot3(a, b), a2 = dot3(a, a), b2 = dot3(b, b);
    if (!(magnitude(both) > 1e-16 * ath_sqrt(a2) * ath_sqrt(b2))) return 0;
    double zeta = (b2 - a2) / (2.0 * both);
    double tangent = (zeta < 0.0 ? -1.0 : 1.0) / (magnitude(zeta) + ath_sqrt(1.0 + zeta * zeta));
    double c = 1.0 / ath_sqrt(1.0 + tangent * tangent);
    turn_rows(c, c * tangent, a, b);
    turn_rows(c, c * tangent, v + 3 * p, v + 3 * q);
    return 1;
}

static void swap_rows(double *a, double *b)
{
    for (int32_t i = 0; i < 3; i++) {
        double number = a[i];
        a[i] = b[i];
        b[i] = number;
    }
}

/* Fills a unit vector at right angles to a unit vector. */
static void any_across(const double *a, double *out)
{
    int32_t least = 0;
    double axis[3] = {0.0, 0.0, 0.0};
    for (int32_t i = 1; i < 3; i++)
        if (magnitude(a[i]) < magnitude(a[least])) least = i;
    axis[least] = 1.0;
    cross(a, axis, out);
    double length = ath_sqrt(dot3(out, out));
    for (int32_t i = 0; i < 3; i++) out[i] /= length;
}

/* Normalises rows of falling length. A row that is too short is replaced by one that completes the others. */
static void make_units(double *w, double stretch[3])
{
    double least = 1e-14 * stretch[0];
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; stretch[i] > least && k < 3; k++) w[3 * i + k] /= stretch[i];
    if (!(stretch[0] > 0.0)) {
        w[0] = 1.0;
        w[1] = w[2] = 0.0;
    }
    if (!(stretch[1] > least)) any_across(w, w + 3);
    if (!(stretch[2] > least)) cross(w, w + 3, w + 6);
}

/* One-sided Jacobi rotations (Hestenes 1958) of the columns, kept as rows. */
static void decompose(const double *matrix, double *left, double stretch[3], double *right)
{
    double w[9], most = 0.0;
    for (int32_t i = 0; i < 9; i++) {
        w[i] = matrix[3 * (i % 3) + i / 3];
        right[i] = i % 4 == 0 ? 1.0 : 0.0;
        if (magnitude(w[i]) > most) most = magnitude(w[i]);
    }
    double scale = most > 0.0 ? most : 1.0; /* keeps squares from vanishing or overflowing */
    for (int32_t i = 0; i < 9; i++) w[i] /= scale;
    for (int32_t sweep = 0, turned = 1; turned && sweep < MOST_SWEEPS; sweep++) {
        turned = make_orthogonal(w, right, 0, 1);
        turned |= make_orthogonal(w, right, 0, 2);
        turned |= make_orthogonal(w, right, 1, 2);
    }
    for (int32_t i = 0; i < 3; i++) stretch[i] = ath_sqrt(dot3(w + 3 * i, w + 3 * i));
    for (int32_t i = 0; i < 3; i++)
        for (int32_t k = 0; k < 2; k++)
            if (stretch[k] < stretch[k + 1]) {
                double length = stretch[k];
                stretch[k] = stretch[k + 1];
                stretch[k + 1] = length;
                swap_rows(w + 3 * k, w + 3 * k + 3);
                swap_rows(right + 3 * k, right + 3 * k + 3);
            }
    make_units(w, stretch);
    for (int32_t i = 0; i < 9; i++) left[i] = w[3 * (i % 3) + i / 3];
    for (int32_t i = 0; i < 3; i++) stretch[i] *= scale;
}

void ath_decompose(int64_t count, const double *matrices, double *left, double *stretch, double *right)
{
    for (int64_t i = 0; i < count; i++) decompose(matrices + 9 * i, left + 9 * i, stretch + 3 * i, right + 9 * i);
}

/* Replaces the lower triangle of a positive definite matrix by its Cholesky factor. */
static void factorise(int32_t n, double *matrix)
{
    for (int32_t i = 0; i < n; i++)
        for (int32_t j = 0; j <= i; j++) {
            double left = matrix[i * n + j];
            for (int32_t k = 0; k < j; k++) left -= matrix[i * n + k] * matrix[j * n + k];
            matrix[i * n + j] = i == j ? ath_sqrt(left) : left / matrix[j * n + j];
        }
}

static void solve(int32_t n, int32_t columns, double *matrix, double *rows)
{
    factorise(n, matrix);
    for (int32_t pass = 0; pass < 2; pass++)
        for (int32_t step = 0; step < n; step++) {
            int32_t i = pass ? n - 1 - step : step;
            double *row = rows + (size_t)i * (size_t)columns;
            for (int32_t k = pass ? i + 1 : 0; k < (pass ? n : i); k++) {
                double factor = pass ? matrix[k * n + i] : matrix[i * n + k];
                for (int32_t c = 0; c < columns; c++) row[c] -= factor * rows[(size_t)k * (size_t)columns + (size_t)c];
            }
            for (int32_t c = 0; c < columns; c++) row[c] /= matrix[i * n + i];
        }
}

ATH_HOT void ath_solve(int64_t count, int32_t n, int32_t columns, double *matrices, double *rows)
{
    for (int64_t i = 0; i < count; i++, matrices += n * n, rows += n * columns) solve(n, columns, matrices, rows);
}

static void apply(const double *matrix, const double *x, double *out)
{
    for (int32_t i = 0; i < 3; i++) out[i] = dot3(matrix + 3 * i, x);
}

static void product(const double *a, const double *b, double *out)
{
    for (int32_t i = 0; i < 9; i++) {
        const double *row = a + i - i % 3, *column = b + i % 3;
        out[i] = row[0] * column[0] + row[1] * column[3] + row[2] * column[6];
    }
}

static void make_unit(double *x)
{
    double length = ath_sqrt(dot3(x, x));
    for (int32_t i = 0; i < 3 && length > 0.0; i++) x[i] /= length;
}

static double determinant(const double *m)
{
    double across[3];
    cross(m + 3, m + 6, across);
    return dot3(m, across);
}

void ath_nearest_rotation(const double H[9], double R[9])
{
    double left[9], stretch[3], right[9];
    decompose(H, left, stretch, right);
    double sign = determinant(left) * determinant(right) < 0.0 ? -1.0 : 1.0;
    for (int32_t k = 0; k < 3; k++) right[6 + k] *= sign;
    product(left, right, R);
}

/* Fills the sums over the stems before each stem, and over all: of x_i y_j and x_i, of x now and y at rest. */
static void sum_stems(size_t N, size_t plane, int32_t stem_count, const int64_t *stems, const double *rest,
                      const double *x, double *sums)
{
    memset(sums, 0, SUMS * sizeof *sums);
    for (int32_t s = 0; s < stem_count; s++, sums += SUMS) {
        double own[SUMS] = {0.0};
        for (size_t v = (size_t)stems[s]; v < (size_t)stems[s + 1]; v++)
            for (size_t i = 0; i < 3; i++) {
                double at = x[i * plane + v];
                for (size_t j = 0; j < 3; j++) own[3 * i + j] += at * rest[j * N + v];
                own[9 + i] += at;
            }
        for (int32_t i = 0; i < SUMS; i++) sums[SUMS + i] = sums[i] + own[i];
    }
}

/* Turns a map on the shortest way so that it takes an axis where the map took it, after the rotation R of the parent. */
static void complete_straight(const double *axes, const double *R, double *linear)
{
    double axis[3] = {axes[0], axes[3], axes[6]}, image[3], start[3], w[3], turned[9], along[3];
    apply(linear, axis, image);
    make_unit(image);
    apply(R, axis, start);
    cross(start, image, w);
    double bend = 1.0 + dot3(start, image); /* opposite vectors have no least rotation: they stay as they are */
    double skew[9] = {0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0}, turn[9];
    product(skew, skew, turn);
    for (int32_t i = 0; i < 9; i++) turn[i] = IDENTITY[i] + skew[i] + turn[i] / (bend > 1e-9 ? bend : 1e-9);
    product(turn, R, turned);
    apply(turned, axis, along);
    for (int32_t i = 0; i < 9; i++) linear[i] += turned[i] - along[i / 3] * axis[i % 3];
}

static void complete_flat(const double *axes, double *linear)
{
    double images[2][3], normal[3];
    for (int32_t i = 0; i < 2; i++) apply(linear, (const double[3]){axes[i], axes[3 + i], axes[6 + i]}, images[i]);
    cross(images[0], images[1], normal);
    make_unit(normal);
    for (int32_t i = 0; i < 9; i++) linear[i] += normal[i / 3] * axes[i % 3 * 3 + 2];
}

/* Stretches every direction of a map by MIN_STRETCH at least, and fills the inverse. */
static void stretch_map(double *linear, double *inverse)
{
    double left[9], stretch[3], right[9], scaled[9], back[9], across[9];
    decompose(linear, left, stretch, right);
    double scale = stretch[0] > 1.0 ? 1.0 : stretch[0] > LEAST_SCALE ? stretch[0] : LEAST_SCALE;
    double least = MIN_STRETCH * scale;
    /* Which side a flattened subtree shows is noise: it is not turned inside out. */
    int mirrored = determinant(left) * determinant(right) < 0.0 && stretch[2] < least;
    for (int32_t i = 0; i < 9; i++) {
        double own = stretch[i % 3] > least ? stretch[i % 3] : least;
        if (mirrored && i % 3 == 2) left[i] = -left[i];
        scaled[i] = left[i] * own;
        across[i % 3 * 3 + i / 3] = left[i];
        back[i] = right[i % 3 * 3 + i / 3] / own;
    }
    product(scaled, right, linear);
    product(back, across, inverse);
}

static void invert(double *linear, double *inverse)
{
    double columns[9], rows[9], size2 = 0.0;
    for (int32_t i = 0; i < 9; i++) columns[i] = linear[i % 3 * 3 + i / 3];
    for (int32_t i = 0; i < 3; i++) cross(columns + (i + 1) % 3 * 3, columns + (i + 2) % 3 * 3, rows + 3 * i);
    double whole = dot3(columns, rows);
    for (int32_t i = 0; i < 9; i++) size2 += rows[i] * rows[i];
    /* The least stretch is at least 1 / |inverse|, so the few suspects alone are decomposed. */
    if (ath_sqrt(size2) * MIN_STRETCH >= magnitude(whole))
        stretch_map(linear, inverse);
    else
        for (int32_t i = 0; i < 9; i++) inverse[i] = rows[i] / whole;
}

/* Measures one frame of a piece, vertices first to stop - 1: the mean distance of the residuals from the rest pose. Raises
 * the largest distance, and the most vertices beyond xi. */
static double measure_piece(size_t N, size_t plane, size_t first, size_t stop, const double *inverse, const double *now,
                            const double *centre, const double *rest, const double *x, double xi, double *largest,
                            int32_t *most_beyond)
{
    enum { TILE = 16 };
    double o[3], sum = 0.0, distance[TILE];
    int32_t beyond = 0;
    apply(inverse, now, o);
    for (int32_t k = 0; k < 3; k++) o[k] = centre[k] - o[k];
    for (size_t v = first; v < stop; v += TILE) {
        int32_t count = ath_min(TILE, (int32_t)(stop - v));
        const double *x0 = x + v, *x1 = x0 + plane, *x2 = x1 + plane, *own = rest + v, *A = inverse;
        for (int32_t i = 0; i < count; i++) {
            double r0 = o[0] + A[0] * x0[i] + A[1] * x1[i] + A[2] * x2[i] - own[i];
            double r1 = o[1] + A[3] * x0[i] + A[4] * x1[i] + A[5] * x2[i] - own[N + (size_t)i];
            double r2 = o[2] + A[6] * x0[i] + A[7] * x1[i] + A[8] * x2[i] - own[2 * N + (size_t)i];
            distance[i] = ath_sqrt(r0 * r0 + r1 * r1 + r2 * r2);
        }
        for (int32_t i = 0; i < count; i++) {
            sum += distance[i];
            beyond += distance[i] > xi;
            if (distance[i] > *largest) *largest = distance[i];
        }
    }
    *most_beyond = ath_max(*most_beyond, beyond);
    return sum / (double)(stop - first);
}

void ath_fit(int32_t vertex_count, int32_t frames, int32_t stem_count, const int64_t *stems, int32_t piece_count,
             const int64_t *order, const int64_t *links, const double *shapes, const double *rest,
             const double *positions, double xi, double *work, double *linear, double *inverse, double *centroid,
             double *mean, double *largest, int32_t *most_beyond)
{
    size_t N = (size_t)vertex_count;
    double *rotations = work + SUMS * ((size_t)stem_count + 1);
    for (int32_t t = 0; t < frames; t++, linear += 9 * piece_count, inverse += 9 * piece_count) {
        const double *x = positions + (size_t)t * N;
        sum_stems(N, N * (size_t)frames, stem_count, stems, rest, x, work);
        for (int32_t i = 0; i < piece_count; i++) {
            const int64_t p = order[i], *link = links + LINKS * p, first = link[0], stop = link[1];
            const double *centre = shapes + SHAPE * p, *axes = centre + 3, *low = work + SUMS * first;
            const double *R = link[2] < 0 ? IDENTITY : rotations + 9 * link[2], *high = work + SUMS * stop;
            double count = (double)(stems[stop] - stems[first]), covariance[9], *map = linear + 9 * p;
            double *own = centroid + 3 * ((size_t)t * (size_t)piece_count + (size_t)p);
            for (int32_t k = 0; k < 3; k++) own[k] = (high[9 + k] - low[9 + k]) / count;
            for (int32_t k = 0; k < 9; k++) covariance[k] = (high[k] - low[k]) / count - own[k / 3] * centre[k % 3];
            product(covariance, axes + 9, map);
            if (link[3] == 2) complete_flat(axes, map);
            if (link[3] == 1) complete_straight(axes, R, map);
            if (link[3] == 0) memcpy(map, R, 9 * sizeof *map);
            invert(map, inverse + 9 * p);
            if (link[4]) ath_nearest_rotation(map, rotations + 9 * p);
            if (mean)
                mean[(size_t)t * (size_t)piece_count + (size_t)p] =
                    measure_piece(N, N * (size_t)frames, (size_t)stems[first], (size_t)stems[stop], inverse + 9 * p,
                                  own, centre, rest, x, xi, largest + p, most_beyond + p);
        }
    }
}
