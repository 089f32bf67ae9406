/* The layouts of the structs that Python repeats (_native.py, core_file.py), which it compares when it loads the
 * library: a struct that one side alone changes would otherwise be read and written at wrong places. */
#include <stddef.h>

#include "encode/encode.h"

typedef struct {
    const char *name; /* "struct", or "struct.field" */
    size_t offset, size;
} layout;

/* clang-format off */
#define STRUCT(s) {#s, 0, sizeof(s)},
#define ONE(s, a) {#s "." #a, offsetof(s, a), sizeof(((s *)0)->a)},
#define TWO(s, a, b) ONE(s, a) ONE(s, b)
#define FOUR(s, a, b, c, d) TWO(s, a, b) TWO(s, c, d)
#define EIGHT(s, a, b, c, d, e, f, g, h) FOUR(s, a, b, c, d) FOUR(s, e, f, g, h)

static const layout LAYOUTS[] = {
    STRUCT(ath_limits)
        EIGHT(ath_limits, chunks, table_bytes, vertices, branches, frames, hierarchy_depth, chunk_bytes, reserved)
        ONE(ath_limits, memory_bytes)
    STRUCT(ath_info)
        EIGHT(ath_info, file_length, prelude_length, max_error, origin, vertex_count, branch_count, frame_count, segment_count)
        ONE(ath_info, place_count)
        EIGHT(ath_info, clip_count, level_count, full_level_count, layer_count, depth_levels, node_count, chunk_count, is_float64)
        FOUR(ath_info, rest_is_float64, rest_is_host, host_checksum, is_predicted)
    STRUCT(ath_clip)
        EIGHT(ath_clip, name, duration, first_frame, frame_count, first_segment, segment_count, loop, periodic)
    STRUCT(ath_fault_info) EIGHT(ath_fault_info, code, field, chunk, kind, level, reserved, segment, offset)
        TWO(ath_fault_info, found, least) ONE(ath_fault_info, most)
    STRUCT(ath_share) FOUR(ath_share, segments, segment_count, frame, weight)
    STRUCT(ath_range) TWO(ath_range, offset, size)
    STRUCT(ath_part) FOUR(ath_part, first, count, branch, index)
    STRUCT(ath_branch) EIGHT(ath_branch, parent, count, attach, flags, lag, first, subtree, depth)
        TWO(ath_branch, rigid, detail) ONE(ath_branch, ring)
    STRUCT(ath_chunk) EIGHT(ath_chunk, bytes, offset, length, checksum, segment, kind, level, stage)
    STRUCT(ath_polygons) FOUR(ath_polygons, face_count, corner_count, columns, is_mixed)
        TWO(ath_polygons, is_derived, index_type) ONE(ath_polygons, count_type)
    STRUCT(ath_piece) EIGHT(ath_piece, modes, basis, attach_cache, first, count, parent, attach, branch)
        FOUR(ath_piece, flags, rank, stage, low_stage) FOUR(ath_piece, low_modes, last_attached, ring, modes_stage)
        TWO(ath_piece, tip_weight, attached)
    STRUCT(ath_node) EIGHT(ath_node, whitening, branch, piece, first, count, stage, last_stage, coded) ONE(ath_node, rank)
    STRUCT(ath_plan)
        EIGHT(ath_plan, vertex_count, branch_count, piece_count, node_count, attach_cache_rows, height, longest, branches)
        FOUR(ath_plan, pieces, nodes, rest, bases)
    STRUCT(ath_stream) FOUR(ath_stream, step, rotation_step_factor, temporal, temporal_rank)
        TWO(ath_stream, root, turn_step)
    STRUCT(ath_motion) EIGHT(ath_motion, streams, waves, attach_caches, work, before, known, frames, ratio)
    STRUCT(ath_coarse) FOUR(ath_coarse, plan, motion, integers, turn_steps) ONE(ath_coarse, nothing)
    STRUCT(ath_integers)
        EIGHT(ath_integers, coefficients, tracks, node_tracks, node_steps, predicted, predicted_tracks, shape_counts, shape_first)
        TWO(ath_integers, shapes, duals) ONE(ath_integers, first_rows)
    STRUCT(ath_rounding) FOUR(ath_rounding, dead_zone, ends, roots_turn, reserved)
    STRUCT(ath_met_ends) FOUR(ath_met_ends, decided, count, closed, reserved)
    STRUCT(ath_header) ONE(ath_header, place_count)
        EIGHT(ath_header, file_length, front_length, max_error, chunk_count, vertex_count, branch_count, frame_count, segment_count)
        FOUR(ath_header, level_count, full_level_count, clip_count, layer_count)
        FOUR(ath_header, is_float64, is_predicted, has_faces, stage_count) ONE(ath_header, stages)
};
/* clang-format on */

const char *ath_layout(int32_t index, size_t *offset, size_t *size)
{
    if (index < 0 || (size_t)index >= sizeof LAYOUTS / sizeof *LAYOUTS) return 0;
    *offset = LAYOUTS[index].offset;
    *size = LAYOUTS[index].size;
    return LAYOUTS[index].name;
}
