/* Which vertices of a clip have the same positions, compared bit by bit, or nearly the same. */
#include "encode/encode.h"

/* Returns the bits of a coordinate. If zeros do not differ, -0.0 has those of 0.0. */
ATH_INLINE uint64_t bits_of(const void *positions, size_t at, int is_float64, int zeros_differ)
{
    uint64_t bits, sign = is_float64 ? (uint64_t)1 << 63 : (uint64_t)1 << 31;
    if (is_float64) {
        memcpy(&bits, (const double *)positions + at, sizeof bits);
    } else {
        uint32_t narrow;
        memcpy(&narrow, (const float *)positions + at, sizeof narrow);
        bits = narrow;
    }
    return bits == sign && !zeros_differ ? 0 : bits;
}

void ath_hash_positions(int64_t count, const int32_t *vertices, int32_t frames, int32_t vertex_count, int is_float64,
                        int zeros_differ, const void *positions, uint64_t *hashes)
{
    for (size_t t = 0; t < (size_t)frames; t++)
        for (int64_t i = 0; i < count; i++) {
            size_t at = 3 * (t * (size_t)vertex_count + (size_t)vertices[i]);
            uint64_t hash = hashes[i];
            for (size_t k = 0; k < 3; k++) {
                hash = (hash ^ bits_of(positions, at + k, is_float64, zeros_differ)) * 0x9E3779B97F4A7C15u;
                hash ^= hash >> 32;
            }
            hashes[i] = hash;
        }
}

void ath_find_apart(int64_t count, const int32_t *vertices, const int32_t *others, int32_t frames, int32_t vertex_count,
                    int is_float64, int zeros_differ, const void *positions, uint8_t *apart)
{
    for (size_t t = 0; t < (size_t)frames; t++)
        for (int64_t i = 0; i < count; i++) {
            size_t start = t * (size_t)vertex_count;
            size_t one = 3 * (start + (size_t)vertices[i]), other = 3 * (start + (size_t)others[i]);
            for (size_t k = 0; k < 3; k++)
                apart[i] |= bits_of(positions, one + k, is_float64, zeros_differ)
                            != bits_of(positions, other + k, is_float64, zeros_differ);
        }
}

/* Returns the square of the largest distance between two points over the poses. */
static double furthest(const double *one, const double *other, int32_t poses)
{
    double largest = 0.0;
    for (int32_t p = 0; p < poses; p++, one += 3, other += 3) {
        double x = one[0] - other[0], y = one[1] - other[1], z = one[2] - other[2];
        double square = (x * x + y * y) + z * z;
        if (square > largest) largest = square;
    }
    return largest;
}

static uint32_t cell_hash(const int64_t cell[3])
{
    uint64_t hash = 0;
    for (int32_t k = 0; k < 3; k++) {
        hash = (hash ^ (uint64_t)cell[k]) * 0x9E3779B97F4A7C15u;
        hash ^= hash >> 32;
    }
    return (uint32_t)hash;
}

enum { MOST_LEADERS = 64 }; /* looked at in a cell, so that time follows the number of points */

/* Returns a leader near point i in the cells around it; -1: there is none. */
static int32_t leader_near(const double *points, int32_t poses, int32_t pose, const int32_t *labels, double tolerance,
                           int32_t i, const int32_t *first, const int32_t *next, uint32_t mask, int64_t own[3])
{
    const double *at = points + (size_t)i * 3 * (size_t)poses;
    int64_t step[3];
    for (int32_t k = 0; k < 3; k++) {
        double place = at[3 * pose + k] / (2.0 * tolerance), low = (double)(int64_t)place;
        if (low > place) low = low - 1.0;
        own[k] = (int64_t)low;
        step[k] = place - low < 0.5 ? -1 : 1;
    }
    for (int32_t corner = 0; corner < 8; corner++) {
        int64_t cell[3];
        for (int32_t k = 0; k < 3; k++) cell[k] = own[k] + (corner >> k & 1 ? step[k] : 0);
        int32_t looked = 0;
        for (int32_t j = first[cell_hash(cell) & mask]; j >= 0 && looked < MOST_LEADERS; j = next[j], looked++)
            if (labels[j] == labels[i]
                && furthest(at, points + (size_t)j * 3 * (size_t)poses, poses) <= tolerance * tolerance)
                return j;
    }
    return -1;
}

void ath_find_near(int32_t count, int32_t poses, int32_t pose, const double *points, const int32_t *labels,
                   double tolerance, int32_t *work, uint32_t table, int32_t *leaders)
{
    int32_t *first = work, *next = work + table;
    for (uint32_t h = 0; h < table; h++) first[h] = -1;
    for (int32_t i = 0; i < count; i++) {
        int64_t cell[3];
        int32_t found = leader_near(points, poses, pose, labels, tolerance, i, first, next, table - 1, cell);
        leaders[i] = found < 0 ? i : found;
        if (found >= 0) continue;
        int32_t *head = first + (cell_hash(cell) & (table - 1));
        next[i] = *head;
        *head = i;
    }
}

void ath_find_far(int64_t count, const int32_t *vertices, const int32_t *others, int32_t frames, int32_t vertex_count,
                  int is_float64, const void *positions, double *squares)
{
    for (size_t t = 0; t < (size_t)frames; t++)
        for (int64_t i = 0; i < count; i++) {
            size_t one = 3 * (t * (size_t)vertex_count + (size_t)vertices[i]);
            size_t other = 3 * (t * (size_t)vertex_count + (size_t)others[i]);
            double sum = 0.0;
            for (size_t k = 0; k < 3; k++) {
                double way = is_float64 ? ((const double *)positions)[one + k] - ((const double *)positions)[other + k]
                                        : (double)((const float *)positions)[one + k]
                                              - (double)((const float *)positions)[other + k];
                sum = sum + way * way;
            }
            if (sum > squares[i]) squares[i] = sum;
        }
}
