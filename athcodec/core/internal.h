/* What the files of the core share: limits, small helpers, and the layout rules of the motion arrays.
 *
 * Every sum below runs in the order that FORMAT.md states, over doubles, with contraction to FMA off, so that all
 * decoders agree bit for bit. Loops are written over frames: lanes are independent, and any SIMD width gives the
 * same result. */
#ifndef ATH_INTERNAL_H
#define ATH_INTERNAL_H

#include "ath.h"

/* Hot loops are compiled for AVX2 too, where compiler and C library can choose at load time (clang names such clones
 * so that other files do not find them). Lanes are frames: the results are the same. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__)
#define ATH_HOT __attribute__((target_clones("avx2", "default")))
#else
#define ATH_HOT
#endif

#if defined(__GNUC__)
#define ATH_INLINE static inline __attribute__((always_inline))
#else
#define ATH_INLINE static inline
#endif

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memset(void *to, int value, size_t size);

#if defined(__GNUC__)
#define ath_sqrt __builtin_sqrt
#else
double sqrt(double);
#define ath_sqrt sqrt
#endif

ATH_INLINE int32_t ath_min(int32_t a, int32_t b) { return a < b ? a : b; }
ATH_INLINE int32_t ath_max(int32_t a, int32_t b) { return a > b ? a : b; }

#endif
