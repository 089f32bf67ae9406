/* Which vertices of a clip have the same positions, compared bit by bit. */
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
