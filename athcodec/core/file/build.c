/* Builds what the segments share at each level: bases, waves, refined rest poses. */
#include "file/file.h"
#include "streams/decode.h"

static int32_t wave_kind(const ath_file *file, int32_t segment, int32_t of_nodes)
{
    if (ath_segment_clip(file, segment)->periodic) return ATH_PERIODIC;
    return of_nodes ? ATH_BEAM : ATH_SMOOTH;
}

static uint64_t carve_build(ath_file *file, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint8_t are_there[ATH_WAVE_KINDS][ATH_SEGMENT_FRAMES + 1] = {{0}};
    for (int32_t s = 0; s < file->info.segment_count; s++)
        for (int32_t of_nodes = 0; of_nodes < 2; of_nodes++)
            are_there[wave_kind(file, s, of_nodes)][ath_file_frames(file, s)] = 1;
    file->plan.bases = file->bases = (double *)ath_take(&arena, file->bases_count * sizeof(double));
    file->built_stage = file->planned_stage = -1;
    file->next_piece = file->next_waves = 0;
    for (int32_t kind = 0; kind < ATH_WAVE_KINDS; kind++)
        for (uint64_t frames = 1; frames <= ATH_SEGMENT_FRAMES; frames++)
            if (are_there[kind][frames])
                file->waves[kind][frames] = (double *)ath_take(&arena, frames * frames * sizeof(double));
    return arena.used;
}

size_t ath_build_size(const ath_file *file)
{
    ath_file counted = *file;
    return ath_size_or_most(carve_build(&counted, 0));
}

/* Fills the waves, then nodes and bases that stages up to one take: a coarse picture waits for no others. */
static int build_to(ath_file *file, int32_t stage, int32_t *cost)
{
    int result = ATH_OK;
    for (; file->next_waves < ATH_WAVE_KINDS * (ATH_SEGMENT_FRAMES + 1); file->next_waves++) {
        int32_t kind = file->next_waves % ATH_WAVE_KINDS, frames = file->next_waves / ATH_WAVE_KINDS;
        if (!file->waves[kind][frames]) continue;
        if (!ath_spend(cost, frames * (frames + 128))) return ATH_MORE;
        ath_waves(frames, kind, file->waves[kind][frames]);
    }
    while (result == ATH_OK && file->built_stage < stage) {
        int32_t next = file->built_stage + 1;
        if (file->planned_stage < next) {
            if (!ath_spend(cost, file->info.place_count)) return ATH_MORE;
            ath_plan_nodes(&file->plan, file->nodes, next, next);
            file->planned_stage = next;
        }
        if (file->bases_count > 0)
            result = ath_basis_fill(file->pieces, &file->next_piece, file->plan.piece_count, next, next, file->rest, 0,
                                    (double *)file->scratch, file->bases, cost);
        if (result == ATH_OK) file->built_stage = next;
    }
    return result;
}

int ath_build(ath_file *file, void *memory, size_t memory_bytes)
{
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    if (!ath_fits(memory, memory_bytes, ath_build_size(file))) return ATH_NO_MEMORY;
    carve_build(file, (uint8_t *)memory);
    return build_to(file, 0, 0);
}

const double *ath_file_waves(const ath_file *file, int32_t segment)
{
    return file->waves[wave_kind(file, segment, 0)][ath_file_frames(file, segment)];
}

const double *ath_file_node_waves(const ath_file *file, int32_t segment)
{
    return file->waves[wave_kind(file, segment, 1)][ath_file_frames(file, segment)];
}

/* Returns the plan that a layer refines. */
static const ath_plan *plan_before(const ath_file *file, int32_t q)
{
    return q > file->first_layer ? &file->layers[q - 1].plan : &file->plan;
}

/* Returns the plan that a layer refines if that has bases, else null. */
static const ath_plan *known_bases(const ath_file *file, int32_t q)
{
    return q > file->first_layer || file->bases_count > 0 ? plan_before(file, q) : 0;
}

static const int32_t *rest_steps_before(const ath_file *file, int32_t q)
{
    return q > file->first_layer ? file->layers[q - 1].rest_steps : file->rest_steps;
}

static int start_layer_rest(ath_file *file, int32_t q, ath_bytes chunk)
{
    ath_layer *layer = &file->layers[q];
    ath_bytes body;
    double step;
    int result = ath_parse_stepped(chunk, &step, &body);
    if (result != ATH_OK || file->rest_is_exact) return ATH_BAD_CHUNK;
    ath_start_rest(file->model, body, file->branches, file->info.branch_count, step, file->connected,
                   rest_steps_before(file, q), plan_before(file, q)->rest, layer->rest_steps, layer->rest);
    return ATH_OK;
}

/* All pieces of a refinement belong to its stage. */
static void plan_pieces(const ath_file *file, int32_t q)
{
    const ath_layer *layer = &file->layers[q];
    memcpy(layer->pieces, file->pieces, (size_t)file->plan.piece_count * sizeof *layer->pieces);
    for (int32_t p = 0; q > 0 && p < file->plan.piece_count; p++) {
        layer->pieces[p].stage = ath_stage_of_layer(file, q);
        layer->pieces[p].low_stage = -1;
        layer->pieces[p].low_modes = 0;
    }
    ath_plan_rigid(&layer->plan, layer->pieces, q);
}

