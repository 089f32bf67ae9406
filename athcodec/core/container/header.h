/* The header of a file. */
#ifndef ATH_CONTAINER_HEADER_H
#define ATH_CONTAINER_HEADER_H

#include "bits/format.h"

typedef struct ath_header {
    uint64_t file_length, front_length;
    double max_error;
    uint32_t chunk_count, vertex_count, branch_count, frame_count, segment_count;
    int32_t level_count, full_level_count, clip_count, layer_count, is_float64, is_predicted;
    int32_t has_faces; /* whether the chunk table names FACES */
} ath_header;

/* Announced errors are stored as the top bits of a binary32 without its sign: one of ATH_SHORT_FLOATS numbers. */
enum { ATH_SHORT_SHIFT = 18, ATH_SHORT_FLOATS = 255 << 5 };

ATH_INLINE int32_t ath_kind_id(const ath_chunk *chunk) { return chunk->kind & ~ATH_OPTIONAL; }
ATH_INLINE int ath_is_motion(const ath_chunk *chunk) { return ath_kind_id(chunk) >= 16 && ath_kind_id(chunk) < 32; }

#endif
