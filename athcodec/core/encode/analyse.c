/* From positions to quantised coefficients, piece by piece in closed loop: every piece is predicted from what the
 * decoder will have of its parent. Encoder only. */
#include "encode/encode.h"
#include "model/lanes.h"

enum { ROTATION_STEPS = 5 };
enum { WAVES = 8 };         /* waves that a row is projected on at once */
enum { STIFF_FRAMES = 16 }; /* frames that tell which vertices of a tree bend least */
enum { STIFF_PASSES = 6 };  /* passes over these frames */

static const double STANDING = 0.1;  /* largest RMS motion of a foot that stands, over that of its plant */
static const double STIFFEST = 1e-4; /* squared bend below which vertices count alike, over the mean of their tree */

static double absolute(double x) { return x < 0.0 ? -x : x; }

/* Uniform quantiser with a dead zone: zero below `dead_zone` steps, rounding biased towards zero by as much. */
ATH_INLINE int32_t quantise(double value, double dead_zone)
{
    double units = absolute(value) + (1.0 - dead_zone);
    units = units < 1073741823.0 ? units : 1073741823.0;
    int32_t magnitude = (int32_t)(units >= 1.0 ? units : 0.0);
    return value < 0.0 ? -magnitude : magnitude;
}

/* units = `count` waves, in units of a step, times the first half of a row plus its mirror image, or for every second
 * wave less its mirror image; rows: both, or the whole row twice. */
ATH_INLINE void sums_of_waves(const double *waves, int32_t count, int32_t T, int32_t frames,
                              const double *const rows[2], double inverse, double *units)
{
    ath_lanes sums[WAVES];
    for (int32_t k = 0; k < count; k++) lanes_set(sums + k, 0.0);
    int32_t t = 0;
    for (; t + ATH_LANES <= frames; t += ATH_LANES)
        for (int32_t k = 0; k < count; k++)
            lanes_add_product(sums + k, waves + (size_t)k * (size_t)T + t, rows[k % 2] + t);
    for (int32_t k = 0; k < count; k++) {
        double sum[ATH_LANES];
        lanes_store(sum, sums + k);
        for (int32_t i = t; i < frames; i++) sum[0] += waves[(size_t)k * (size_t)T + i] * rows[k % 2][i];
        units[k] = ((sum[0] + sum[1]) + (sum[2] + sum[3])) * inverse;
    }
}

/* Returns whether waves are their own mirror images, every second one with the other sign: all but periodic ones. */
static int are_mirrored(const ath_stream *stream, int32_t T)
{
    const double *second = stream->temporal + T, *third = second + T;
    if (stream->root >= 0 || stream->temporal_rank < T || T < 4 || T % 2 != 0) return 0;
    return second[0] == -second[T - 1] && third[0] == third[T - 1];
}

/* Transforms one axis over time into units of `step`. Returns the number of coefficients: at least `known`, and all
 * beyond the dead zone. The waves are orthonormal, so that no other coefficient exceeds the length of the remainder. */
ATH_HOT static int32_t forward_temporal(const ath_stream *stream, int32_t T, double step, double dead_zone,
                                        int32_t known, const double *row, double *units)
{
    double length2, inverse = 1.0 / step, halves[2][ATH_SEGMENT_FRAMES / 2];
    const double *whole[2] = {row, row}, *folded[2] = {halves[0], halves[1]};
    sums_of_waves(row, 1, T, T, whole, 1.0, &length2);
    length2 *= inverse * inverse;
    double least = 0.9 * dead_zone * dead_zone, left = length2;
    int is_sharp = stream->temporal_rank == T && 1e-12 * length2 < 0.01 * least; /* a learned basis has rounded rows */
    int32_t frames = are_mirrored(stream, T) ? T / 2 : T;
    for (int32_t t = 0; frames < T && t < frames; t++) {
        halves[0][t] = row[t] + row[T - 1 - t];
        halves[1][t] = row[t] - row[T - 1 - t];
    }
    const double *const *rows = frames < T ? folded : whole;
    for (int32_t k = 0; k < stream->temporal_rank;) {
        if (k >= known && (k == 0 || is_sharp) && !(left > least)) return k;
        const double *waves = stream->temporal + (size_t)k * (size_t)T;
        int32_t count = k + WAVES <= stream->temporal_rank ? WAVES : 1;
        if (count == WAVES)
            sums_of_waves(waves, WAVES, T, frames, rows, inverse, units + k);
        else
            sums_of_waves(waves, 1, T, frames, rows + k % 2, inverse, units + k);
        for (int32_t stop = k + count; k < stop; k++) left -= units[k] * units[k];
    }
    return stream->temporal_rank;
}

