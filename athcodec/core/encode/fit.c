/* Least-squares affine maps of subtrees and stems from the rest pose to each frame (motion/affine_fit.py). */
#include "encode/encode.h"

enum { SUMS = 12, LINKS = 5, SHAPE = 21 };

static const double IDENTITY[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
/* Least stretch of any direction in a map, relative to its largest where that is below 1. A frame in which the best fit
 * flattens a subtree would otherwise have no inverse, or residuals many times as long as the map's error. */
static const double MIN_STRETCH = 0.1;
static const double LEAST_SCALE = 1e-2; /* smallest stretch that MIN_STRETCH is relative to: subtrees may shrink */

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double *a, const double *b, double *out)
{
    for (int32_t i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
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
    ath_decompose(1, H, left, stretch, right);
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
    ath_decompose(1, linear, left, stretch, right);
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
    if (ath_sqrt(size2) * MIN_STRETCH >= (whole < 0.0 ? -whole : whole))
        stretch_map(linear, inverse);
    else
        for (int32_t i = 0; i < 9; i++) inverse[i] = rows[i] / whole;
}

void ath_fit(int32_t vertex_count, int32_t frames, int32_t stem_count, const int64_t *stems, int32_t piece_count,
             const int64_t *order, const int64_t *links, const double *shapes, const double *rest,
             const double *positions, double *work, double *linear, double *inverse, double *centroid)
{
    size_t N = (size_t)vertex_count;
    double *rotations = work + SUMS * ((size_t)stem_count + 1);
    for (int32_t t = 0; t < frames; t++, linear += 9 * piece_count, inverse += 9 * piece_count) {
        sum_stems(N, N * (size_t)frames, stem_count, stems, rest, positions + (size_t)t * N, work);
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
        }
    }
}
