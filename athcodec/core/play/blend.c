/* Blends several clips: the pose of each is taken apart into edges of stems and turned sheets, which are blended and
 * put together again from the roots on. */
#include "model/motion.h"
#include "model/rotations.h"
#include "play/segment.h"

enum { SHEET_TURNS = 12 };

static const double UPRIGHT =
    0.001; /* weight of the rest pose in a sheet's rotation: a sheet that is a line could turn freely */
static const double MOST_STRETCH = 4.0; /* largest stretch of a blended edge, if the clips' edges nearly cancel out */

/* The clips that have a weight. */
typedef struct {
    const double *clip[ATH_BLEND_CLIPS]; /* vertices x 3, file order, absolute */
    double weight[ATH_BLEND_CLIPS];      /* their sum is 1 */
    double *out;
    int32_t count;
} blending;

static const double *vertex_of(const double *positions, int32_t vertex) { return positions + 3 * (size_t)vertex; }
static double length_of(const double v[3]) { return ath_sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/* A blended edge has the mean length and the mean direction of the clips' edges. */
static void blend_edge(const blending *own, int32_t from, int32_t to)
{
    double edge[3] = {0.0}, length = 0.0;
    for (int32_t c = 0; c < own->count; c++) {
        const double *a = vertex_of(own->clip[c], from), *b = vertex_of(own->clip[c], to);
        double along[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        for (int32_t k = 0; k < 3; k++) edge[k] = edge[k] + own->weight[c] * along[k];
        length = length + own->weight[c] * length_of(along);
    }
    double now = length_of(edge), stretch = now > 0.0 ? length / now : 1.0;
    if (!(stretch < MOST_STRETCH)) stretch = MOST_STRETCH;
    const double *base = vertex_of(own->out, from);
    double *out = own->out + 3 * (size_t)to;
    for (int32_t k = 0; k < 3; k++) out[k] = base[k] + edge[k] * stretch;
}

static void blend_vertex(const blending *own, int32_t vertex)
{
    double *out = own->out + 3 * (size_t)vertex;
    for (int32_t k = 0; k < 3; k++) {
        out[k] = 0.0;
        for (int32_t c = 0; c < own->count; c++) out[k] = out[k] + own->weight[c] * vertex_of(own->clip[c], vertex)[k];
    }
}

/* Fills the rotation of a piece in a clip about the vertex that it hangs on. */
static void sheet_rotation(const ath_plan *plan, const ath_piece *piece, int32_t hangs, const double *clip, double R[9])
{
    const double *a = ath_rest_of(plan, hangs), *p = vertex_of(clip, hangs);
    double H[9] = {0.0}, size2 = 0.0;
    for (int32_t v = piece->first; v < piece->first + piece->count; v++) {
        const double *x0 = ath_rest_of(plan, v), *x = vertex_of(clip, v);
        for (int32_t k = 0; k < 3; k++) {
            double d = x0[k] - a[k];
            size2 = size2 + d * d;
            for (int32_t j = 0; j < 3; j++) H[3 * j + k] = H[3 * j + k] + (x[j] - p[j]) * d;
        }
    }
    for (int32_t k = 0; k < 9; k++) {
        R[k] = k % 4 == 0 ? 1.0 : 0.0;
        H[k] = H[k] + UPRIGHT * size2 * R[k];
    }
    ath_turn_to(H, SHEET_TURNS, R);
}

static void quaternion_rotation(const double q[4], double R[9])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    R[0] = 1.0 - 2.0 * (y * y + z * z);
    R[1] = 2.0 * (x * y - w * z);
    R[2] = 2.0 * (x * z + w * y);
    R[3] = 2.0 * (x * y + w * z);
    R[4] = 1.0 - 2.0 * (x * x + z * z);
    R[5] = 2.0 * (y * z - w * x);
    R[6] = 2.0 * (x * z - w * y);
    R[7] = 2.0 * (y * z + w * x);
    R[8] = 1.0 - 2.0 * (x * x + y * y);
}

/* Averages rotations as unit quaternions on the side of the first. */
static void mean_rotation(const blending *own, double turned[ATH_BLEND_CLIPS][9], double R[9])
{
    double first[4] = {1.0, 0.0, 0.0, 0.0}, sum[4] = {0.0}, length2 = 0.0;
    for (int32_t c = 0; c < own->count; c++) {
        double q[4] = {1.0, 0.0, 0.0, 0.0}, omega[3], along = 0.0;
        ath_rotation_vector(turned[c], q, omega);
        if (c == 0) memcpy(first, q, sizeof first);
        for (int32_t k = 0; k < 4; k++) along = along + q[k] * first[k];
        for (int32_t k = 0; k < 4; k++) sum[k] = sum[k] + own->weight[c] * (along < 0.0 ? -q[k] : q[k]);
    }
    for (int32_t k = 0; k < 4; k++) length2 = length2 + sum[k] * sum[k];
    if (!(length2 > 1e-12)) memcpy(sum, first, sizeof sum);
    double scale = length2 > 1e-12 ? 1.0 / ath_sqrt(length2) : 1.0;
    for (int32_t k = 0; k < 4; k++) sum[k] = sum[k] * scale;
    quaternion_rotation(sum, R);
}

static void blend_sheet(const ath_plan *plan, const blending *own, const ath_piece *piece, int32_t hangs)
{
    double turned[ATH_BLEND_CLIPS][9], R[9], base[3];
    for (int32_t c = 0; c < own->count; c++) sheet_rotation(plan, piece, hangs, own->clip[c], turned[c]);
    mean_rotation(own, turned, R);
    memcpy(base, vertex_of(own->out, hangs), sizeof base);
    for (int32_t v = piece->first; v < piece->first + piece->count; v++) {
        double local[3] = {0.0}, *out = own->out + 3 * (size_t)v;
        for (int32_t c = 0; c < own->count; c++) {
            const double *p = vertex_of(own->clip[c], hangs), *x = vertex_of(own->clip[c], v), *Q = turned[c];
            double d[3] = {x[0] - p[0], x[1] - p[1], x[2] - p[2]};
            for (int32_t k = 0; k < 3; k++)
                local[k] = local[k] + own->weight[c] * (Q[k] * d[0] + Q[3 + k] * d[1] + Q[6 + k] * d[2]);
        }
        for (int32_t k = 0; k < 3; k++)
            out[k] = base[k] + (R[3 * k] * local[0] + R[3 * k + 1] * local[1] + R[3 * k + 2] * local[2]);
    }
}

static void blend_piece(const ath_plan *plan, const blending *own, const ath_piece *piece)
{
    int32_t hangs = piece->attach >= 0 ? piece->attach : piece->first;
    if (piece->attach < 0) blend_vertex(own, piece->first);
    if (piece->flags & (ATH_SHEET | ATH_RIGID)) {
        blend_sheet(plan, own, piece, hangs);
        return;
    }
    for (int32_t v = piece->first; v < piece->first + piece->count; v++) {
        if (v != hangs) blend_edge(own, hangs, v);
        hangs = v;
    }
}

/* Finds the shares that count and normalises their weights. Returns their number. Dividing by the largest weight first
 * avoids overflow. */
static int32_t weigh(const ath_share *shares, int32_t count, const ath_share **used, double *weight)
{
    double largest = 0.0, sum = 0.0;
    int32_t found = 0;
    if (count > ATH_BLEND_CLIPS) return 0;
    for (int32_t i = 0; i < count; i++)
        if (shares[i].weight > largest) largest = shares[i].weight;
    if (!(largest - largest == 0.0)) return 0;
    for (int32_t i = 0; i < count; i++) {
        if (!(shares[i].weight > 0.0) || !(shares[i].weight / largest > 0.0)) continue;
        weight[found] = shares[i].weight / largest;
        used[found] = shares + i;
        sum = sum + weight[found++];
    }
    for (int32_t i = 0; i < found; i++) weight[i] = weight[i] / sum;
    return found;
}

size_t ath_blend_size(const ath_file *file)
{
    return ath_size_or_most((ATH_BLEND_CLIPS + 1) * 3 * (uint64_t)file->plan.vertex_count * sizeof(double));
}

int ath_blended_positions(const ath_file *file, const ath_share *shares, int32_t count, ath_order order, float *xyz,
                          size_t stride, void *memory, size_t memory_bytes)
{
    const ath_share *used[ATH_BLEND_CLIPS];
    blending own;
    const ath_plan *plan = &file->plan;
    size_t numbers = 3 * (size_t)plan->vertex_count;
    int held = ATH_OK;
    own.count = weigh(shares, count, used, own.weight);
    if (own.count == 0) return ATH_BAD_ARGUMENT;
    if (own.count == 1)
        return ath_positions(file, used[0]->segments, used[0]->segment_count, used[0]->frame, order, xyz, stride);
    if (!ath_fits(memory, memory_bytes, ath_blend_size(file))) return ATH_NO_MEMORY;
    own.out = (double *)memory;
    for (int32_t c = 0; c < own.count; c++) {
        double *shown = own.out + (size_t)(c + 1) * numbers;
        int result = ath_positions_float64(file, used[c]->segments, used[c]->segment_count, used[c]->frame,
                                           ATH_FILE_ORDER, shown, 3 * sizeof(double));
        if (result == ATH_NOT_PREPARED) return result;
        if (result == ATH_HELD) held = ATH_HELD;
        own.clip[c] = shown;
    }
    for (int32_t p = 0; p < plan->piece_count; p++) blend_piece(plan, &own, plan->pieces + p);
    for (int32_t v = 0; v < plan->vertex_count; v++) {
        size_t place = (size_t)(order == ATH_SOURCE_ORDER ? file->vertex_source[v] : v);
        float *out = (float *)(void *)((char *)xyz + place * stride);
        for (int32_t k = 0; k < 3; k++) out[k] = (float)vertex_of(own.out, v)[k];
    }
    if (order == ATH_SOURCE_ORDER) ath_fill_places(file, xyz, stride, 3 * sizeof(float));
    return held;
}

/* Returns the degrees from one heading to another, 0 to 360. */
static double turn_between(double from, double to)
{
    double degrees = to - from, turns = degrees / 360.0;
    if (!(turns > -2147483648.0 && turns < 2147483647.0)) return 0.0;
    degrees = degrees - 360.0 * (double)(int64_t)turns;
    if (degrees < 0.0) degrees = degrees + 360.0;
    return degrees < 360.0 ? degrees : 0.0;
}

/* Shares the weight of one strength between the clips whose headings are next to the wanted one on either side. */
static void weigh_headings(const ath_wind *clips, int32_t count, double strength, double heading, double share,
                           double *weights)
{
    int32_t before = -1, after = -1;
    double back = 360.0, on = 360.0;
    for (int32_t i = 0; i < count; i++) {
        if (clips[i].strength != strength) continue;
        double to = turn_between(clips[i].heading, heading), from = to > 0.0 ? 360.0 - to : 0.0;
        if (before < 0 || to < back) {
            before = i;
            back = to;
        }
        if (after < 0 || from < on) {
            after = i;
            on = from;
        }
    }
    double gap = back + on, part = before == after || !(gap > 0.0) ? 0.0 : back / gap;
    weights[before] = weights[before] + share * (1.0 - part);
    if (part > 0.0) weights[after] = weights[after] + share * part;
}

void ath_wind_weights(const ath_wind *clips, int32_t count, double strength, double heading, double *weights)
{
    int32_t below = -1, above = -1, calmest = -1, wildest = -1;
    for (int32_t i = 0; i < count; i++) {
        double own = clips[i].strength;
        weights[i] = 0.0;
        if (!(own - own == 0.0)) continue;
        if (calmest < 0 || own < clips[calmest].strength) calmest = i;
        if (wildest < 0 || own > clips[wildest].strength) wildest = i;
        if (own <= strength && (below < 0 || own > clips[below].strength)) below = i;
        if (own >= strength && (above < 0 || own < clips[above].strength)) above = i;
    }
    if (calmest < 0) {
        if (count > 0) weights[0] = 1.0;
        return;
    }
    if (below < 0) below = calmest;
    if (above < 0) above = strength > clips[wildest].strength ? wildest : calmest;
    double low = clips[below].strength, high = clips[above].strength;
    double part = high > low ? (strength - low) / (high - low) : 0.0;
    weigh_headings(clips, count, low, heading, 1.0 - part, weights);
    if (part > 0.0) weigh_headings(clips, count, high, heading, part, weights);
}
