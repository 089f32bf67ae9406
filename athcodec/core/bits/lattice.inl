/* Points of a body-centred cubic lattice, three integers, all even or all odd (FORMAT.md, "Lattice points"). Compiled
 * for each direction. */
#ifndef ATH_BITS_LATTICE_INL
#define ATH_BITS_LATTICE_INL

#include "bits/numbers.inl"

#define LATTICE_UNIT 0.625              /* steps: the lattice has as many points as there are cubes of a step */
#define LATTICE_REACH 1.118033988749895 /* units: largest distance from a point of the lattice, half the root of 5 */

/* Knowledge of an integer before it is coded. */
enum { ANY_INTEGER, EVEN_INTEGER, ODD_INTEGER, PARITIES };

typedef struct {
    number_model parities[PARITIES];
} lattice_model;

static void lattice_model_init(lattice_model *model)
{
    for (int32_t parity = 0; parity < PARITIES; parity++) number_model_init(&model->parities[parity]);
}

/* The parity of the first integer of a point is that of the others. */
ATH_INLINE int32_t parity_of(const int32_t point[3], int32_t k)
{
    return k == 0 ? ANY_INTEGER : point[0] & 1 ? ODD_INTEGER : EVEN_INTEGER;
}

#ifdef ATH_ENCODING

/* Finds the point within the slack that is likely to take the fewest bits, else the nearest point. */
static void nearest_of_lattice(const double units[3], double slack, const uint32_t mean[3], int32_t integers[3])
{
    double cheapest = 0.0, nearest = 0.0;
    int found = 0, any = 0;
    for (int32_t choice = 0; choice < 16; choice++) {
        int32_t odd = choice & 1, point[3];
        double distance = 0.0, cost = 1.0;
        for (int32_t k = 0; k < 3; k++) {
            point[k] = 2 * steps_in(units[k] - odd, 2.0, 0.5) + odd;
            if (choice >> (k + 1) & 1) point[k] += point[k] > 0 ? -2 : 2;
            distance += (units[k] - point[k]) * (units[k] - point[k]);
            cost *= 1.0 + 32.0 * magnitude_of(point[k]) / (16.0 + mean[k]);
        }
        if (distance <= slack * slack) {
            cost *= 1.0 + 0.07 * distance / (slack * slack);
            if (!found || cost < cheapest) memcpy(integers, point, sizeof point);
            if (!found || cost < cheapest) cheapest = cost;
            found = 1;
        } else if (!found && (!any || distance < nearest)) {
            memcpy(integers, point, sizeof point);
            nearest = distance;
            any = 1;
        }
    }
}

#endif

/* about: class of the expected magnitude. */
static int32_t code_integer(ath_coder *coder, lattice_model *model, int32_t parity, int32_t about, int32_t value)
{
    number_model *numbers = &model->parities[parity];
    int32_t doubled = parity != ANY_INTEGER, odd = parity == ODD_INTEGER, negative = 0;
    if (doubled) about = about > 2 ? about - 2 : 0;
    if (odd) negative = coder_raw_bit(coder, value < 0);
    uint32_t coded = code_in_class(coder, numbers, about, magnitude_of(value) >> doubled);
    if (!odd && coded != 0) negative = coder_raw_bit(coder, value < 0);
    int32_t magnitude = (int32_t)(coded << doubled) + odd;
    return negative ? -magnitude : magnitude;
}

#endif
