/* Four doubles at a time. Every lane rounds each operation once, as a scalar does, so that the number of lanes of the
 * machine makes no difference. */
#ifndef ATH_MODEL_LANES_H
#define ATH_MODEL_LANES_H

#include "bits/platform.h"

enum { ATH_LANES = 4 };

#if defined(__GNUC__)

typedef double ath_lanes __attribute__((vector_size(ATH_LANES * 8), aligned(8), may_alias));

ATH_INLINE void lanes_set(ath_lanes *to, double x) { *to = (ath_lanes){x, x, x, x}; }

/* to += weight * from */
ATH_INLINE void lanes_add_scaled(ath_lanes *to, double weight, const double *from)
{
    *to = *to + weight * *(const ath_lanes *)(const void *)from;
}

/* to += a * b */
ATH_INLINE void lanes_add_product(ath_lanes *to, const double *a, const double *b)
{
    *to = *to + *(const ath_lanes *)(const void *)a * *(const ath_lanes *)(const void *)b;
}

ATH_INLINE void lanes_load(ath_lanes *to, const double *from) { *to = *(const ath_lanes *)(const void *)from; }

/* to := c + row . x */
ATH_INLINE void lanes_move(double *to, const ath_lanes *c, const ath_lanes row[3], const ath_lanes x[3])
{
    *(ath_lanes *)(void *)to = *c + (row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
}

ATH_INLINE void lanes_store(double *to, const ath_lanes *from) { *(ath_lanes *)(void *)to = *from; }

#else

typedef struct {
    double lane[ATH_LANES];
} ath_lanes;

ATH_INLINE void lanes_set(ath_lanes *to, double x)
{
    for (int i = 0; i < ATH_LANES; i++) to->lane[i] = x;
}

ATH_INLINE void lanes_add_scaled(ath_lanes *to, double weight, const double *from)
{
    for (int i = 0; i < ATH_LANES; i++) to->lane[i] = to->lane[i] + weight * from[i];
}

ATH_INLINE void lanes_add_product(ath_lanes *to, const double *a, const double *b)
{
    for (int i = 0; i < ATH_LANES; i++) to->lane[i] = to->lane[i] + a[i] * b[i];
}

ATH_INLINE void lanes_load(ath_lanes *to, const double *from)
{
    for (int i = 0; i < ATH_LANES; i++) to->lane[i] = from[i];
}

ATH_INLINE void lanes_move(double *to, const ath_lanes *c, const ath_lanes row[3], const ath_lanes x[3])
{
    for (int i = 0; i < ATH_LANES; i++)
        to[i] = c->lane[i]
                + (row[0].lane[i] * x[0].lane[i] + row[1].lane[i] * x[1].lane[i] + row[2].lane[i] * x[2].lane[i]);
}

ATH_INLINE void lanes_store(double *to, const ath_lanes *from)
{
    for (int i = 0; i < ATH_LANES; i++) to[i] = from->lane[i];
}

#endif

/* Fills a row per axis with how far a shape moves ATH_LANES vertices, from its modes, the rows of `mode`. */
ATH_INLINE void lanes_of_shape(int32_t modes, const double *shape, const double *mode, int32_t mode_size, double *to,
                               int32_t to_size)
{
    ath_lanes x, y, z;
    lanes_set(&x, 0.0);
    y = z = x;
    for (int32_t m = 0; m < modes; m++, shape += 3, mode += mode_size) {
        lanes_add_scaled(&x, shape[0], mode);
        lanes_add_scaled(&y, shape[1], mode);
        lanes_add_scaled(&z, shape[2], mode);
    }
    lanes_store(to, &x);
    lanes_store(to + to_size, &y);
    lanes_store(to + 2 * to_size, &z);
}

#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector) && __has_builtin(__builtin_convertvector)
#define ATH_TRANSPOSES
#endif
#endif

/* Transposes a square of ATH_LANES rows over time into frames of floats, and adds the `origin` of each row. */
#if defined(ATH_TRANSPOSES)

typedef float ath_float_lanes __attribute__((vector_size(ATH_LANES * 4), aligned(4), may_alias));

ATH_INLINE void lanes_transpose(const double *from, size_t row_size, const double origin[ATH_LANES], float *out,
                                size_t frame_size)
{
    ath_float_lanes row[ATH_LANES];
    for (size_t i = 0; i < ATH_LANES; i++) {
        ath_lanes sum = *(const ath_lanes *)(const void *)(from + i * row_size) + origin[i];
        row[i] = __builtin_convertvector(sum, ath_float_lanes);
    }
    ath_float_lanes a = __builtin_shufflevector(row[0], row[1], 0, 4, 1, 5);
    ath_float_lanes b = __builtin_shufflevector(row[2], row[3], 0, 4, 1, 5);
    ath_float_lanes c = __builtin_shufflevector(row[0], row[1], 2, 6, 3, 7);
    ath_float_lanes d = __builtin_shufflevector(row[2], row[3], 2, 6, 3, 7);
    *(ath_float_lanes *)(void *)out = __builtin_shufflevector(a, b, 0, 1, 4, 5);
    *(ath_float_lanes *)(void *)(out + frame_size) = __builtin_shufflevector(a, b, 2, 3, 6, 7);
    *(ath_float_lanes *)(void *)(out + 2 * frame_size) = __builtin_shufflevector(c, d, 0, 1, 4, 5);
    *(ath_float_lanes *)(void *)(out + 3 * frame_size) = __builtin_shufflevector(c, d, 2, 3, 6, 7);
}

#else

ATH_INLINE void lanes_transpose(const double *from, size_t row_size, const double origin[ATH_LANES], float *out,
                                size_t frame_size)
{
    for (size_t i = 0; i < ATH_LANES; i++)
        for (size_t t = 0; t < ATH_LANES; t++) out[t * frame_size + i] = (float)(from[i * row_size + t] + origin[i]);
}

#endif

/* out[t] = first + sum of weight[i] * row[i][t], i ascending, for `frames` values of t. */
ATH_INLINE void lanes_sum(int32_t frames, int32_t count, const double *weight, const double *const *row, double first,
                          double *out)
{
    int32_t t = 0;
    for (; t + 4 * ATH_LANES <= frames; t += 4 * ATH_LANES) {
        ath_lanes a, b, c, d;
        lanes_set(&a, first);
        lanes_set(&b, first);
        lanes_set(&c, first);
        lanes_set(&d, first);
        for (int32_t i = 0; i < count; i++) {
            const double *from = row[i] + t;
            lanes_add_scaled(&a, weight[i], from);
            lanes_add_scaled(&b, weight[i], from + ATH_LANES);
            lanes_add_scaled(&c, weight[i], from + 2 * ATH_LANES);
            lanes_add_scaled(&d, weight[i], from + 3 * ATH_LANES);
        }
        lanes_store(out + t, &a);
        lanes_store(out + t + ATH_LANES, &b);
        lanes_store(out + t + 2 * ATH_LANES, &c);
        lanes_store(out + t + 3 * ATH_LANES, &d);
    }
    for (; t + ATH_LANES <= frames; t += ATH_LANES) {
        ath_lanes a;
        lanes_set(&a, first);
        for (int32_t i = 0; i < count; i++) lanes_add_scaled(&a, weight[i], row[i] + t);
        lanes_store(out + t, &a);
    }
    for (; t < frames; t++) {
        double sum = first;
        for (int32_t i = 0; i < count; i++) sum = sum + weight[i] * row[i][t];
        out[t] = sum;
    }
}

#endif
