/* The reference pose, the host's mesh, and the rest pose of the source. */
#include "file/file.h"
#include "streams/decode.h"

static int has_source_rest(const ath_file *file)
{
    return ath_find_chunk(file->chunks, file->header.chunk_count, ATH_SOURCE_REST, ATH_NO_LEVEL, 0) != 0;
}

/* Derives the reference pose from the source's own numbers. */
static void take_numbers(ath_file *file)
{
    size_t numbers = 3 * (size_t)file->header.place_count;
    for (size_t i = 0; i < numbers; i++) file->rest[i] = file->source_rest[i] - file->info.origin[i % 3];
    if (file->rest_steps) memset(file->rest_steps, 0, numbers * sizeof *file->rest_steps);
}

/* Begins to decode polygons behind what building the mesh needs of its scratch memory. */
static int start_polygons(ath_file *file, ath_bytes chunk)
{
    ath_polygons *shape = &file->shape;
    int32_t vertex_count = (int32_t)file->header.vertex_count, place_count = (int32_t)file->header.place_count;
    int32_t *work = file->mesh.work;
    size_t places = file->header.place_count, building = ath_mesh_work(places, MESH_CORNERS * places);
    ath_bytes body;
    int result = ath_parse_polygons(chunk, shape, &body);
    if (result != ATH_OK) return result;
    if (shape->is_derived || !ath_serves_rest(shape, place_count)) return ATH_BAD_CHUNK;
    file->corners = work + ath_larger(building, (ath_faces_memory(vertex_count, place_count) + 3) / 4);
    file->counts = shape->is_mixed ? (uint32_t *)(void *)(file->corners + shape->corner_count) : 0;
    ath_start_faces(work, body, shape, vertex_count, file->vertex_places, place_count, file->counts, file->corners);
    return ATH_OK;
}

