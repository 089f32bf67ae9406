/* Rotations over time: matrices are row-major, 9 rows of `frames` numbers each. */
#ifndef ATH_MODEL_ROTATIONS_H
#define ATH_MODEL_ROTATIONS_H

#include "bits/format.h"

/* Composes each rotation R with the least rotation that takes `tangent`, turned by R, to the direction from `from` to
 * `to`. Both are 3 x frames. Where a direction vanishes, the result is R. A single rotation may be turned in place. */
void ath_follow_tangents(int32_t frames, const double *tangent, const double *from, const double *to, const double *R,
                         double *turned);
/* R := R Q(omega), where Q is the rotation of the quaternion normalize(1, omega / 4) squared. */
void ath_turn(int32_t frames, const double *omega, double *R);
/* Fills the vector that ath_turn takes for a rotation matrix. `q` holds the unit quaternion of the frame before, and
 * then that of this one: of its two signs, the one that is nearer. */
void ath_rotation_vector(const double R[9], double q[4], double omega[3]);
/* Fills the vectors that turn the rotations `from` into the rotations `to`. */
void ath_rotations_between(int32_t frames, const double *from, const double *to, double *omega);

/* Fills the rotation of the quaternion normalize(1, x, y, z) squared. */
ATH_INLINE void rational_rotation(double x, double y, double z, double q[9])
{
    double n2 = x * x + y * y + z * z, scale = 1.0 / (1.0 + n2);
    double w = (1.0 - n2) * scale;
    x = 2.0 * x * scale;
    y = 2.0 * y * scale;
    z = 2.0 * z * scale;
    q[0] = 1.0 - 2.0 * (y * y + z * z);
    q[1] = 2.0 * (x * y - w * z);
    q[2] = 2.0 * (x * z + w * y);
    q[3] = 2.0 * (x * y + w * z);
    q[4] = 1.0 - 2.0 * (x * x + z * z);
    q[5] = 2.0 * (y * z - w * x);
    q[6] = 2.0 * (x * z - w * y);
    q[7] = 2.0 * (y * z + w * x);
    q[8] = 1.0 - 2.0 * (x * x + y * y);
}

#endif
