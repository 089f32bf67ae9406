/* The memory of a preparation and of its segment, and what all phases ask of it. */
#include "play/work.h"

static void carve_stems(ath_work *work, const ath_file *file, int32_t d, int32_t frames, ath_arena *arena)
{
    shapes_reader *shapes = work->shapes + d;
    stems_reader *stems = work->stems + d;
    int has_shapes = ath_file_chunk(file, ATH_SHAPES, d, 0) != 0;
    if (ath_layer_of(file, d) > 0) {
        if (has_shapes) shapes->refined = (refined_shape_model *)ath_take(arena, sizeof(refined_shape_model));
        stems->refined = (refinement_model *)ath_take(arena, sizeof(refinement_model));
        stems->history = (uint32_t *)ath_take(arena, history_size(frames));
    } else {
        if (has_shapes) shapes->model = (shape_model *)ath_take(arena, sizeof(shape_model));
        stems->model = (coefficient_model *)ath_take(arena, sizeof(coefficient_model));
        stems->history = (uint32_t *)ath_take(arena, history_size(frames));
    }
    stems->temporal = (double *)ath_take(arena, (uint64_t)frames * (uint64_t)frames * sizeof(double));
}

static void carve_layer(layer_work *layer, const ath_file *file, int32_t q, int32_t frames, ath_arena *arena)
{
    uint64_t T = (uint64_t)frames, row = 3 * T * sizeof(int32_t), rows = (uint64_t)file->plan.longest * row;
    layer->shape_integers = (int32_t *)ath_take(arena, ATH_MOST_SHAPES * ATH_SHAPE_NUMBERS * sizeof(int32_t));
    layer->unit_shapes = (double *)ath_take(arena, ATH_MOST_SHAPES * ATH_SHAPE_NUMBERS * sizeof(double));
    layer->rows.modes = (int32_t *)ath_take(arena, rows);
    layer->rows.rotation = (int32_t *)ath_take(arena, row);
    layer->rows.shift = (int32_t *)ath_take(arena, row);
    if (q > 0) {
        layer->rows.predicted_modes = (int32_t *)ath_take(arena, rows);
        layer->rows.predicted_rotation = (int32_t *)ath_take(arena, row);
        layer->rows.predicted_shift = (int32_t *)ath_take(arena, row);
    }
    layer->motion.work = (double *)ath_take(arena, ath_motion_work(file->plan.longest, frames) * sizeof(double));
    layer->motion.attach_caches =
        (double *)ath_take(arena, (uint64_t)file->plan.attach_cache_rows * 3 * T * sizeof(double));
}

uint64_t ath_carve_work(ath_work *work, const ath_file *file, int32_t frames, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t row = 3 * (uint64_t)frames * sizeof(int32_t);
    ath_take(&arena, sizeof *work);
    if (file->has_joins) ath_carve_end(&work->join, file, &arena);
    for (int32_t d = 0; d < file->header.stage_count; d++) {
        if (file->stems_stages >> d & 1) carve_stems(work, file, d, frames, &arena);
        if (file->shown_affines >> d & 1) {
            work->affines[d].model = (affine_model *)ath_take(&arena, sizeof(affine_model));
            work->affines[d].history = (uint32_t *)ath_take(&arena, history_size(frames));
        }
    }
    work->corrections.model = (correction_model *)ath_take(&arena, sizeof(correction_model));
    if (ath_file_is_lossless(file)) work->exact_level.model = (exact_model *)ath_take(&arena, sizeof(exact_model));
    if (ath_predicts(file))
        work->prediction = (ath_prediction *)ath_take(&arena, ath_prediction_size(file->plan.vertex_count));
    work->prelude_model = ath_take(&arena, ath_prelude_model_size());
    work->node.rows = (int32_t *)ath_take(&arena, 4 * row);
    for (int32_t q = 0; q <= ath_layer_of(file, file->header.stage_count - 1); q++)
        carve_layer(work->layers + q, file, q, frames, &arena);
    return arena.used;
}

uint64_t ath_carve_segment(ath_segment *segment, const ath_file *file, int32_t level, int32_t frames, int is_full,
                           uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t T = (uint64_t)frames, number = ath_number_size(file->info.is_float64);
    segment->frames = frames;
    segment->is_float64 = file->info.is_float64;
    ath_cut_size(file, level, &segment->part_count, &segment->node_count, &segment->exact_vertices);
    ath_take(&arena, sizeof *segment);
    segment->parts = (ath_part *)ath_take(&arena, (uint64_t)segment->part_count * sizeof(ath_part));
    segment->maps = (double *)ath_take(&arena, T * (uint64_t)segment->node_count * ATH_MAP * sizeof(double));
    if (file->has_joins)
        segment->end = ath_take(&arena, ATH_END_FRAMES * (uint64_t)segment->exact_vertices * 3 * number);
    if (is_full) segment->positions = ath_take(&arena, T * (uint64_t)segment->exact_vertices * 3 * number);
    return arena.used;
}