/* An isolated 1 costs many bits and removes little error, so its threshold is higher than with neighbours. */
static void drop_lone_ones(int32_t T, int32_t rank, double units[3][ATH_SEGMENT_FRAMES], const int32_t *predicted,
                           int32_t *quantised)
{
    static const double least[2] = {1.1, 0.9};
    int32_t busy[ATH_SEGMENT_FRAMES + 4]; /* integers that are not 0, by k + 2 */
    memset(busy, 0, ((size_t)rank + 4) * sizeof *busy);
    for (int32_t i = 0; i < 3 * T; i += T)
        for (int32_t k = 0; k < rank; k++) busy[k + 2] += quantised[i + k] != 0;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = rank - 1; k >= 0; k--) {
            int32_t *q = quantised + axis * T + k;
            if ((*q != 1 && *q != -1) || (predicted && predicted[axis * T + k] != 0)) continue;
            int32_t beside = busy[k] + busy[k + 1] + busy[k + 2] + busy[k + 3] + busy[k + 4] - 1;
            if (beside > 1 || absolute(units[axis][k]) >= least[beside]) continue;
            *q = 0;
            busy[k + 2]--;
        }
}

/* Returns where the zeros at the end of a row begin. */
static int32_t row_extent(const int32_t *row, int32_t count)
{
    while (count > 0 && row[count - 1] == 0) count--;
    return count;
}

/* Fills the value, slope and bend of a row at its first frame (side 1) or its last (side -1). */
static void end_parts(const double *row, int32_t T, int32_t side, double parts[ATH_END_PARTS])
{
    const double *end = side > 0 ? row : row + T - 1;
    parts[0] = end[0];
    parts[1] = end[side] - end[0];
    parts[2] = end[0] - 2.0 * end[side] + end[2 * side];
}

static void both_ends(const double *row, int32_t T, double parts[2 * ATH_END_PARTS])
{
    end_parts(row, T, 1, parts);
    end_parts(row, T, -1, parts + ATH_END_PARTS);
}

/* Integers that may be rounded the other way: their parts at the ends, plain and weighted, how far they are off, how far
 * they lean already, and the cost of a step. */
typedef struct {
    int32_t k[ATH_SEGMENT_FRAMES];
    double parts[2 * ATH_END_PARTS][ATH_SEGMENT_FRAMES], pull[2 * ATH_END_PARTS][ATH_SEGMENT_FRAMES];
    double off[ATH_SEGMENT_FRAMES], lean[ATH_SEGMENT_FRAMES], cost[ATH_SEGMENT_FRAMES];
} end_integers;

/* Rounds integers of a row the other way if that brings its ends closer, whose errors are the largest and are seen
 * where segments meet. units: the exact values less the prediction; row: the integers, all 0 from `most_rank` on, as
 * predicted ones are. The gain, in squared steps, is the change of the integer's own error and of those of the ends. */
ATH_HOT static void settle_ends(const ath_stream *stream, int32_t T, int32_t most_rank, double step,
                                const ath_rounding *rounding, const double *row, const double *units,
                                const int32_t *predicted, int32_t *quantised)
{
    enum { LEAST_FRAMES = 8, PARTS = 2 * ATH_END_PARTS };
    static const double least = 1e-3, emptied = 0.25; /* extra gain for an integer that becomes 0 */
    end_integers found;
    double left[PARTS], own[PARTS];
    int32_t rank = row_extent(quantised, most_rank), count = 0;
    if (T < LEAST_FRAMES || rank == 0 || rounding->ends[0] == 0.0) return;
    both_ends(row, T, left);
    for (int32_t i = 0; i < PARTS; i++) left[i] /= step;
    for (int32_t k = 0; k < most_rank; k++) {
        double value = (double)(quantised[k] + (predicted ? predicted[k] : 0));
        if (quantised[k] == 0 && value == 0.0) continue;
        both_ends(stream->temporal + (size_t)k * (size_t)T, T, own);
        found.k[count] = k;
        found.off[count] = units[k] - (double)quantised[k];
        found.cost[count] = 1.0;
        for (int32_t i = 0; i < PARTS; i++) {
            left[i] -= value * own[i];
            found.parts[i][count] = own[i];
            found.pull[i][count] = rounding->ends[i % ATH_END_PARTS] * own[i];
            found.cost[count] += found.pull[i][count] * own[i];
        }
        count += quantised[k] != 0;
    }
    for (int32_t turned = 0; turned < rank; turned++) {
        double most = least;
        int32_t chosen = -1, by = 0, any = 0;
        for (int32_t c = 0; c < count; c++) {
            found.lean[c] = found.off[c];
            for (int32_t i = 0; i < PARTS; i++) found.lean[c] += found.pull[i][c] * left[i];
            any |= 2.0 * absolute(found.lean[c]) - found.cost[c] + emptied > least;
        }
        for (int32_t c = 0; c < count && any; c++) {
            int32_t q = quantised[found.k[c]];
            if (q == 0 || 2.0 * absolute(found.lean[c]) - found.cost[c] + emptied <= most) continue;
            for (int32_t d = -1; d <= 1; d += 2) {
                double worth = 2.0 * d * found.lean[c] - found.cost[c] + (q + d == 0 ? emptied : 0.0);
                if (worth <= most) continue;
                most = worth;
                chosen = c;
                by = d;
            }
        }
        if (chosen < 0) return;
        quantised[found.k[chosen]] += by;
        found.off[chosen] = units[found.k[chosen]] - (double)quantised[found.k[chosen]];
        for (int32_t i = 0; i < PARTS; i++) left[i] -= by * found.parts[i][chosen];
    }
}

/* Stores a row of `count` integers. Memory that holds them already is not written: of rows of zeros, which most are at
 * coarse steps, the system then keeps no pages. */
