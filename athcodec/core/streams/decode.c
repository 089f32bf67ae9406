/* The streams of the prelude, compiled for decoding. */
#include "streams/decode.h"
#include "streams/hierarchy.inl"
#include "streams/polygons.inl"
#include "streams/rest_exact.inl"
#include "streams/series.inl"
#include "streams/source_rest.inl"

size_t ath_prelude_model_size(void)
{
    size_t larger = sizeof(hierarchy_model) > sizeof(exact_model) ? sizeof(hierarchy_model) : sizeof(exact_model);
    return larger > sizeof(rest_model) ? larger : sizeof(rest_model);
}

static int finished(const ath_coder *coder, int valid) { return valid && coder_finish(coder) ? ATH_OK : ATH_BAD_CHUNK; }

/* Marks every value by the sign of the entry that it names, and clears the marks at the end. */
static int is_permutation(int32_t count, int32_t *source)
{
    int distinct = 1;
    for (int32_t i = 0; i < count && distinct; i++) {
        int32_t value = source[i] < 0 ? -source[i] - 1 : source[i];
        distinct = source[value] >= 0;
        source[value] = distinct ? -source[value] - 1 : source[value];
    }
    for (int32_t i = 0; i < count; i++)
        if (source[i] < 0) source[i] = -source[i] - 1;
    return distinct;
}

/* Inside the subtree of a whole node there are no nodes, so nothing there may be whole. */
static int whole_are_nodes(const ath_branch *branches, int32_t branch_count)
{
    int32_t inside_until = 0;
    for (int32_t b = 0; b < branch_count; b++) {
        if (!(branches[b].flags & ATH_WHOLE)) continue;
        if (b < inside_until) return 0;
        inside_until = b + branches[b].subtree;
    }
    return 1;
}

static int rings_are_tubes(const ath_branch *branches, int32_t branch_count)
{
    for (int32_t b = 0; b < branch_count; b++)
        if (branches[b].ring > 0 && (branches[b].ring < 2 || !(branches[b].flags & ATH_SHEET))) return 0;
    return 1;
}

int ath_decode_hierarchy(void *model, const uint8_t *bytes, size_t size, int32_t branch_count, int32_t vertex_count,
                         ath_branch *branches, int32_t *branch_source, int32_t *vertex_source)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    int valid = code_hierarchy(&coder, (hierarchy_model *)model, branch_count, vertex_count, branches, branch_source,
                               vertex_source);
    valid = valid && is_permutation(branch_count, branch_source) && is_permutation(vertex_count, vertex_source);
    valid = valid && rings_are_tubes(branches, branch_count);
    valid = valid && ath_count_pieces(branches, branch_count, vertex_count) > 0;
    valid = valid && whole_are_nodes(branches, branch_count);
    return finished(&coder, valid);
}

void ath_start_rest(void *model, ath_bytes stream, const ath_branch *branches, int32_t branch_count, double step,
                    ath_mesh *mesh, const int32_t *coarse, const double *before, int32_t *steps, double *rest)
{
    rest_model *own = (rest_model *)model;
    rest_layer layer = {branches, branch_count, step, rest, coarse, before, steps, mesh, 0.0, 0, 0};
    coder_start(&own->coder, stream.bytes, stream.size);
    own->layer = layer;
    start_rest(&own->coder, own);
}

int ath_decode_rest(void *model, int32_t *cost)
{
    rest_model *own = (rest_model *)model;
    int valid = code_rest(&own->coder, own, 0, cost);
    return valid == ATH_MORE ? ATH_MORE : finished(&own->coder, valid);
}

int ath_decode_source_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                           int32_t branch_count, double step, const double *reference, double *turns, double *rest)
{
    ath_coder coder;
    bent_pose pose = {reference, 0, 0, rest, turns, step};
    coder_start(&coder, bytes, size);
    return finished(&coder, code_source_rest(&coder, (rest_model *)model, &pose, branches, branch_count));
}

int ath_decode_exact_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                          int32_t branch_count, const ath_mesh *mesh, int is_float64, double *rest)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder,
                    code_exact_rest(&coder, (exact_model *)model, branches, branch_count, mesh, is_float64, rest));
}

uint64_t ath_faces_memory(int32_t vertex_count, int32_t place_count)
{
    faces_list list;
    return carve_faces(0, (uint64_t)vertex_count, (uint64_t)place_count, &list);
}

void ath_start_faces(void *memory, ath_bytes stream, const ath_polygons *shape, int32_t vertex_count,
                     const int32_t *places, int32_t place_count, uint32_t *counts, int32_t *corners)
{
    start_faces((faces_model *)memory, shape, vertex_count, places, place_count, counts, corners);
    coder_start(&((faces_model *)memory)->coder, stream.bytes, stream.size);
}

int ath_start_places(void *memory, ath_bytes chunk, ath_polygons *shape, int32_t vertex_count, int32_t place_count,
                     int32_t *places)
{
    if (chunk.size < 1 || chunk.bytes[0] == 0) return ATH_BAD_CHUNK;
    start_places((faces_model *)memory, shape, chunk.bytes[0], vertex_count, place_count, places);
    coder_start(&((faces_model *)memory)->coder, chunk.bytes + 1, chunk.size - 1);
    return ATH_OK;
}

int ath_decode_faces(void *memory, int32_t *cost)
{
    faces_model *model = (faces_model *)memory;
    int valid = code_faces(model, cost);
    return valid == ATH_MORE ? ATH_MORE : finished(&model->coder, valid);
}

int ath_decode_times(void *model, const uint8_t *bytes, size_t size, int32_t frame_count, double *times)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_times(&coder, (exact_model *)model, frame_count, times));
}

int ath_decode_temporal(void *model, const uint8_t *bytes, size_t size, int32_t rank, int32_t frames, int32_t *basis)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_temporal(&coder, (number_model *)model, rank, frames, basis));
}
