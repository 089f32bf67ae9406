/* Corrections: vectors in steps that are added to positions around a frame. */
#ifndef ATH_MODEL_CORRECTIONS_H
#define ATH_MODEL_CORRECTIONS_H

#include "bits/format.h"

enum { ATH_FOOTPRINTS = 3, ATH_FOOTPRINT_REACH = 3, ATH_FOOTPRINT_PARTS = 32 };

static const int32_t ath_footprint_reach[ATH_FOOTPRINTS] = {0, 1, 3};

/* Returns the share, in ATH_FOOTPRINT_PARTS, that a correction adds `away` frames from its own. It is 0 one and two
 * frames beyond its reach. */
ATH_INLINE int32_t ath_footprint_part(int32_t width, int32_t away)
{
    static const int32_t parts[ATH_FOOTPRINTS][ATH_FOOTPRINT_REACH + 3] = {{32}, {32, 16}, {32, 27, 16, 5}};
    return parts[width][away < 0 ? -away : away];
}

/* A vector in steps, and its footprint in time. */
typedef struct ath_correction {
    int32_t q[3], width;
} ath_correction;

/* Sums of a vertex's corrections per frame, in parts. They are whole numbers, so their order does not matter. */
typedef double ath_corrected_parts[ATH_SEGMENT_FRAMES][3];

ATH_INLINE void ath_add_correction(int32_t frames, int32_t t, const ath_correction *own, ath_corrected_parts parts)
{
    int32_t reach = ath_footprint_reach[own->width];
    for (int32_t i = ath_max(0, t - reach); i <= ath_min(frames - 1, t + reach); i++)
        for (int32_t k = 0; k < 3; k++) parts[i][k] += (double)own->q[k] * ath_footprint_part(own->width, i - t);
}

ATH_INLINE double ath_corrected(double position, double parts, double step)
{
    return position + parts * (step / (double)ATH_FOOTPRINT_PARTS);
}

#endif
