/* Rotations at every frame: least turns, nearest rotations, quaternions (FORMAT.md, "Reconstruction"). */
#include "model/rotations.h"

enum { TURN_LANES = 4 };

/* Beyond a right angle the turn shrinks, so that the result is R itself where the directions are opposed. */
ATH_INLINE void turn_lanes(int32_t count, int32_t T, const double *tangent, const double *from, const double *to,
                           const double *parent, double turned[9][TURN_LANES])
{
    for (int32_t t = 0; t < count; t++) {
        double r0 = parent[t], r1 = parent[T + t], r2 = parent[2 * T + t], r3 = parent[3 * T + t];
        double r4 = parent[4 * T + t], r5 = parent[5 * T + t], r6 = parent[6 * T + t], r7 = parent[7 * T + t];
        double r8 = parent[8 * T + t];
        double ux = r0 * tangent[0] + r1 * tangent[1] + r2 * tangent[2];
        double uy = r3 * tangent[0] + r4 * tangent[1] + r5 * tangent[2];
        double uz = r6 * tangent[0] + r7 * tangent[1] + r8 * tangent[2];
        double u2 = ux * ux + uy * uy + uz * uz; /* 1 but for rounding, which must not grow along a chain */
        double straighten = 1.0 / ath_sqrt(u2 > 1e-200 ? u2 : 1.0);
        ux = ux * straighten;
        uy = uy * straighten;
        uz = uz * straighten;
        double vx = to[t] - from[t], vy = to[T + t] - from[T + t], vz = to[2 * T + t] - from[2 * T + t];
        double v2 = vx * vx + vy * vy + vz * vz;
        double inverse = 1.0 / ath_sqrt(v2 > 1e-200 ? v2 : 1.0);
        vx = vx * inverse;
        vy = vy * inverse;
        vz = vz * inverse;
        double cosine = ux * vx + uy * vy + uz * vz;
        double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
        double w = 1.0 + (cosine > 0.0 ? cosine : 0.0),
               sine2 = x * x + y * y + z * z; /* w, x, y, z: a quaternion, not normalised */
        double h = 2.0 / (w * w + sine2), g = w * h, c = 1.0 - h * sine2;
        double b0 = c + h * x * x, b1 = h * x * y - g * z, b2 = h * x * z + g * y;
        double b3 = h * x * y + g * z, b4 = c + h * y * y, b5 = h * y * z - g * x;
        double b6 = h * x * z - g * y, b7 = h * y * z + g * x, b8 = c + h * z * z;
        turned[0][t] = b0 * r0 + b1 * r3 + b2 * r6;
        turned[1][t] = b0 * r1 + b1 * r4 + b2 * r7;
        turned[2][t] = b0 * r2 + b1 * r5 + b2 * r8;
        turned[3][t] = b3 * r0 + b4 * r3 + b5 * r6;
        turned[4][t] = b3 * r1 + b4 * r4 + b5 * r7;
        turned[5][t] = b3 * r2 + b4 * r5 + b5 * r8;
        turned[6][t] = b6 * r0 + b7 * r3 + b8 * r6;
        turned[7][t] = b6 * r1 + b7 * r4 + b8 * r7;
        turned[8][t] = b6 * r2 + b7 * r5 + b8 * r8;
    }
}

ATH_HOT void ath_follow_tangents(int32_t T, const double *tangent, const double *from, const double *to,
                                 const double *parent, double *out)
{
    double turned[9][TURN_LANES]; /* a local copy is not aliased, so that compilers use SIMD */
    int32_t t = 0;
    for (; t + TURN_LANES <= T; t += TURN_LANES) {
        turn_lanes(TURN_LANES, T, tangent, from + t, to + t, parent + t, turned);
        for (int32_t k = 0; k < 9; k++) memcpy(out + k * T + t, turned[k], sizeof turned[k]);
    }
    for (; t < T; t++) {
        turn_lanes(1, T, tangent, from + t, to + t, parent + t, turned);
        for (int32_t k = 0; k < 9; k++) out[k * T + t] = turned[k][0];
    }
}

ATH_HOT void ath_turn(int32_t T, const double *omega, double *ATH_RESTRICT R)
{
    for (int32_t t = 0; t < T; t++) {
        double q[9];
        rational_rotation(0.25 * omega[t], 0.25 * omega[T + t], 0.25 * omega[2 * T + t], q);
        for (int32_t i = 0; i < 3; i++) {
            double *r = R + 3 * i * T;
            double r0 = r[t], r1 = r[T + t], r2 = r[2 * T + t];
            r[t] = r0 * q[0] + r1 * q[3] + r2 * q[6];
            r[T + t] = r0 * q[1] + r1 * q[4] + r2 * q[7];
            r[2 * T + t] = r0 * q[2] + r1 * q[5] + r2 * q[8];
        }
    }
}

static void to_quaternion(const double R[9], double q[4])
{
    double size[4] = {1.0 + R[0] + R[4] + R[8], 1.0 + R[0] - R[4] - R[8], 1.0 - R[0] + R[4] - R[8],
                      1.0 - R[0] - R[4] + R[8]};
    double symmetric[6] = {R[7] - R[5], R[2] - R[6], R[3] - R[1], R[1] + R[3], R[2] + R[6], R[5] + R[7]};
    static const int8_t row[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};
    int32_t largest = 0;
    double p[4], length2 = 0.0, towards = 0.0;
    for (int32_t i = 1; i < 4; i++)
        if (size[i] > size[largest]) largest = i;
    for (int32_t i = 0; i < 4; i++) {
        p[i] = i == largest ? size[i] : symmetric[row[largest][i]];
        length2 = length2 + p[i] * p[i];
        towards = towards + p[i] * q[i];
    }
    double scale = (towards < 0.0 ? -1.0 : 1.0) / ath_sqrt(length2);
    for (int32_t i = 0; i < 4; i++) q[i] = p[i] * scale;
}

void ath_rotation_vector(const double R[9], double q[4], double omega[3])
{
    to_quaternion(R, q);
    if (q[0] < -0.9) /* beyond about 310 degrees, turn the other way round */
        for (int32_t i = 0; i < 4; i++) q[i] = -q[i];
    for (int32_t k = 0; k < 3; k++) omega[k] = 4.0 * q[k + 1] / (1.0 + q[0]);
}

void ath_rotations_between(int32_t T, const double *from, const double *to, double *omega)
{
    double q[4] = {1.0, 0.0, 0.0, 0.0};
    for (int32_t t = 0; t < T; t++) {
        double R[9], own[3];
        for (int32_t i = 0; i < 3; i++)
            for (int32_t k = 0; k < 3; k++)
                R[3 * i + k] = from[i * T + t] * to[k * T + t] + from[(3 + i) * T + t] * to[(3 + k) * T + t]
                               + from[(6 + i) * T + t] * to[(6 + k) * T + t];
        ath_rotation_vector(R, q, own);
        for (int32_t k = 0; k < 3; k++) omega[k * T + t] = own[k];
    }
}