/* Reads a layer's rest pose. That of the layer before is known. */
static int read_layer_rest(ath_file *file, int32_t q, int32_t *cost, ath_fault_info *fault)
{
    ath_layer *layer = &file->layers[q];
    const ath_chunk *chunk = ath_file_chunk(file, ATH_REFINED_REST, q > 0 ? ath_stage_of_layer(file, q) : 1, 0);
    layer->plan.rest = plan_before(file, q)->rest;
    if (!file->is_reading) plan_pieces(file, q);
    if (!chunk) {
        if (!ath_spend(cost, file->info.place_count)) return ATH_MORE;
        memcpy(layer->rest_steps, rest_steps_before(file, q), 3 * (size_t)file->header.place_count * sizeof(int32_t));
        return ATH_OK;
    }
    ath_bytes content = {chunk->bytes, chunk->length};
    int32_t index = (int32_t)(chunk - file->chunks);
    int result = file->is_reading ? ATH_OK : ath_check_chunk(file, index, fault);
    if (result != ATH_OK) return result;
    if (!file->is_reading) result = start_layer_rest(file, q, content);
    if (result == ATH_OK) result = ath_decode_rest(file->model, cost);
    file->is_reading = result == ATH_MORE;
    if (file->is_reading) return ATH_MORE;
    ath_spend(cost, file->info.place_count);
    if (result != ATH_OK) {
        ath_refuse(fault, ATH_BAD_CHUNK, ATH_FIELD_CONTENT, 0, 0, 0);
        return ath_fault_at(fault, chunk, index);
    }
    layer->plan.rest = layer->rest;
    layer->bases_count = (uint64_t)ath_basis_layout(layer->pieces, layer->plan.piece_count, layer->rest, file->gaps,
                                                    (int32_t *)file->scratch);
    if (q == 0) ath_plan_nodes(&layer->plan, layer->nodes, 0, INT32_MAX);
    return ATH_OK;
}

int ath_refine_size(ath_file *file, int32_t level, size_t *memory_bytes, ath_fault_info *fault)
{
    return ath_refine_size_within(file, level, memory_bytes, 0, fault);
}

int ath_refine_size_within(ath_file *file, int32_t level, size_t *memory_bytes, int32_t *cost, ath_fault_info *fault)
{
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    ath_arena counted = {0, 0};
    *memory_bytes = 0;
    why->code = ATH_OK;
    if (level < 0 || level >= file->info.level_count) return ath_refuse(why, ATH_BAD_ARGUMENT, ATH_FIELD_NONE, 0, 0, 0);
    if (!file->rest_known)
        return ath_refuse(why, ATH_NEEDS_HOST_MESH, ATH_FIELD_HOST_MESH, 0, file->info.host_checksum[0],
                          file->info.vertex_count);
    level = ath_file_stage(file, level);
    if (!file->bases) ath_take(&counted, ath_build_size(file));
    for (int32_t q = file->first_layer; level > 0 && q <= ath_layer_of(file, level); q++) {
        ath_layer *layer = &file->layers[q];
        int result = layer->rest_known ? ATH_OK : read_layer_rest(file, q, cost, why);
        if (result != ATH_OK) return result;
        layer->rest_known = 1;
        if (!layer->bases) ath_take(&counted, layer->bases_count * sizeof(double));
    }
    *memory_bytes = ath_size_or_most(counted.used);
    return ATH_OK;
}

int ath_refine_within(ath_file *file, int32_t level, void *memory, size_t memory_bytes, int32_t *cost)
{
    ath_arena arena = {(uint8_t *)memory, 0};
    size_t needed;
    int result = ath_refine_size(file, level, &needed, 0);
    if (result != ATH_OK) return result;
    if (needed > 0 && !ath_fits(memory, memory_bytes, needed)) return ATH_NO_MEMORY;
    if (!file->bases) arena.used = carve_build(file, arena.base);
    level = ath_file_stage(file, level);
    int32_t layers = level > 0 ? ath_layer_of(file, level) + 1 : 0;
    for (int32_t q = file->first_layer; q < layers; q++)
        if (!file->layers[q].bases)
            file->layers[q].bases = (double *)ath_take(&arena, file->layers[q].bases_count * sizeof(double));
    result = build_to(file, level, cost);
    for (int32_t q = file->first_layer; result == ATH_OK && q < layers; q++) {
        ath_layer *layer = &file->layers[q];
        const ath_plan *before = plan_before(file, q);
        if (layer->plan.bases) continue;
        if (layer->bases_count > 0) {
            result = ath_basis_fill(layer->pieces, &file->next_piece, layer->plan.piece_count, 0, INT32_MAX,
                                    layer->rest, known_bases(file, q), (double *)file->scratch, layer->bases, cost);
            if (result == ATH_OK) layer->plan.bases = layer->bases;
            continue;
        }
        if (!ath_spend(cost, layer->plan.piece_count)) return ATH_MORE;
        for (int32_t p = 0; p < layer->plan.piece_count; p++) {
            layer->pieces[p].modes = before->pieces[p].modes;
            layer->pieces[p].basis = before->pieces[p].basis;
            layer->pieces[p].rank = before->pieces[p].rank;
            layer->pieces[p].tip_weight = before->pieces[p].tip_weight;
        }
        layer->plan.bases = before->bases;
    }
    return result;
}

int ath_refine(ath_file *file, int32_t level, void *memory, size_t memory_bytes)
{
    return ath_refine_within(file, level, memory, memory_bytes, 0);
}
