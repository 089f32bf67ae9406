/* Sizes that the format fixes and the whole core shares. */
#ifndef ATH_BITS_FORMAT_H
#define ATH_BITS_FORMAT_H

#include "bits/platform.h"

enum {
    ATH_PIECE_VERTICES = 64,  /* longest piece of a stem */
    ATH_SEGMENT_FRAMES = 256, /* longest segment */
    ATH_LEVELS = 32,          /* most levels */
    ATH_LAYERS = 8            /* most layers of precision */
};

/* Rows of integers over temporal frequency, 3 x frames each. */
enum { SHIFT_SLOT = ATH_PIECE_VERTICES, ROTATION_SLOT, ATH_SLOTS };

/* Learned shapes are made of a piece's first modes, three axes each. */
enum { ATH_SHAPE_MODES = 16, ATH_SHAPE_NUMBERS = 3 * ATH_SHAPE_MODES, ATH_MOST_SHAPES = ATH_SHAPE_NUMBERS };

#endif