/* Reads the head of REST, and begins FACES if the pose goes by them. */
static int read_head(ath_file *file, ath_fault_info *fault)
{
    ath_rest_head *head = &file->rest_head;
    ath_bytes chunk;
    int result = ath_load(file, ATH_REST, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_rest(chunk, head, &file->rest_body);
    if (result != ATH_OK || !head->connected) return result;
    file->connected = &file->mesh;
    result = ath_load(file, ATH_FACES, &chunk, fault); /* without FACES there is no memory for a mesh */
    return result == ATH_OK ? start_polygons(file, chunk) : result;
}

static int start_pose(ath_file *file, ath_fault_info *fault)
{
    const ath_rest_head *head = &file->rest_head;
    ath_bytes chunk, body = file->rest_body;
    int result = ath_load(file, ATH_REST, &chunk, fault);
    if (result != ATH_OK) return result;
    memcpy(file->info.origin, head->origin, sizeof head->origin);
    file->info.rest_is_float64 = head->is_float64;
    file->info.rest_is_host = head->is_host;
    file->rest_is_exact = head->exact || head->is_host;
    if (file->rest_is_exact && has_source_rest(file)) return ATH_BAD_CHUNK;
    memcpy(file->info.host_checksum, head->host_checksum, sizeof head->host_checksum);
    if (head->exact && !head->is_host) {
        result = ath_decode_exact_rest(file->model, body.bytes, body.size, file->branches, file->info.branch_count,
                                       file->connected, head->is_float64, file->source_rest);
        take_numbers(file);
    } else if (!head->is_host) {
        ath_start_rest(file->model, body, file->branches, file->info.branch_count, head->step, file->connected, 0, 0,
                       file->rest_steps, file->rest);
        if (!has_source_rest(file)) file->source_rest = 0;
    }
    return result;
}

int ath_read_reference(ath_file *file, int32_t part, int32_t *cost, ath_fault_info *fault)
{
    int has_mesh = file->rest_head.connected;
    if (part == 0) return read_head(file, fault);
    if (part == 1 && has_mesh) return ath_decode_faces(file->mesh.work, cost);
    if (part == 2 + MESH_PARTS) return start_pose(file, fault);
    if (part == 3 + MESH_PARTS && !file->rest_is_exact) return ath_decode_rest(file->model, cost);
    if (part < 2 + MESH_PARTS && has_mesh)
        ath_build_mesh(&file->mesh, part - 2, &file->shape, file->counts, file->corners, file->vertex_places);
    return ATH_OK;
}

void ath_know_rest(ath_file *file)
{
    file->rest_known = 1;
    file->plan.rest = file->rest;
    if (file->first_layer > 0 && !file->header.is_predicted)
        file->bases_count = (uint64_t)ath_basis_layout(file->pieces, file->plan.piece_count, file->rest, file->gaps,
                                                       (int32_t *)file->scratch);
}

/* Gets the bits of a vertex's numbers, with -0.0 as 0.0. */
static void mesh_bits(const uint8_t *xyz, uint32_t bits[3])
{
    memcpy(bits, xyz, 3 * sizeof *bits);
    for (int k = 0; k < 3; k++)
        if (bits[k] == 0x80000000) bits[k] = 0;
}

/* Fills the checksums of the mesh's bytes, forwards and backwards (FORMAT.md, "REST"). */
static void mesh_checksums(const uint8_t *xyz, size_t stride, size_t count, uint32_t checksum[2])
{
    checksum[0] = checksum[1] = 0;
    for (size_t v = 0; v < count; v++) {
        uint8_t forwards[12], backwards[12];
        uint32_t bits[3], last_bits[3];
        mesh_bits(xyz + v * stride, bits);
        mesh_bits(xyz + (count - 1 - v) * stride, last_bits);
        for (size_t i = 0; i < 12; i++) {
            forwards[i] = (uint8_t)(bits[i / 4] >> 8 * (i % 4));
            backwards[11 - i] = (uint8_t)(last_bits[i / 4] >> 8 * (i % 4));
        }
        checksum[0] = ath_crc32c(checksum[0], forwards, sizeof forwards);
        checksum[1] = ath_crc32c(checksum[1], backwards, sizeof backwards);
    }
}

/* Returns the first vertex with a number that is infinite or NaN; `count` if there is none. */
static size_t first_not_finite(const uint8_t *xyz, size_t stride, size_t count)
{
    for (size_t v = 0; v < count; v++) {
        uint32_t bits[3];
        mesh_bits(xyz + v * stride, bits);
        for (int k = 0; k < 3; k++)
            if ((bits[k] & 0x7f800000) == 0x7f800000) return v;
    }
    return count;
}

static void copy_mesh(ath_file *file, const uint8_t *xyz, size_t stride)
{
    for (size_t v = 0; v < file->header.place_count; v++) {
        uint32_t bits[3];
        float numbers[3];
        mesh_bits(xyz + (size_t)file->vertex_source[v] * stride, bits);
        memcpy(numbers, bits, sizeof numbers);
        for (size_t k = 0; k < 3; k++) file->source_rest[3 * v + k] = (double)numbers[k];
    }
}

int ath_set_host_mesh(ath_file *file, const void *xyz, size_t stride, int32_t vertex_count, ath_fault_info *fault)
{
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    const uint8_t *bytes = (const uint8_t *)xyz;
    const ath_info *info = &file->info;
    uint32_t found[2];
    why->code = ATH_OK;
    if (!info->rest_is_host) return ATH_OK;
    if (vertex_count != info->vertex_count)
        return ath_refuse(why, ATH_WRONG_HOST_MESH, ATH_FIELD_HOST_VERTEX_COUNT, vertex_count, info->vertex_count,
                          info->vertex_count);
    size_t bad = first_not_finite(bytes, stride, (size_t)vertex_count);
    if (bad < (size_t)vertex_count)
        return ath_refuse(why, ATH_WRONG_HOST_MESH, ATH_FIELD_HOST_VERTEX, (double)bad, 0, 0);
    mesh_checksums(bytes, stride, (size_t)vertex_count, found);
    for (int k = 0; k < 2; k++)
        if (found[k] != info->host_checksum[k])
            return ath_refuse(why, ATH_WRONG_HOST_MESH, ATH_FIELD_HOST_CHECKSUM, found[k], info->host_checksum[k],
                              info->host_checksum[k]);
    if (file->rest_known) return ATH_OK; /* the mesh is known already */
    copy_mesh(file, bytes, stride);
    take_numbers(file);
    ath_know_rest(file);
    return ATH_OK;
}

static size_t place_of(const ath_file *file, ath_order order, size_t v)
{
    return order == ATH_SOURCE_ORDER ? (size_t)file->vertex_source[v] : v;
}

int ath_level_rest(const ath_file *file, int32_t level, ath_order order, double *xyz, size_t stride)
{
    if (level < 0 || level >= file->info.level_count) return ATH_BAD_ARGUMENT;
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    int32_t stage = ath_file_stage(file, level), layer = ath_layer_of(file, stage);
    const ath_plan *plan = ath_stage_plan(file, stage);
    if (plan != &file->plan && !file->layers[layer].rest_known) return ATH_BAD_ARGUMENT;
    for (size_t v = 0; v < file->header.place_count; v++) {
        double *out = (double *)(void *)((char *)xyz + place_of(file, order, v) * stride);
        for (size_t k = 0; k < 3; k++)
            out[k] = file->rest_is_exact ? file->source_rest[3 * v + k] : plan->rest[3 * v + k] + file->info.origin[k];
    }
    if (order == ATH_SOURCE_ORDER) ath_fill_places(file, xyz, stride, 3 * sizeof(double));
    return ATH_OK;
}

static const double *finest_reference(const ath_file *file)
{
    const double *reference = file->rest;
    for (int32_t q = file->first_layer; q < file->header.layer_count && file->layers[q].rest_known; q++)
        reference = file->layers[q].plan.rest;
    return reference;
}

/* SOURCE_REST says how the reference pose bends into the source's rest pose. */
static int read_source_rest(ath_file *file, ath_fault_info *fault)
{
    ath_bytes chunk, body;
    ath_source_rest_head head;
    double *turns = (double *)file->scratch;
    int result = ath_load(file, ATH_SOURCE_REST, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_source_rest(chunk, &head, &body);
    if (result != ATH_OK) return result;
    if (head.exact)
        return ath_decode_exact_rest(file->model, body.bytes, body.size, file->branches, file->info.branch_count, 0,
                                     file->info.rest_is_float64, file->source_rest);
    result = ath_decode_source_rest(file->model, body.bytes, body.size, file->branches, file->info.branch_count,
                                    head.step, finest_reference(file), turns, file->source_rest);
    for (size_t i = 0; i < 3 * (size_t)file->header.place_count; i++)
        file->source_rest[i] = file->source_rest[i] + file->info.origin[i % 3];
    return result;
}

int ath_read_rest(ath_file *file, ath_fault_info *fault)
{
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    why->code = ATH_OK;
    if (!has_source_rest(file)) return ATH_OK;
    file->is_reading = 0; /* the memory of a pose that is being read serves this one */
    why->code = read_source_rest(file, why);
    file->source_rest_known = why->code == ATH_OK;
    return why->code;
}

static int rest_is_there(const ath_file *file)
{
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    return has_source_rest(file) && !file->source_rest_known ? ATH_MISSING : ATH_OK;
}

static double rest_number(const ath_file *file, const double *reference, size_t i)
{
    return file->source_rest ? file->source_rest[i] : reference[i] + file->info.origin[i % 3];
}

static int put_rest(const ath_file *file, ath_order order, void *xyz, size_t stride, int is_float64)
{
    int result = rest_is_there(file);
    if (result != ATH_OK) return result;
    const double *reference = finest_reference(file);
    for (size_t v = 0; v < file->header.place_count; v++)
        for (size_t k = 0; k < 3; k++)
            ath_put_number((char *)xyz + place_of(file, order, v) * stride, k, is_float64,
                           rest_number(file, reference, 3 * v + k));
    if (order == ATH_SOURCE_ORDER)
        ath_fill_places(file, xyz, stride, 3 * (is_float64 ? sizeof(double) : sizeof(float)));
    return ATH_OK;
}

int ath_rest(const ath_file *file, ath_order order, float *xyz, size_t stride)
{
    return put_rest(file, order, xyz, stride, 0);
}

int ath_rest_float64(const ath_file *file, ath_order order, double *xyz, size_t stride)
{
    return put_rest(file, order, xyz, stride, 1);
}
