/* Compilers and C libraries made equal, and helpers that every file of the core uses.
 *
 * Every sum runs in the order that FORMAT.md states, over doubles, with contraction to FMA off, so that all decoders
 * agree bit for bit. Hot loops run over frames: lanes are independent, and any SIMD width gives the same result. */
#ifndef ATH_BITS_PLATFORM_H
#define ATH_BITS_PLATFORM_H

#include "ath.h"

/* A build whose arithmetic would give other bits fails. Each compiler has its own way to switch off FMA contraction. */
#if defined(__FAST_MATH__)
#error "athcodec: expected a build without -ffast-math, which would change what a file decodes to"
#endif
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0 && __FLT_EVAL_METHOD__ != 16
#error "athcodec: expected doubles in registers as wide as they are (on i386: -msse2 -mfpmath=sse)"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__) && (defined(__FMA__) || defined(__FMA4__) || !(defined(__x86_64__) || defined(__i386__)))
#pragma GCC optimize("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif

/* Hot loops are compiled for AVX2, too, if compiler and C library can choose at load time. Clang cannot: other files do
 * not find its clones. With ThreadSanitizer the choice would run before the sanitizer does, and crash. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__)                              \
    && !defined(__SANITIZE_THREAD__)
#define ATH_HOT __attribute__((target_clones("avx2", "default")))
/* For loops whose results do not depend on rounding: multiplications and additions may be fused. */
#define ATH_FUSED __attribute__((target_clones("fma", "default"), optimize("fp-contract=fast")))
#else
#define ATH_HOT
#define ATH_FUSED
#endif

#if defined(__GNUC__)
#define ATH_INLINE static inline __attribute__((always_inline, unused))
#else
#define ATH_INLINE static inline
#endif

#ifdef __cplusplus
#define ATH_RESTRICT __restrict
#else
#define ATH_RESTRICT restrict
#endif

/* Prefetches memory that will be written soon. The address may be invalid. Long chains of operations run a few at a time
 * where one chain leaves the processor waiting, and alone where the code has to be small. */
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__aarch64__))
#define ath_expect_write(address) __builtin_prefetch((const void *)(address), 1)
enum { ATH_CHAINS = 4 };
#else
#define ath_expect_write(address) ((void)(address))
enum { ATH_CHAINS = 1 };
#endif

#if defined(__STDC_HOSTED__) && __STDC_HOSTED__
#include <string.h>
#else
#ifdef __cplusplus
extern "C" {
#endif
void *memcpy(void *ATH_RESTRICT to, const void *ATH_RESTRICT from, size_t size);
void *memset(void *to, int value, size_t size);
#ifdef __cplusplus
}
#endif
#endif

/* Functions that an encoder calls besides ath.h are exported only if the encoder is built in. */
#if defined(ATH_ENCODER)
#define ATH_ENCODER_API ATH_API
#else
#define ATH_ENCODER_API
#endif

#if defined(__GNUC__)
#define ath_sqrt __builtin_sqrt
#else
#include <math.h>
#define ath_sqrt sqrt
#endif

ATH_INLINE int32_t ath_min(int32_t a, int32_t b) { return a < b ? a : b; }
ATH_INLINE uint64_t ath_larger(uint64_t a, uint64_t b) { return a > b ? a : b; }
ATH_INLINE int32_t ath_max(int32_t a, int32_t b) { return a > b ? a : b; }

/* Rounds to float. Without volatile, GCC 12 at -O2 puts two of these into one vector and forgets to round. */
ATH_INLINE double ath_single(double x)
{
    volatile float rounded = (float)x;
    return (double)rounded;
}

/* Numbers of positions are doubles if is_float64 is 1, else floats. */
ATH_INLINE size_t ath_number_size(int is_float64) { return is_float64 ? sizeof(double) : sizeof(float); }
ATH_INLINE double ath_number_at(const void *numbers, size_t at, int is_float64)
{
    return is_float64 ? ((const double *)numbers)[at] : (double)((const float *)numbers)[at];
}
ATH_INLINE void ath_put_number(void *numbers, size_t at, int is_float64, double number)
{
    if (is_float64)
        ((double *)numbers)[at] = number;
    else
        ((float *)numbers)[at] = (float)number;
}

/* Takes units of work from a budget; null: there is no limit. Returns 0, and takes nothing, once the budget is spent. */
ATH_INLINE int ath_spend(int32_t *budget, int32_t units)
{
#ifdef ATH_AT_ONCE
    (void)budget, (void)units;
#else
    if (budget && *budget <= 0) return 0;
    if (budget) *budget -= units;
#endif
    return 1;
}

ATH_INLINE size_t ath_size_or_most(uint64_t size) { return size < SIZE_MAX ? (size_t)size : SIZE_MAX; }

/* Cuts one block of memory into parts of whole cache lines. If the base is null, it only counts. */
typedef struct {
    uint8_t *base;
    uint64_t used;
} ath_arena;

ATH_INLINE void *ath_take(ath_arena *arena, uint64_t size)
{
    uint8_t *at = arena->base ? arena->base + arena->used : 0;
    arena->used += (size + 63) & ~(uint64_t)63;
    return at;
}

ATH_INLINE int ath_fits(const void *memory, size_t size, uint64_t needed)
{
    return memory && ((uintptr_t)memory & 15) == 0 && size >= needed;
}

#endif
