/* The header of a file. */
#ifndef ATH_CONTAINER_HEADER_H
#define ATH_CONTAINER_HEADER_H

#include "bits/format.h"

typedef struct ath_header {
    uint64_t file_length, front_length;
    double max_error;
    uint32_t chunk_count, vertex_count, place_count, branch_count, frame_count, segment_count;
    int32_t level_count, full_level_count, clip_count, layer_count, is_float64, is_predicted;
    int32_t has_faces;          /* whether the chunk table names FACES */
    int32_t stage_count;        /* stages up to the last stored level, see ath_stage_of */
    uint8_t stages[ATH_LEVELS]; /* the stages of all full_level_count levels, ascending */
} ath_header;

/* Callers, and the errors, joins and seams of a file, number the levels that can be shown. Chunks, pieces, nodes and
 * layers go by stages: all that the hierarchy and the layers make, whether shown or not. -1 stands for no level. */
ATH_INLINE int32_t ath_stage_of(const ath_header *header, int32_t level)
{
    return level < 0 ? -1 : header->stages[level];
}

/* Returns the first level, stored or not, that needs a stage. */
ATH_INLINE int32_t ath_level_of(const ath_header *header, int32_t stage)
{
    int32_t level = 0;
    while (level < header->full_level_count - 1 && header->stages[level] < stage) level++;
    return level;
}

/* Announced errors are stored as the top bits of a binary32 without its sign: one of ATH_SHORT_FLOATS numbers. */
enum { ATH_SHORT_SHIFT = 18, ATH_SHORT_FLOATS = 255 << 5 };

ATH_INLINE int32_t ath_kind_id(const ath_chunk *chunk) { return chunk->kind & ~ATH_OPTIONAL; }
ATH_INLINE int ath_is_motion(const ath_chunk *chunk) { return ath_kind_id(chunk) >= 16 && ath_kind_id(chunk) < 32; }

#endif
