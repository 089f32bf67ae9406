/* How the encoder decodes and measures what it has coded. */
#include "encode/encode.h"
#include "model/lanes.h"

enum { TILE = 16 }; /* vertices that are processed at once */

ATH_HOT int64_t ath_add_moments(int64_t count, int32_t frames, const int32_t *rows, double least, double *moments)
{
    int64_t kept = 0;
    for (int64_t i = 0; i < count; i++, rows += frames) {
        double row[ATH_SEGMENT_FRAMES], squares = 0.0;
        for (int32_t t = 0; t < frames; t++) {
            row[t] = (double)rows[t];
            squares += row[t] * row[t];
        }
        if (!(squares > least)) continue;
        kept++;
        for (int32_t a = 0; a < frames; a++) {
            double *out = moments + (size_t)a * (size_t)frames;
            if (rows[a] == 0) continue;
            for (int32_t b = 0; b <= a; b++) out[b] += row[a] * row[b];
        }
    }
    return kept;
}

ATH_HOT void ath_row_products(int64_t pieces, const int32_t *first, int32_t count, int32_t frames, const int32_t *rows,
                              double *products)
{
    enum { AT_ONCE = 4 };
    double row[ATH_SHAPE_NUMBERS][ATH_SEGMENT_FRAMES];
    memset(row, 0, sizeof row);
    for (int64_t p = 0; p < pieces; p++, products += count * count) {
        const int32_t *own = rows + 3 * (size_t)first[p] * (size_t)frames;
        for (int32_t i = 0; i < count; i++)
            for (int32_t t = 0; t < frames; t++) row[i][t] = (double)own[i * frames + t];
        for (int32_t i = 0; i < count; i++)
            for (int32_t from = 0; from <= i; from += AT_ONCE) {
                ath_lanes sums[AT_ONCE];
                for (int32_t j = 0; j < AT_ONCE; j++) lanes_set(sums + j, 0.0);
                for (int32_t t = 0; t < frames; t += ATH_LANES) /* rows end in zeros */
                    for (int32_t j = 0; j < AT_ONCE; j++) lanes_add_product(sums + j, row[i] + t, row[from + j] + t);
                for (int32_t j = from; j < ath_min(from + AT_ONCE, i + 1); j++) {
                    double sum[ATH_LANES];
                    lanes_store(sum, sums + (j - from));
                    products[i * count + j] = products[j * count + i] = (sum[0] + sum[1]) + (sum[2] + sum[3]);
                }
            }
    }
}

ATH_HOT
void ath_add_bends(int64_t rows, int32_t frames, int is_float64, const void *positions, double *sums)
{
    const double *wide = (const double *)positions;
    const float *narrow = (const float *)positions;
    for (int64_t row = 0; row < rows; row++, wide += frames, narrow += frames)
        for (int32_t t = 0; t + 2 < frames; t++) {
            double bend = is_float64 ? (wide[t + 2] - wide[t + 1]) - (wide[t + 1] - wide[t])
                                     : ((double)narrow[t + 2] - (double)narrow[t + 1])
                                           - ((double)narrow[t + 1] - (double)narrow[t]);
            sums[t] += bend * bend;
        }
}

void ath_gather(int32_t vertex_count, int32_t frames, const int32_t *vertex_source, int32_t source_count,
                int is_float64, const void *source, const double origin[3], double *out)
{
    size_t T = (size_t)frames, N = (size_t)source_count;
    for (int32_t start = 0; start < frames; start += TILE)
        for (size_t v = 0; v < (size_t)vertex_count; v++)
            for (size_t axis = 0; axis < 3; axis++)
                for (int32_t t = start; t < ath_min(start + TILE, frames); t++) {
                    size_t at = ((size_t)t * N + (size_t)vertex_source[v]) * 3 + axis;
                    double value = is_float64 ? ((const double *)source)[at] : (double)((const float *)source)[at];
                    out[(v * 3 + axis) * T + (size_t)t] = value - origin[axis];
                }
}

ATH_HOT void ath_store_positions(const double *placed, int32_t first, int32_t count, int32_t T, const double origin[3],
                                 int is_float64, void *positions)
{
    for (int32_t row = 0; row < 3 * count; row++) {
        const double *from = placed + (size_t)row * (size_t)T;
        size_t at = ((size_t)first * 3 + (size_t)row) * (size_t)T;
        double shift = origin[row % 3];
        if (is_float64)
            for (int32_t t = 0; t < T; t++) ((double *)positions)[at + (size_t)t] = from[t] + shift;
        else
            for (int32_t t = 0; t < T; t++) ((float *)positions)[at + (size_t)t] = (float)(from[t] + shift);
    }
}

