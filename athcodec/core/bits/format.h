/* Sizes that the format fixes and the whole core shares. */
#ifndef ATH_BITS_FORMAT_H
#define ATH_BITS_FORMAT_H

#include "bits/platform.h"

enum {
    ATH_PIECE_VERTICES = 64,  /* vertices of the longest piece of a stem */
    ATH_SEGMENT_FRAMES = 256, /* frames of the longest segment */
    ATH_LEVELS = 32,          /* largest number of stages, and so of levels */
    ATH_LAYERS = 8            /* largest number of layers of precision */
};

/* Order of a piece's rows of integers (3 x frames each, over temporal frequency): a row per mode, then the shift, then
 * the rotation. */
enum { SHIFT_SLOT = ATH_PIECE_VERTICES, ROTATION_SLOT, ATH_SLOTS };

/* A learned shape combines a piece's first modes on three axes. */
enum { ATH_SHAPE_MODES = 16, ATH_SHAPE_NUMBERS = 3 * ATH_SHAPE_MODES, ATH_MOST_SHAPES = ATH_SHAPE_NUMBERS };

#endif