static void store_row(const int32_t *integers, int32_t count, int32_t *row)
{
    size_t size = (size_t)count * sizeof *row;
    if (memcmp(row, integers, size) != 0) memcpy(row, integers, size);
}

/* Quantises a track of three axes about its prediction, if there is one, into a row, and replaces it by the decoded
 * track if that is shown. */
ATH_HOT static void code_track(const ath_stream *stream, int32_t T, const double steps[3], const ath_rounding *rounding,
                               double *track, const int32_t *predicted, int32_t *row, int shown)
{
    double units[3][ATH_SEGMENT_FRAMES];
    int32_t longest = 0, quantised[3 * ATH_SEGMENT_FRAMES];
    memset(quantised, 0, 3 * (size_t)T * sizeof *quantised);
    for (int32_t axis = 0; axis < 3; axis++) {
        const int32_t *about = predicted ? predicted + axis * T : 0;
        int32_t known = about ? row_extent(about, stream->temporal_rank) : 0;
        int32_t count =
            forward_temporal(stream, T, steps[axis], rounding->dead_zone, known, track + axis * T, units[axis]);
        for (int32_t k = 0; k < known; k++) units[axis][k] -= (double)about[k];
        for (int32_t k = 0; k < count; k++)
            quantised[axis * T + k] = quantise(units[axis][k], k < known && about[k] ? 0.5 : rounding->dead_zone);
        longest = ath_max(longest, count);
    }
    drop_lone_ones(T, longest, units, predicted, quantised);
    for (int32_t axis = 0; axis < 3; axis++)
        settle_ends(stream, T, longest, steps[axis], rounding, track + axis * T, units[axis],
                    predicted ? predicted + axis * T : 0, quantised + axis * T);
    for (int32_t i = 0; predicted && i < 3 * T; i++) quantised[i] += predicted[i];
    store_row(quantised, 3 * T, row);
    for (int32_t axis = 0; axis < 3 && shown; axis++)
        ath_inverse_temporal(stream, T, longest, steps[axis], quantised + axis * T, track + axis * T);
}

static void code_even_track(const ath_stream *stream, int32_t T, double step, const ath_rounding *rounding,
                            double *track, const int32_t *predicted, int32_t *row, int shown)
{
    double steps[3] = {step, step, step};
    code_track(stream, T, steps, rounding, track, predicted, row, shown);
}

/* Codes a track as it is predicted. */
static void keep_track(const ath_stream *stream, int32_t T, const double steps[3], const int32_t *predicted,
                       double *track, int32_t *quantised)
{
    int32_t count = 0;
    for (int32_t axis = 0; axis < 3 && predicted; axis++)
        count = ath_max(count, row_extent(predicted + axis * T, stream->temporal_rank));
    for (int32_t i = 0; i < 3 * T; i++) quantised[i] = predicted ? predicted[i] : 0;
    for (int32_t axis = 0; axis < 3; axis++)
        ath_inverse_temporal(stream, T, count, steps[axis], quantised + axis * T, track + axis * T);
}

static void rest_centre(const ath_plan *plan, const ath_piece *piece, double centre[3])
{
    centre[0] = centre[1] = centre[2] = 0.0;
    for (int32_t i = 0; i < piece->count; i++)
        for (int32_t k = 0; k < 3; k++) centre[k] += ath_rest_of(plan, piece->first + i)[k] / (double)piece->count;
}

/* Returns how many vertices, from a piece's first on, tell its rotation. For the first piece of a root, they are all of
 * its tree, since an upright stem hardly tells how it turns about itself, and what hangs on it turns along. */
static int32_t turned_vertices(const ath_plan *plan, const ath_piece *piece)
{
    const ath_branch *branch = plan->branches + piece->branch;
    if (piece->parent >= 0 || piece->flags & ATH_RIGID) return piece->count;
    int32_t next = piece->branch + branch->subtree;
    return (next < plan->branch_count ? plan->branches[next].first : plan->vertex_count) - piece->first;
}

/* Products of positions in each frame and in the rest pose. */
typedef double products[9][ATH_SEGMENT_FRAMES];

/* Fills the products of `count` vertices, x from `from`, and d from `a`; returns the sum of d^2. from: 0: no vertex. */
ATH_HOT static double sum_products(const ath_plan *plan, int32_t T, int32_t vertex, int32_t count, const double a[3],
                                   const double *x, const double *from, products H)
{
    double size2 = 0.0;
    for (int32_t k = 0; k < 9; k++) memset(H[k], 0, (size_t)T * sizeof(double));
    for (int32_t i = 0; i < count; i++, x += 3 * (size_t)T) {
        const double *x0 = ath_rest_of(plan, vertex + i);
        double d[3];
        for (int32_t k = 0; k < 3; k++) {
            d[k] = x0[k] - a[k];
            size2 += d[k] * d[k];
        }
        for (int32_t j = 0; j < 3; j++)
            for (int32_t t = 0; t < T; t++) {
                double own = from ? x[j * T + t] - from[j * T + t] : x[j * T + t];
                for (int32_t k = 0; k < 3; k++) H[3 * j + k][t] += own * d[k];
            }
    }
    return size2;
}