static void pose_node(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers, int32_t n,
                      const ath_scratch *scratch, const double origin[3], int is_float64, void *positions)
{
    const ath_node *node = plan->nodes + n;
    const double *a = ath_rest_attach(plan, plan->pieces + node->piece);
    ath_piece_rows piece_rows = ath_rows_of_piece(integers, motion->frames, node->piece);
    ath_node_rows rows = ath_rows_of_node(integers, motion->frames, n);
    ath_node_map(plan, motion, n, &piece_rows, &rows, scratch);
    for (int32_t v = node->first; v < node->first + node->count; v++) {
        const double *x0 = ath_rest_of(plan, v);
        for (int32_t axis = 0; axis < 3; axis++)
            for (int32_t t = 0; t < motion->frames; t++)
                scratch->placed[axis * motion->frames + t] = x0[axis] - a[axis];
        ath_move(motion->frames, &scratch->at, scratch->placed);
        ath_store_positions(scratch->placed, v, 1, motion->frames, origin, is_float64, positions);
    }
}

void ath_pose(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers, int32_t first, int32_t stop,
              int32_t stage, const double origin[3], int is_float64, void *positions)
{
    ath_scratch scratch = ath_motion_scratch(plan, motion);
    for (int32_t p = first; p < stop; p++) {
        const ath_piece *piece = plan->pieces + p;
        ath_piece_rows rows = ath_rows_of_piece(integers, motion->frames, p);
        if (piece->stage > stage) continue;
        const double *placed = ath_pose_piece(plan, motion, p, &rows, &scratch);
        ath_store_positions(placed, piece->first, piece->count, motion->frames, origin, is_float64, positions);
    }
}

void ath_pose_nodes(const ath_plan *plan, const ath_motion *motion, const ath_integers *integers, int32_t first,
                    int32_t stop, int32_t stage, const double origin[3], int is_float64, void *positions)
{
    ath_scratch scratch = ath_motion_scratch(plan, motion);
    for (int32_t n = first; n < stop; n++)
        if (ath_is_shown(plan->nodes + n, stage))
            pose_node(plan, motion, integers, n, &scratch, origin, is_float64, positions);
}

/* Fills a vertex's squared distances, frame by frame. stride: numbers from axis to axis. */
ATH_HOT
static void square_distances(int32_t count, size_t stride, int is_float64, const void *positions, size_t first,
                             const double *source, const double origin[3], double *squares)
{
    for (int32_t t = 0; t < count; t++) squares[t] = 0.0;
    for (size_t axis = 0; axis < 3; axis++) {
        size_t at = first + axis * stride;
        const double *wanted = source + at, *wide = (const double *)positions + at;
        const float *narrow = (const float *)positions + at;
        for (int32_t t = 0; t < count; t++) {
            double e = (is_float64 ? wide[t] : (double)narrow[t]) - (wanted[t] + origin[axis]);
            squares[t] += e * e;
        }
    }
}

/* Rounds distances up to numbers of the error table, as far as it has them. */
ATH_HOT
static void shorts_above(int32_t count, const double *squares, double rounding, int32_t *shorts)
{
    for (int32_t t = 0; t < count; t++) {
        double distance = ath_sqrt(squares[t]) + rounding;
        float narrow = (float)distance;
        int32_t bits;
        memcpy(&bits, &narrow, sizeof bits);
        bits += (double)narrow < distance;
        shorts[t] = ath_min((bits + (1 << ATH_SHORT_SHIFT) - 1) >> ATH_SHORT_SHIFT, ATH_SHORT_FLOATS - 1);
    }
}

void ath_error(int32_t vertex_count, int32_t frames, const int32_t *shown, const int32_t *shares, int is_float64,
               const void *positions, const double *source, const double origin[3], double rounding, double *max_error,
               double *sum_squares, uint32_t *histogram)
{
    double largest = 0.0, sum = 0.0, squares[ATH_SEGMENT_FRAMES];
    int32_t shorts[ATH_SEGMENT_FRAMES];
    size_t T = (size_t)frames;
    for (size_t v = 0; v < (size_t)vertex_count; v++)
        for (int32_t start = 0; start < frames; start += ATH_SEGMENT_FRAMES) {
            int32_t count = ath_min(frames - start, ATH_SEGMENT_FRAMES), share = shares ? shares[v] : 1;
            square_distances(count, T, is_float64, positions, v * 3 * T + (size_t)start, source, origin, squares);
            for (int32_t t = 0; t < count; t++) {
                sum += (double)shown[start + t] * share * squares[t];
                if (squares[t] > largest) largest = squares[t];
            }
            shorts_above(count, squares, rounding, shorts);
            for (int32_t t = 0; t < count; t++) histogram[shorts[t]] += (uint32_t)(shown[start + t] * share);
        }
    *max_error = ath_sqrt(largest);
    *sum_squares = sum;
}