size_t ath_work_size(const ath_file *file)
{
    ath_work counted;
    return ath_size_or_most(ath_carve_work(&counted, file, file->longest, 0));
}

size_t ath_segment_size(const ath_file *file, int32_t level)
{
    ath_segment counted;
    return ath_size_or_most(ath_carve_segment(&counted, file, level, file->longest, 1, 0));
}

/* Returns whether the vertices of each piece stand side by side in the source, which may have the pieces in another
 * order. Predicted motion is written by vertex, not by piece. */
static int are_side_by_side(const ath_file *file)
{
    const int32_t *source = file->vertex_source;
    if (ath_predicts(file)) return 0;
    for (const ath_piece *piece = file->plan.pieces; piece < file->plan.pieces + file->plan.piece_count; piece++)
        for (int32_t v = piece->first; v < piece->first + piece->count; v++)
            if (source[v] - source[piece->first] != v - piece->first) return 0;
    return 1;
}

int ath_is_source_order(const ath_file *file)
{
    int32_t vertex = 0;
    while (vertex < file->plan.vertex_count && file->vertex_source[vertex] == vertex) vertex++;
    return vertex == file->plan.vertex_count;
}

int ath_are_copied(const ath_file *file, int32_t index, int32_t level)
{
    int32_t exact, frames = ath_segment_start(file, index + 1) - ath_segment_start(file, index);
    ath_cut_size(file, level, 0, 0, &exact);
    if (ath_is_split(file) || exact < file->plan.vertex_count || frames != ath_file_frames(file, index)) return 0;
    return ath_is_source_order(file) || are_side_by_side(file);
}

size_t ath_segment_size_to(const ath_file *file, int32_t segment, int32_t level)
{
    ath_segment counted;
    int is_full = !ath_are_copied(file, segment, level) || ath_joined_to(file, segment, level) >= 0;
    return ath_size_or_most(ath_carve_segment(&counted, file, level, file->longest, is_full, 0));
}

int ath_keep(ath_work *work, void *memory, size_t memory_bytes)
{
    kept_head *head = (kept_head *)memory;
    if (!ath_fits(memory, memory_bytes, sizeof *head)) return ATH_NO_MEMORY;
    head->bytes = 0;
    if (!ath_can_be_kept(work->file, work->stage)) return ATH_OK;
    head->segment = work->index;
    head->stage = work->stage;
    work->asked.keeps = work->keeps = head;
    work->keeping.at = (uint8_t *)(head + 1);
    work->keeping.end = (uint8_t *)memory + memory_bytes;
    work->asked.keeping = work->keeping;
    return ATH_OK;
}

/* The observer follows the segment asked for, not the one before it. */
ath_watcher *ath_watcher_of(const ath_work *work) { return work->only_end ? 0 : work->asked.watcher; }

const ath_chunk *ath_wanted_chunk(const ath_file *file, int32_t segment, int32_t stage, int32_t kind, int32_t d)
{
    return ath_file_needs(file, kind, d, stage) ? ath_file_chunk(file, kind, d, segment) : 0;
}

const ath_chunk *ath_chunk_of(const ath_work *work, int32_t kind, int32_t d)
{
    if (d < work->first_stage || (work->only_end && !ath_shapes_end(kind))) return 0;
    return ath_wanted_chunk(work->file, work->index, work->stage, kind, d);
}

int ath_refuse_chunk(ath_work *work, int code, ath_field field, const ath_chunk *chunk, double found, double expected)
{
    ath_refuse(&work->fault, code, field, found, expected, expected);
    return ath_fault_at(&work->fault, chunk, (int32_t)(chunk - work->file->chunks));
}

/* Notes the chunk if the result says that its content is not valid. */
int ath_blame(ath_work *work, const ath_chunk *chunk, int result)
{
    return result == ATH_OK ? ATH_OK : ath_refuse_chunk(work, result, ATH_FIELD_CONTENT, chunk, 0, 0);
}

size_t ath_position_of_piece(const ath_work *work)
{
    return ath_position_of(work->file, work->segment, (size_t)work->exact);
}

void ath_next_phase(ath_work *work, prepare_phase phase)
{
    work->phase = phase;
    work->next = 0;
}