/* Adds to H the vertices of the branches that a root carries, weighted so that together they count as much as the
 * root's own. source: positions of the whole plant. own2: sum of the squared distances of the root's vertices from its
 * base. */
static void add_carried(const ath_plan *plan, int32_t T, const ath_piece *root, const double *source, double own2,
                        products H)
{
    const double *first = source + (size_t)root->first * 3 * (size_t)T;
    products carried;
    double carried2 =
        sum_products(plan, T, root->first + root->count, turned_vertices(plan, root) - root->count,
                     ath_rest_attach(plan, root), first + (size_t)root->count * 3 * (size_t)T, first, carried);
    for (int32_t k = 0; k < 9 && carried2 > 0.0; k++)
        for (int32_t t = 0; t < T; t++) H[k][t] += own2 / carried2 * carried[k][t];
}

/* Adds to H the products of a vertex in some frames, times its weight, relative to the first vertex of its tree. */
static void add_weighted(int32_t T, const int32_t *frame, int32_t frames, const double *x, const double *base,
                         const double d[3], double weight, products H)
{
    for (int32_t j = 0; j < 3; j++)
        for (int32_t i = 0; i < frames; i++) {
            int32_t t = j * T + (frame ? frame[i] : i);
            for (int32_t k = 0; k < 3; k++) H[3 * j + k][i] += weight * (x[t] - base[t]) * d[k];
        }
}

/* Returns the mean squared distance of a vertex from where rotations R put it. */
static double squared_bend(int32_t T, const int32_t *frame, int32_t frames, const double *x, const double *base,
                           const double d[3], double R[STIFF_FRAMES][9])
{
    double sum = 0.0;
    for (int32_t i = 0; i < frames; i++)
        for (int32_t j = 0; j < 3; j++) {
            const double *row = R[i] + 3 * j;
            double away =
                x[j * T + frame[i]] - base[j * T + frame[i]] - (row[0] * d[0] + row[1] * d[1] + row[2] * d[2]);
            sum += away * away;
        }
    return sum / (double)frames;
}

/* Fills the products of a root's tree. Vertices weigh the less the more they bend: what sways would add its own waves to
 * a turn, and with them to the motion of all other vertices. Weights follow from a few frames, in passes that start from
 * equal ones. Returns the weighted sum of squared distances from the first vertex. */
static double sum_stiff(const ath_plan *plan, int32_t T, const ath_piece *root, const double *source, products H)
{
    int32_t frames = ath_min(T, STIFF_FRAMES), count = turned_vertices(plan, root), frame[STIFF_FRAMES];
    double R[STIFF_FRAMES][9], mean = 0.0, size2 = 0.0;
    const double *base = source + (size_t)root->first * 3 * (size_t)T, *a = ath_rest_of(plan, root->first);
    for (int32_t i = 0; i < frames; i++) frame[i] = frames > 1 ? i * (T - 1) / (frames - 1) : 0;
    for (int32_t pass = 0; pass <= STIFF_PASSES; pass++) {
        int last = pass == STIFF_PASSES;
        double bends = 0.0;
        size2 = 0.0;
        for (int32_t k = 0; k < 9; k++) memset(H[k], 0, (size_t)T * sizeof(double));
        for (int32_t v = 0; v < count; v++) {
            const double *x0 = ath_rest_of(plan, root->first + v), *x = base + (size_t)v * 3 * (size_t)T;
            double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
            double bend = pass > 0 ? squared_bend(T, frame, frames, x, base, d, R) : 1.0;
            double weight = pass > 0 ? 1.0 / (bend + STIFFEST * mean + 1e-200) : 1.0;
            bends += bend;
            size2 += weight * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            add_weighted(T, last ? 0 : frame, last ? T : frames, x, base, d, weight, H);
        }
        mean = bends / (double)count;
        for (int32_t i = 0; !last && i < frames; i++) {
            double moments[9];
            for (int32_t k = 0; k < 9; k++) moments[k] = H[k][i] + (k % 4 == 0 ? 1e-6 * size2 : 0.0);
            ath_nearest_rotation(moments, R[i]);
        }
    }
    return size2;
}

/* Turns rotations, one in each lane, by a step of Newton's method towards those nearest to H, for which the product of H
 * and the transpose of R is symmetric. Fills the squares of the turns; 1 where R is too far from the nearest rotation. */
ATH_INLINE void turn_closer(double H[9][ATH_LANES], double R[9][ATH_LANES], double size2[ATH_LANES])
{
    for (int32_t l = 0; l < ATH_LANES; l++) {
        double M[9], q[9], last[9];
        for (int32_t k = 0; k < 9; k++) last[k] = R[k][l];
        for (int32_t k = 0; k < 9; k++)
            M[k] = H[k - k % 3][l] * last[k % 3 * 3] + H[k - k % 3 + 1][l] * last[k % 3 * 3 + 1]
                   + H[k - k % 3 + 2][l] * last[k % 3 * 3 + 2];
        double wx = M[7] - M[5], wy = M[2] - M[6], wz = M[3] - M[1];
        double a = M[4] + M[8], b = M[0] + M[8], c = M[0] + M[4];
        double d = -0.5 * (M[1] + M[3]), e = -0.5 * (M[2] + M[6]), f = -0.5 * (M[5] + M[7]);
        double xx = b * c - f * f, xy = e * f - d * c, xz = d * f - e * b, yy = a * c - e * e, yz = d * e - a * f;
        double zz = a * b - d * d, all = a * xx + d * xy + e * xz, scale = 1.0 / all;
        double x = (xx * wx + xy * wy + xz * wz) * scale, y = (xy * wx + yy * wy + yz * wz) * scale;
        double z = (xz * wx + yz * wy + zz * wz) * scale;
        size2[l] = ((a > 0.0) & (zz > 0.0) & (all > 0.0)) ? x * x + y * y + z * z : 1.0; /* if positive definite */
        rational_rotation(0.25 * x, 0.25 * y, 0.25 * z, q);
        for (int32_t k = 0; k < 9; k++)
            R[k][l] =
                q[k - k % 3] * last[k % 3] + q[k - k % 3 + 1] * last[3 + k % 3] + q[k - k % 3 + 2] * last[6 + k % 3];
    }
}

/* Fills the rotations nearest to H in a few frames, from the rotation `before` them. */
ATH_HOT static void nearest_rotations(double H[9][ATH_LANES], const double before[9], double R[9][ATH_LANES])
{
    enum { STEPS = 8 };
    static const double far_turn = 0.25, close_turn = 1e-13; /* squared radians */
    double size2[ATH_LANES], most[ATH_LANES] = {0.0}, own[9], nearest[9];
    int32_t is_apart = 1;
    for (int32_t i = 0; i < 9 * ATH_LANES; i++) R[i / ATH_LANES][i % ATH_LANES] = before[i / ATH_LANES];
    for (int32_t step = 0; step < STEPS && is_apart; step++) {
        turn_closer(H, R, size2);
        is_apart = 0;
        for (int32_t l = 0; l < ATH_LANES; l++) {
            most[l] = size2[l] < most[l] ? most[l] : size2[l];
            is_apart |= most[l] < far_turn && size2[l] > close_turn;
        }
    }
    for (int32_t l = 0; l < ATH_LANES; l++) {
        if (most[l] < far_turn && size2[l] <= close_turn) continue;
        for (int32_t k = 0; k < 9; k++) own[k] = H[k][l];
        ath_nearest_rotation(own, nearest);
        for (int32_t k = 0; k < 9; k++) R[k][l] = nearest[k];
    }
}

/* Fills the piece's own rotation relative to its predicted one, as rotation vectors over time, unwrapped. local: its
 * vertices relative to the attach point, in the predicted frame. A turn that they show no better than an error of
 * `step` does, such as the twist of a straight stem, stays as in the frame before. carried: the source, if the branches
 * on a root tell more; else 0. stiff: whether the source alone tells, and most of it what bends least; then local is not
 * read. about_centre: whether the piece turns about its centre, so that an error of its attach point does not turn it. */
static void fit_rotation(const ath_plan *plan, int32_t T, const ath_piece *piece, double step, const double *local,
                         const double *carried, int stiff, int about_centre, double *omega)
{
    int rigid = (piece->flags & ATH_RIGID) != 0;
    double a[3], q[4] = {1.0, 0.0, 0.0, 0.0}, R[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    double few[9][ATH_LANES], turned[9][ATH_LANES]; /* products and rotations of a rigid piece in a few frames */
    products sums;
    memcpy(a, ath_rest_attach(plan, piece), sizeof a);
    if (about_centre) rest_centre(plan, piece, a);
    double size2 = stiff ? sum_stiff(plan, T, piece, carried, sums)
                         : sum_products(plan, T, piece->first, piece->count, a, local, 0, sums);
    if (carried && !stiff) add_carried(plan, T, piece, carried, size2, sums);
    double prior = 1e-6 * size2 + (rigid || stiff ? 0.0 : step * step * (double)piece->count);
    for (int32_t t = 0; t < T; t++) {
        double H[9], own[3];
        int32_t lane = t % ATH_LANES;
        for (int32_t i = 0; rigid && lane == 0 && i < 9 * ATH_LANES; i++)
            few[i % 9][i / 9] = sums[i % 9][ath_min(t + i / 9, T - 1)] + prior * R[i % 9];
        if (rigid && lane == 0) nearest_rotations(few, R, turned);
        for (int32_t k = 0; k < 9; k++) H[k] = sums[k][t] + prior * R[k];
        for (int32_t k = 0; rigid && k < 9; k++) R[k] = turned[k][lane];
        if (!rigid && t == 0) ath_nearest_rotation(H, R); /* it may be far from the rest pose */
        if (!rigid && t > 0) ath_turn_to(H, ROTATION_STEPS, R);
        ath_rotation_vector(R, q, own);
        for (int32_t k = 0; k < 3; k++) omega[k * T + t] = own[k];
    }
}

/* Replaces the tracks of the first modes by those of the shapes and sets the other rows to 0. */
static void to_shapes(int32_t T, const ath_piece *piece, int32_t shape_count, const double *duals,
                      const ath_scratch *scratch)
{
    size_t frames = (size_t)T, rows = 3 * (size_t)ath_shape_modes(piece);
    double *tracks = scratch->placed; /* its vertices are no longer needed */
    memset(tracks, 0, rows * frames * sizeof *tracks);
    for (int32_t s = 0; s < shape_count; s++)
        for (size_t j = 0; j < rows; j++) {
            double weight = duals[s * ATH_SHAPE_NUMBERS + (int32_t)j], *track = tracks + (size_t)s * frames;
            const double *row = scratch->rows + j * frames;
            for (int32_t t = 0; t < T; t++) track[t] += weight * row[t];
        }
    memcpy(scratch->rows, tracks, rows * frames * sizeof *tracks);
}

static void to_local(int32_t T, const ath_piece *piece, const ath_frames *at, const double *source, double *local)
{
    for (int32_t i = 0; i < piece->count; i++)
        ath_into_rest_space(T, at, source + (size_t)(piece->first + i) * 3 * (size_t)T,
                            local + (size_t)i * 3 * (size_t)T);
}

static void code_shift(const ath_motion *motion, const ath_piece *piece, const ath_piece_before *before,
                       ath_piece_rows *rows, const ath_scratch *scratch, const ath_rounding *rounding)
{
    const ath_stream *base = ath_base_stream(motion, piece);
    int32_t T = motion->frames;
    if (before) ath_predict_shift(motion, piece, before, scratch, rows);
    code_even_track(base, T, ath_shift_step(piece, base), rounding, scratch->track, rows->predicted_shift, rows->shift,
                    1);
    ath_move_point(T, scratch->track, scratch->at.point);
}

/* Fills the first vertex less the attach point. */
static void shift_of_first(const ath_plan *plan, int32_t T, const ath_piece *piece, const ath_scratch *scratch,
                           const double *source)
{
    const double *x = source + (size_t)piece->first * 3 * (size_t)T;
    const double *a = ath_rest_attach(plan, piece), *x0 = ath_rest_of(plan, piece->first);
    for (int32_t i = 0; i < 3 * T; i++) scratch->track[i] = x[i] - (x0[i / T] - a[i / T]) - scratch->at.point[i];
}

/* Fills the mean distance of a rigid piece's vertices from where it would put them. */
static void shift_of_all(const ath_plan *plan, int32_t T, const ath_piece *piece, const ath_scratch *scratch,
                         const double *source)
{
    const double *a = ath_rest_attach(plan, piece), *R = scratch->at.rotation;
    double d[3], weight = 1.0 / (double)piece->count;
    rest_centre(plan, piece, d);
    for (int32_t k = 0; k < 3; k++) d[k] -= a[k];
    for (int32_t k = 0; k < 3; k++)
        for (int32_t t = 0; t < T; t++) {
            double sum = 0.0;
            for (int32_t i = 0; i < piece->count; i++)
                sum += source[((size_t)(piece->first + i) * 3 + (size_t)k) * (size_t)T + (size_t)t];
            scratch->track[k * T + t] =
                sum * weight - scratch->at.point[k * T + t]
                - (R[3 * k * T + t] * d[0] + R[(3 * k + 1) * T + t] * d[1] + R[(3 * k + 2) * T + t] * d[2]);
        }
}

/* Returns whether the first of some vertices, the foot of a root, stands still while the others move. */
static int stands_on_foot(const ath_plan *plan, int32_t T, int32_t first, int32_t count, const double *source)
{
    double moved = 0.0, of_foot = 0.0;
    for (int32_t v = first; v < first + count; v++) {
        const double *x = source + (size_t)v * 3 * (size_t)T, *x0 = ath_rest_of(plan, v);
        for (int32_t i = 0; i < 3 * T; i++) moved += (x[i] - x0[i / T]) * (x[i] - x0[i / T]);
        if (v == first) of_foot = moved;
    }
    return of_foot * (double)count <= STANDING * STANDING * moved;
}

/* Codes the piece's own translation and rotation. local: room for its vertices. A rigid piece is turned first, so that
 * the one does not stand for the other, unless it stands on its foot. */
static void analyse_tracks(const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                           const ath_piece_before *before, ath_piece_rows *rows, const ath_scratch *scratch,
                           const double *source, const ath_rounding *rounding, double *local)
{
    const ath_stream *base = ath_base_stream(motion, piece);
    int32_t T = motion->frames;
    int floats = (piece->flags & ATH_RIGID) != 0
                 && (piece->parent >= 0 || !stands_on_foot(plan, T, piece->first, piece->count, source));
    ath_attach(plan, motion, piece, scratch->at);
    if (ath_has_shift(piece) && !floats) {
        shift_of_first(plan, T, piece, scratch, source);
        code_shift(motion, piece, before, rows, scratch, rounding);
    }
    if (ath_has_rotation(plan, piece, base)) {
        ath_turning turning = ath_turning_of(plan, piece, base);
        int keeps = rounding->roots_turn && piece->parent >= 0 && !(piece->flags & ATH_RIGID);
        if (before) ath_predict_rotation(plan, motion, piece, before, scratch, rows);
        if (keeps)
            keep_track(base, T, turning.steps, rows->predicted_rotation, scratch->track, rows->rotation);
        else {
            int carries = turned_vertices(plan, piece) > piece->count, stiff = carries && rounding->roots_turn;
            if (!stiff) to_local(T, piece, &scratch->at, source, local);
            fit_rotation(plan, T, piece, base->step, local, carries ? source : 0, stiff, floats, scratch->track);
            ath_into_axes(T, &turning, scratch->track);
            code_track(base, T, turning.steps, rounding, scratch->track, rows->predicted_rotation, rows->rotation, 1);
        }
        ath_out_of_axes(T, &turning, scratch->track);
        ath_turn(T, scratch->track, scratch->at.rotation);
    }
    if (ath_has_shift(piece) && floats) {
        shift_of_all(plan, T, piece, scratch, source);
        code_shift(motion, piece, before, rows, scratch, rounding);
    }
}

/* Returns a piece as the layer before has it, in that layer's scratch memory. */
static ath_piece_before piece_before(const ath_motion *motion, const ath_motion *coarse, int32_t p,
                                     const ath_scratch *scratch)
{
    const ath_coarse *layer = motion->before;
    const ath_piece *piece = layer->plan->pieces + p;
    int32_t T = motion->frames;
    double *turn_steps = layer->turn_steps + 3 * (size_t)p;
    uint8_t used[ATH_PIECE_VERTICES];
    ath_piece_rows rows = ath_rows_of_piece(layer->integers, T, p);
    ath_piece_before before = {0, scratch->rotation, scratch->shift, 0, 0, 0};
    memset(scratch->rotation, 0, 6 * (size_t)T * sizeof(double));
    ath_turned_attach(layer->plan, coarse, p, &rows, scratch);
    turn_steps[0] = -1.0;
    if (piece->flags & ATH_RIGID) {
        ath_turning turning = ath_turning_of(layer->plan, piece, ath_base_stream(coarse, piece));
        memcpy(turn_steps, turning.steps, sizeof turning.steps);
        before.frames = scratch->at.point;
    }
    before.frequencies = ath_max(ath_row_extent(rows.shift, T, T), ath_row_extent(rows.rotation, T, T));
    for (int32_t r = 0; r < ath_rank(piece); r++) {
        int32_t count = ath_row_extent(ath_row(rows.modes, r, T), T, T);
        before.frequencies = ath_max(before.frequencies, count);
        if (count > 0) before.modes = rows.shape_count > 0 ? ath_max(ath_shape_modes(piece), r + 1) : r + 1;
    }
    if (before.modes > 0) {
        ath_pose_tracks(coarse, piece, &rows, scratch, used);
        before.placed = ath_pose_used(layer->plan, coarse, piece, &rows, used, ATH_ALL_VERTICES, scratch, 0);
    }
    if (!motion->known[p] && before.frequencies > 0) before.frequencies = T;
    return before;
}

/* Returns the vertices as decoded; null unless they are shown or other pieces hang on them. */
static const double *analyse_piece(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers,
                                   int32_t p, const ath_scratch *scratch, const ath_motion *coarse,
                                   const double *source, const ath_rounding *rounding, int shown)
{
    const ath_piece *piece = plan->pieces + p;
    shown |= piece->attach_cache >= 0;
    ath_piece_rows rows = ath_rows_of_piece(integers, motion->frames, p);
    ath_piece_before before;
    int32_t T = motion->frames;
    if (motion->before) {
        ath_scratch beside = ath_motion_scratch(motion->before->plan, coarse);
        before = piece_before(motion, coarse, p, &beside);
        ath_coarse_rows(motion, p, &rows);
    }
    analyse_tracks(plan, motion, piece, motion->before ? &before : 0, &rows, scratch, source, rounding,
                   scratch->placed);
    if (motion->before) ath_predict_modes(plan, motion, piece, &before, scratch, &rows);
    ath_to_local(plan, T, piece, &scratch->at, source + (size_t)piece->first * 3 * (size_t)T, scratch->placed);
    ath_project(plan, T, piece, ath_rank(piece), scratch->placed, scratch->rows);
    if (rows.shape_count > 0)
        to_shapes(T, piece, rows.shape_count, integers->duals + integers->shape_first[p] * ATH_SHAPE_NUMBERS, scratch);
    for (int32_t r = 0; r < ath_rank(piece); r++)
        code_even_track(ath_mode_stream(motion, piece, r), T, ath_row_step(motion, piece, &rows, r), rounding,
                        scratch->rows + (size_t)r * 3 * (size_t)T,
                        rows.predicted_modes ? ath_row(rows.predicted_modes, r, T) : 0, ath_row(rows.modes, r, T),
                        shown);
    return shown ? ath_pose_rows(plan, motion, p, &rows, scratch) : 0;
}

void ath_analyse(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers, int32_t first,
                 int32_t stop, const double *source, const ath_rounding *rounding, int bent, const double origin[3],
                 int is_float64, void *positions)
{
    ath_scratch scratch = ath_motion_scratch(plan, motion);
    ath_motion coarse = motion->before ? *motion->before->motion : *motion;
    coarse.work = motion->work + ath_motion_work(plan->longest, motion->frames);
    for (int32_t p = first; p < stop; p++) {
        const ath_piece *piece = plan->pieces + p;
        if (bent && piece->flags & ATH_RIGID && piece->attach_cache < 0) continue;
        const double *placed =
            analyse_piece(plan, motion, integers, p, &scratch, &coarse, source, rounding, positions != 0);
        if (positions)
            ath_store_positions(placed, piece->first, piece->count, motion->frames, origin, is_float64, positions);
    }
}

void ath_mode_weights(const ath_piece *piece, double weights[ATH_SHAPE_MODES])
{
    for (int32_t m = 0; m < ATH_SHAPE_MODES; m++) weights[m] = ath_mode_weight(piece, m);
}

/* Averages the residual in the attach frame, e = R'(x - c) - d, over the subtree. Tracks r < rank become the mean of e
 * * w_r, track 3 the mean of e, `centre` the mean of w, scratch->track e of the first vertex. */
static void node_moments(const ath_plan *plan, const ath_node *node, int32_t T, const ath_scratch *scratch,
                         const double *source, double *tracks, double centre[3])
{
    const double *a = ath_rest_attach(plan, plan->pieces + node->piece);
    double *local = scratch->placed, weight = 1.0 / (double)node->count;
    memset(tracks, 0, 12 * (size_t)T * sizeof *tracks);
    centre[0] = centre[1] = centre[2] = 0.0;
    for (int32_t v = node->first; v < node->first + node->count; v++) {
        const double *x0 = ath_rest_of(plan, v);
        double d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
        ath_into_rest_space(T, &scratch->at, source + (size_t)v * 3 * (size_t)T, local);
        for (int32_t axis = 0; axis < 3; axis++)
            for (int32_t t = axis * T; t < (axis + 1) * T; t++) {
                local[t] -= d[axis];
                tracks[9 * T + t] += local[t] * weight;
            }
        if (v == node->first) memcpy(scratch->track, local, 3 * (size_t)T * sizeof *local);
        for (int32_t r = 0; r < node->rank; r++) {
            const double *w = node->whitening + 3 * r;
            double value = (w[0] * d[0] + w[1] * d[1] + w[2] * d[2]) * weight, *track = tracks + r * 3 * T;
            centre[r] += value;
            for (int32_t i = 0; i < 3 * T; i++) track[i] += value * local[i];
        }
    }
}

/* Turns the moments into the least-squares map: e = Y w, which they are already, for attached nodes, e = s + Y w for
 * loose parts and roots. A root that stands on its foot turns about it: s is what little the foot moves. */
static void fit_node(const ath_node *node, int free_base, const double *foot, int32_t T, double *tracks,
                     const double centre[3])
{
    double *shift = tracks + 9 * T, left = 1.0;
    for (int32_t r = 0; r < node->rank; r++) left -= centre[r] * centre[r];
    for (int32_t i = 0; i < 3 * T; i++) {
        double mean = shift[i];
        for (int32_t r = 0; r < node->rank; r++) mean -= tracks[3 * r * T + i] * centre[r];
        shift[i] = foot ? foot[i] : free_base && left > 1e-6 ? mean / left : 0.0;
        for (int32_t r = 0; r < node->rank; r++) tracks[3 * r * T + i] -= shift[i] * centre[r];
    }
}

/* Returns the exponent of the largest half-octave step that is not above `step`. */
static int32_t half_octaves(double step)
{
    int32_t exponent = 0;
    if (!(step > 1e-30)) return -200;
    if (step > 1e30) return 200;
    for (; step >= 2.0; exponent += 2) step *= 0.5;
    for (; step < 1.0; exponent -= 2) step *= 2.0;
    return step >= 1.4142135623730951 ? exponent + 1 : exponent;
}

static void analyse_node(const ath_plan *plan, const ath_motion *motion, const ath_node *node,
                         const ath_node_rows *rows, const ath_scratch *scratch, const double *source, double stage_step,
                         const ath_rounding *rounding)
{
    const ath_piece *piece = plan->pieces + node->piece;
    int32_t T = motion->frames;
    double *tracks = scratch->rows, centre[3];
    int free_base = ath_has_shift(piece);
    ath_attach(plan, motion, piece, scratch->at);
    node_moments(plan, node, T, scratch, source, tracks, centre);
    int stands = piece->parent < 0 && stands_on_foot(plan, T, node->first, node->count, source);
    fit_node(node, free_base, stands ? scratch->track : 0, T, tracks, centre);
    *rows->step = half_octaves(stage_step / ath_sqrt((double)node->count));
    double step = ath_node_step(*rows->step);
    ath_stream stream = ath_node_stream(motion, step);
    for (int32_t r = 0; r < node->rank; r++)
        code_even_track(&stream, T, step, rounding, tracks + r * 3 * T, 0, ath_row(rows->rows, r, T), 0);
    if (free_base) code_even_track(&stream, T, step, rounding, tracks + 9 * T, 0, ath_row(rows->rows, 3, T), 0);
}

void ath_analyse_nodes(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers, int32_t first,
                       int32_t stop, const double *source, const double *stage_steps, const ath_rounding *rounding)
{
    ath_scratch scratch = ath_motion_scratch(plan, motion);
    for (int32_t n = first; n < stop; n++) {
        const ath_node *node = plan->nodes + n;
        ath_node_rows rows = ath_rows_of_node(integers, motion->frames, n);
        if (node->coded) analyse_node(plan, motion, node, &rows, &scratch, source, stage_steps[node->stage], rounding);
    }
}
