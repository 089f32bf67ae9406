/* Opening a file, and what is known once it is open (ath.h). */
#include "file/file.h"
#include "streams/decode.h"

enum { NAME_BYTES = 256 }; /* of a clip's name, with the zero behind it */
enum { LEAST_PIECE = 32 }; /* vertices of those of a long stem: of rings, as many as make no more than 64 */

/* ---- memory ---- */

static int32_t most_pieces(const ath_header *header)
{
    return (int32_t)(header->branch_count + header->vertex_count / LEAST_PIECE);
}

static uint64_t larger(uint64_t a, uint64_t b) { return a > b ? a : b; }

/* Where in the scratch memory, behind the models, the rotations of branches stand. */
static size_t turns_place(void) { return (ath_prelude_model_size() + 15) & ~(size_t)15; }

static uint64_t scratch_size(const ath_header *header)
{
    uint64_t size = larger(header->vertex_count, ath_basis_table_size(most_pieces(header))) * sizeof(int32_t);
    size = larger(size, turns_place() + (uint64_t)header->branch_count * 9 * sizeof(double));
    return larger(size, ATH_BASIS_WORK * sizeof(double));
}

/* The rest poses of layers are there where the file has any, whether all of them are stored or not. */
static void carve_layers(ath_file *file, const ath_header *header, ath_arena *arena)
{
    uint64_t vertices = header->vertex_count;
    if (header->layer_count < 2) return;
    file->rest_steps = (int32_t *)ath_take(arena, vertices * 3 * sizeof(int32_t));
    file->layers[0].nodes = (ath_node *)ath_take(arena, header->branch_count * sizeof(ath_node));
    for (int32_t q = 0; q < header->layer_count; q++) {
        file->layers[q].pieces = (ath_piece *)ath_take(arena, (uint64_t)most_pieces(header) * sizeof(ath_piece));
        file->layers[q].rest = (double *)ath_take(arena, vertices * 3 * sizeof(double));
        file->layers[q].rest_steps = (int32_t *)ath_take(arena, vertices * 3 * sizeof(int32_t));
    }
}

/* FACES as read, and what reading and building them needs. */
static uint64_t mesh_work(uint64_t vertices)
{
    uint64_t read = (MESH_CORNERS + MESH_FACES) * vertices * sizeof(int32_t);
    uint64_t building = ath_mesh_work(vertices, MESH_CORNERS * vertices) * sizeof(int32_t);
    return read + larger(building, ath_faces_memory((int32_t)vertices));
}

/* Places the file's arrays behind its struct; with a null base it only counts. Returns the bytes that they take. */
static uint64_t carve_file(ath_file *file, const ath_header *header, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t vertices = header->vertex_count, branches = header->branch_count;
    uint64_t entries = (uint64_t)header->level_count * header->segment_count, clips = (uint64_t)header->clip_count;
    ath_take(&arena, sizeof *file);
    file->chunks = (ath_chunk *)ath_take(&arena, (uint64_t)header->chunk_count * sizeof(ath_chunk));
    file->errors = (double *)ath_take(&arena, entries * ATH_MEASURES * sizeof(double));
    file->joins = (uint8_t *)ath_take(&arena, entries);
    file->repeats = (uint8_t *)ath_take(&arena, header->frame_count);
    file->coded = (uint8_t *)ath_take(&arena, header->frame_count);
    file->clips = (ath_clip *)ath_take(&arena, clips * sizeof(ath_clip));
    file->names = (char *)ath_take(&arena, clips * NAME_BYTES);
    file->seams = (float *)ath_take(&arena, clips * (uint64_t)header->full_level_count * sizeof(float));
    file->branches = (ath_branch *)ath_take(&arena, branches * sizeof(ath_branch));
    file->branch_source = (int32_t *)ath_take(&arena, branches * sizeof(int32_t));
    file->vertex_source = (int32_t *)ath_take(&arena, vertices * sizeof(int32_t));
    file->times = (double *)ath_take(&arena, (uint64_t)header->frame_count * sizeof(double));
    file->rest = (double *)ath_take(&arena, vertices * 3 * sizeof(double));
    file->source_rest = (double *)ath_take(&arena, vertices * 3 * sizeof(double));
    file->pieces = (ath_piece *)ath_take(&arena, (uint64_t)most_pieces(header) * sizeof(ath_piece));
    file->nodes = (ath_node *)ath_take(&arena, branches * sizeof(ath_node));
    file->gaps = (uint8_t *)ath_take(&arena, vertices);
    file->scratch = ath_take(&arena, scratch_size(header));
    carve_layers(file, header, &arena);
    if (header->has_faces)
        ath_carve_mesh(&file->mesh, &arena, vertices, MESH_CORNERS * vertices, mesh_work(header->vertex_count));
    return arena.used;
}

/* FORMAT.md, "Limits": what a segment may take, whatever the decoder. */
static int check_memory(const ath_header *header, const ath_limits *limits, uint64_t frames, ath_fault_info *fault)
{
    uint64_t needed = header->vertex_count * (ATH_BYTES_PER_FRAME * frames + ATH_BYTES_PER_VERTEX);
    if (needed <= limits->memory_bytes) return ATH_OK;
    return ath_refuse(fault, ATH_LIMIT_EXCEEDED, ATH_FIELD_MEMORY, (double)needed, 0, (double)limits->memory_bytes);
}

static int check_least_memory(const ath_header *header, const ath_limits *limits, ath_fault_info *fault)
{
    return check_memory(header, limits, (header->frame_count + header->segment_count - 1) / header->segment_count,
                        fault);
}

static ath_limits limits_or_default(const ath_limits *limits)
{
    ath_limits chosen;
    ath_default_limits(&chosen);
    return limits ? *limits : chosen;
}

int ath_front(const uint8_t *bytes, size_t available, const ath_limits *limits, size_t *front_bytes,
              size_t *memory_bytes, ath_fault_info *fault)
{
    ath_limits chosen = limits_or_default(limits);
    ath_fault_info unwanted, beyond_limit, *why = fault ? fault : &unwanted;
    ath_header header;
    ath_file file;
    uint64_t needed;
    why->code = ATH_OK;
    int result = ath_read_header(bytes, available, &chosen, &header, &needed, why), has_front = result == ATH_OK;
    if (has_front) result = ath_read_tables(bytes, available, &chosen, &header, &needed, 0, 0, 0, 0, why);
    *front_bytes = ath_size_or_most(needed);
    *memory_bytes = 0;
    if (needed > SIZE_MAX)
        return ath_refuse(why, ATH_LIMIT_EXCEEDED, ATH_FIELD_PRELUDE_SIZE, (double)needed, 0, (double)SIZE_MAX);
    if (!has_front || (result != ATH_OK && result != ATH_MISSING)) return result;
    int limit = check_least_memory(&header, &chosen, &beyond_limit);
    if (limit == ATH_OK) *memory_bytes = ath_size_or_most(carve_file(&file, &header, 0));
    if (limit == ATH_OK || result == ATH_MISSING) return result;
    *why = beyond_limit;
    return limit;
}

/* ---- the chunks of the prelude ---- */

static int refuse_missing(ath_fault_info *fault, int32_t kind, int32_t level, uint32_t segment)
{
    ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_MISSING_CHUNK, 0, 1, 1);
    fault->kind = (uint16_t)kind;
    fault->level = (uint8_t)level;
    fault->segment = segment;
    return ATH_BAD_CHUNK_TABLE;
}

/* The chunk's bytes, checked. Until the next is loaded, the fault is that this one's content is not valid. */
static int load(const ath_file *file, int32_t kind, ath_bytes *content, ath_fault_info *fault)
{
    const ath_chunk *chunk = ath_find_chunk(file->chunks, file->header.chunk_count, kind, ATH_NO_LEVEL, 0);
    if (!chunk) return refuse_missing(fault, kind, ATH_NO_LEVEL, 0);
    int32_t index = (int32_t)(chunk - file->chunks);
    content->bytes = chunk->bytes;
    content->size = chunk->length;
    int result = ath_check_chunk(file, index, fault);
    if (result != ATH_OK) return result;
    ath_refuse(fault, ATH_BAD_CHUNK, ATH_FIELD_CONTENT, 0, 0, 0);
    ath_fault_at(fault, chunk, index);
    return ATH_OK;
}

static int same_name(const char *a, const char *b)
{
    while (*a && *a == *b) a++, b++;
    return *a == *b;
}

/* Frames and segments of the clip behind those before it; ATH_BAD_CHUNK where there are no more of them. */
static int place_clip(ath_file *file, int32_t index, uint32_t frames, uint32_t segments)
{
    ath_clip *clip = file->clips + index;
    const ath_clip *before = clip - 1;
    clip->first_frame = index > 0 ? before->first_frame + before->frame_count : 0;
    clip->first_segment = index > 0 ? before->first_segment + before->segment_count : 0;
    if (frames > file->header.frame_count - (uint32_t)clip->first_frame
        || segments > file->header.segment_count - (uint32_t)clip->first_segment)
        return ATH_BAD_CHUNK;
    clip->frame_count = (int32_t)frames;
    clip->segment_count = (int32_t)segments;
    clip->name = file->names + NAME_BYTES * index;
    file->longest = ath_max(file->longest, (int32_t)((frames + segments - 1) / segments));
    return ATH_OK;
}

static int read_clip(ath_file *file, int32_t index, ath_bytes *chunk)
{
    ath_clip *clip = file->clips + index;
    ath_clip_entry entry;
    int result = ath_parse_clip(chunk, &file->header, &entry);
    if (result == ATH_OK) result = place_clip(file, index, entry.frames, entry.segments);
    if (result != ATH_OK) return result;
    memcpy(file->names + NAME_BYTES * index, entry.name.bytes, entry.name.size);
    clip->loop = entry.loop;
    clip->periodic = entry.periodic;
    for (int32_t level = 0; clip->loop && level < file->header.full_level_count; level++)
        file->seams[index * file->header.full_level_count + level] = ath_seam(&entry, level);
    for (int32_t before = 0; before < index; before++)
        if (same_name(file->clips[before].name, clip->name)) return ATH_BAD_CHUNK;
    return ATH_OK;
}

static int read_clips(ath_file *file, ath_fault_info *fault)
{
    const ath_header *header = &file->header;
    ath_bytes chunk;
    file->info.clip_count = header->clip_count;
    memset(file->clips, 0, (size_t)header->clip_count * sizeof *file->clips);
    memset(file->names, 0, (size_t)header->clip_count * NAME_BYTES);
    memset(file->seams, 0, (size_t)header->clip_count * (size_t)header->full_level_count * sizeof *file->seams);
    if (header->clip_count == 1 && !ath_find_chunk(file->chunks, header->chunk_count, ATH_CLIPS, ATH_NO_LEVEL, 0))
        return place_clip(file, 0, header->frame_count, header->segment_count);
    int result = load(file, ATH_CLIPS, &chunk, fault);
    for (int32_t i = 0; result == ATH_OK && i < header->clip_count; i++) result = read_clip(file, i, &chunk);
    if (result != ATH_OK) return result;
    const ath_clip *last = file->clips + header->clip_count - 1;
    int whole = chunk.size == 0 && last->first_frame + last->frame_count == (int32_t)header->frame_count
                && last->first_segment + last->segment_count == (int32_t)header->segment_count;
    return whole ? ATH_OK : ATH_BAD_CHUNK;
}

/* The last clip that begins at or before this frame or segment; `first`: the offset of first_frame or first_segment in
 * ath_clip. */
static const ath_clip *clip_at(const ath_file *file, size_t first, int32_t place)
{
    int32_t low = 0, high = file->info.clip_count;
    while (high - low > 1) {
        int32_t middle = low + (high - low) / 2;
        if (*(const int32_t *)(const void *)((const char *)(file->clips + middle) + first) <= place)
            low = middle;
        else
            high = middle;
    }
    return file->clips + low;
}

static const ath_clip *clip_of(const ath_file *file, int32_t segment)
{
    return clip_at(file, offsetof(ath_clip, first_segment), segment);
}

/* The first frame of a segment has nothing to repeat that the segment has. */
static int count_coded(ath_file *file, ath_fault_info *fault)
{
    for (int32_t s = 0, i = 0; s < file->info.segment_count; s++) {
        int32_t start = i, stop = ath_segment_start(file, s + 1);
        for (int32_t coded = -1; i < stop; i++) {
            coded += !file->repeats[i];
            file->coded[i] = (uint8_t)coded;
        }
        if (!file->repeats[start]) continue;
        ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_REPEAT, start, 0, 0);
        fault->segment = (uint32_t)s;
        return ATH_BAD_CHUNK_TABLE;
    }
    return ATH_OK;
}

static int check_depth(const ath_file *file, const ath_limits *limits, ath_fault_info *fault)
{
    int32_t deepest = 0;
    for (int32_t b = 0; b < file->info.branch_count; b++) deepest = ath_max(deepest, file->branches[b].depth);
    if ((uint32_t)deepest < limits->hierarchy_depth) return ATH_OK;
    fault->field = ATH_FIELD_HIERARCHY_DEPTH;
    fault->found = (double)deepest + 1;
    fault->most = (double)limits->hierarchy_depth;
    return fault->code = ATH_LIMIT_EXCEEDED;
}

static int read_hierarchy(ath_file *file, const ath_limits *limits, ath_fault_info *fault)
{
    const ath_header *header = &file->header;
    int32_t branch_count = (int32_t)header->branch_count, vertex_count = (int32_t)header->vertex_count;
    ath_bytes chunk;
    int result = load(file, ATH_HIERARCHY, &chunk, fault);
    if (result != ATH_OK) return result;
    memset(file->branches, 0, (size_t)branch_count * sizeof *file->branches);
    result = ath_decode_hierarchy(file->scratch, chunk.bytes, chunk.size, branch_count, vertex_count, file->branches,
                                  file->branch_source, file->vertex_source);
    if (result != ATH_OK) return result;
    return check_depth(file, limits, fault);
}

static void build_plan(ath_file *file)
{
    ath_plan *plan = &file->plan;
    plan->vertex_count = (int32_t)file->header.vertex_count;
    plan->branch_count = (int32_t)file->header.branch_count;
    plan->branches = file->branches;
    plan->pieces = file->pieces;
    plan->nodes = file->nodes;
    plan->piece_count = ath_count_pieces(file->branches, plan->branch_count, plan->vertex_count);
    plan->node_count = ath_count_nodes(file->branches, plan->branch_count);
    ath_build_plan(plan, file->pieces, file->nodes, (int32_t *)file->scratch, 0);
    ath_plan_rigid(plan, file->pieces, 0);
    if (file->header.is_predicted) ath_without_stems(plan, file->pieces, file->nodes);
}

/* A refinement's pieces come all with its level. */
static void plan_layers(ath_file *file)
{
    file->first_layer = ath_file_chunk(file, ATH_REFINED_REST, 1, 0) ? 0 : 1;
    for (int32_t q = file->first_layer; q < file->header.layer_count; q++) {
        ath_layer *layer = &file->layers[q];
        layer->plan = file->plan;
        layer->plan.pieces = layer->pieces;
        memcpy(layer->pieces, file->pieces, (size_t)file->plan.piece_count * sizeof *layer->pieces);
        for (int32_t p = 0; q > 0 && p < file->plan.piece_count; p++) {
            layer->pieces[p].level = ath_level_of_layer(file, q);
            layer->pieces[p].low_level = -1;
            layer->pieces[p].low_modes = 0;
        }
        ath_plan_rigid(&layer->plan, layer->pieces, q);
    }
    if (file->first_layer > 0) return;
    memcpy(file->layers[0].nodes, file->nodes, (size_t)file->plan.node_count * sizeof *file->nodes);
    file->layers[0].plan.nodes = file->layers[0].nodes;
}

/* Which levels have which chunks. */
static void plan_levels(ath_file *file)
{
    const ath_plan *plan = &file->plan;
    file->stems_levels = 0;
    memset(file->affine_levels, 0, sizeof file->affine_levels);
    for (int32_t p = 0; p < plan->piece_count && !file->header.is_predicted; p++) {
        file->stems_levels |= 1u << plan->pieces[p].level;
        if (plan->pieces[p].low_level >= 0) file->stems_levels |= 1u << plan->pieces[p].low_level;
    }
    for (int32_t q = 1; q < file->header.layer_count; q++) file->stems_levels |= 1u << ath_level_of_layer(file, q);
    for (int32_t n = 0; n < plan->node_count; n++) {
        const ath_node *node = plan->nodes + n;
        for (int32_t level = node->level; node->coded && level <= node->last; level++)
            file->affine_levels[level] |= 1u << node->level;
    }
}

/* Whether nothing of level 0 serves other levels: then level 1 may refine the rest pose. */
static int stands_alone(const ath_file *file) { return !((file->stems_levels | file->affine_levels[1]) & 1); }

int ath_file_needs(const ath_file *file, int32_t kind, int32_t d, int32_t level)
{
    if (kind == ATH_STEMS) return d <= level && (file->stems_levels >> d & 1);
    if (kind == ATH_AFFINES) return file->affine_levels[level] >> d & 1;
    if (kind == ATH_SHAPES) return d <= level && (file->stems_levels >> d & 1);
    int32_t shown = ath_min(level, ath_lossy_levels(file) - 1);
    if (kind == ATH_CORRECTIONS) return d == shown && d > file->plan.height && !file->header.is_predicted;
    if (kind == ATH_PREDICTED) return d == shown && d > file->plan.height && file->header.is_predicted;
    if (kind == ATH_REFINED_REST && d <= shown && file->header.layer_count > 1)
        return d > file->plan.height + 1 || (d == 1 && stands_alone(file));
    return kind == ATH_EXACT && d == level && d > shown;
}

static int is_wanted(const ath_file *file, const ath_chunk *chunk)
{
    if (ath_is_shared(chunk->kind) && chunk->segment > 0) return 0;
    return !ath_is_motion(chunk) || !ath_kind_name(chunk->kind)
           || ath_file_needs(file, chunk->kind, chunk->level, chunk->level);
}

static int refuse_first_missing(const ath_file *file, int32_t kind, int32_t level, ath_fault_info *fault)
{
    int32_t segment = 0;
    while (ath_file_chunk(file, kind, level, segment)) segment++;
    return refuse_missing(fault, kind, level, (uint32_t)segment);
}

/* The table has the motion chunks that the hierarchy asks for, and no others. */
static int check_motion_chunks(const ath_file *file, ath_fault_info *fault)
{
    static const int32_t kinds[] = {ATH_STEMS, ATH_EXACT, ATH_PREDICTED, ATH_AFFINES};
    int32_t count[4][ATH_LEVELS] = {{0}}, required = file->header.is_predicted ? 3 : 4;
    for (int32_t c = 0; c < file->info.chunk_count; c++) {
        const ath_chunk *chunk = file->chunks + c;
        if (!is_wanted(file, chunk)) {
            ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_UNEXPECTED_CHUNK, 1, 0, 0);
            return ath_fault_at(fault, chunk, c);
        }
        for (int32_t i = 0; i < required; i++)
            if (chunk->kind == kinds[i]) count[i][chunk->level]++;
    }
    for (int32_t i = 0; i < required; i++)
        for (int32_t d = 0; d < file->info.level_count; d++)
            if (ath_file_needs(file, kinds[i], d, d) && count[i][d] < file->info.segment_count)
                return refuse_first_missing(file, kinds[i], d, fault);
    return ATH_OK;
}

static int check_joins(ath_file *file, ath_fault_info *fault)
{
    int32_t segments = file->info.segment_count, lossy = ath_lossy_levels(file);
    if (file->header.is_predicted) lossy = 1; /* what is predicted is not joined, the maps before it may be */
    for (int32_t i = 0; i < file->info.level_count * segments; i++) {
        int32_t level = i / segments, segment = i % segments, width = file->joins[i] % ATH_JOIN_SLOPED;
        if (width == 0) continue;
        int32_t before = ath_segment_before(file, segment);
        int goes_on = before >= 0 && ath_file_frames(file, before) >= ATH_END_FRAMES;
        file->has_joins = 1;
        if (goes_on && level < lossy && width <= ath_file_frames(file, segment) - 2) continue;
        ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_JOIN, 0, 0, 0);
        fault->level = (uint8_t)level;
        fault->segment = (uint32_t)segment;
        return ATH_BAD_CHUNK_TABLE;
    }
    return ATH_OK;
}

static int has_source_rest(const ath_file *file)
{
    return ath_find_chunk(file->chunks, file->header.chunk_count, ATH_SOURCE_REST, ATH_NO_LEVEL, 0) != 0;
}

/* The rest pose from the source's very numbers. */
static void take_numbers(ath_file *file)
{
    size_t numbers = 3 * (size_t)file->header.vertex_count;
    for (size_t i = 0; i < numbers; i++) file->rest[i] = file->source_rest[i] - file->info.origin[i % 3];
    if (file->rest_steps) memset(file->rest_steps, 0, numbers * sizeof *file->rest_steps);
}

/* The mesh that a rest pose is connected by. */
static int read_mesh(ath_file *file, ath_fault_info *fault)
{
    ath_mesh *mesh = &file->mesh;
    int32_t vertex_count = (int32_t)file->header.vertex_count;
    size_t vertices = file->header.vertex_count, building = ath_mesh_work(vertices, MESH_CORNERS * vertices);
    ath_bytes chunk, body;
    ath_polygons shape;
    int result = load(file, ATH_FACES, &chunk, fault); /* without which there is no memory for a mesh */
    if (result == ATH_OK) result = ath_parse_polygons(chunk, &shape, &body);
    if (result != ATH_OK) return fault->code = result;
    if (shape.is_derived || !ath_serves_rest(&shape, vertex_count)) return ATH_BAD_CHUNK;
    int32_t *corners = mesh->work + larger(building, (ath_faces_memory(vertex_count) + 3) / 4);
    uint32_t *counts = shape.is_mixed ? (uint32_t *)(void *)(corners + shape.corner_count) : 0;
    result = ath_decode_faces(mesh->work, body, &shape, vertex_count, counts, corners);
    if (result == ATH_OK) ath_build_mesh(mesh, &shape, counts, corners, file->vertex_source);
    return result;
}

static int read_rest(ath_file *file, ath_fault_info *fault)
{
    const ath_header *header = &file->header;
    ath_bytes chunk, body;
    ath_rest_head head;
    int result = load(file, ATH_REST, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_rest(chunk, &head, &body);
    if (result == ATH_OK && head.connected) {
        result = read_mesh(file, fault);
        if (result == ATH_OK) result = load(file, ATH_REST, &chunk, fault);
    }
    if (result != ATH_OK) return result;
    file->connected = head.connected ? &file->mesh : 0;
    memcpy(file->info.origin, head.origin, sizeof head.origin);
    file->info.rest_is_float64 = head.is_float64;
    file->info.rest_is_host = head.is_host;
    file->rest_is_exact = head.exact || head.is_host;
    if (file->rest_is_exact && has_source_rest(file)) return ATH_BAD_CHUNK;
    if (head.is_host) {
        memcpy(file->info.host_checksum, head.host_checksum, sizeof head.host_checksum);
    } else if (head.exact) {
        result =
            ath_decode_exact_rest(file->scratch, body.bytes, body.size, file->branches, (int32_t)header->branch_count,
                                  file->connected, head.is_float64, file->source_rest);
        take_numbers(file);
    } else {
        result = ath_decode_rest(file->scratch, body.bytes, body.size, file->branches, (int32_t)header->branch_count,
                                 head.step, file->connected, 0, 0, file->rest_steps, file->rest);
        if (!has_source_rest(file)) file->source_rest = 0;
    }
    return result;
}

/* What follows from the rest pose. */
static void know_rest(ath_file *file)
{
    file->rest_known = 1;
    file->plan.rest = file->rest;
    if (file->first_layer > 0 && !file->header.is_predicted)
        file->bases_count = (uint64_t)ath_basis_layout(file->pieces, file->plan.piece_count, file->rest, file->gaps,
                                                       (int32_t *)file->scratch);
    ath_plan_nodes(&file->plan, file->nodes);
}

static int time_clip(const ath_file *file, int32_t index, ath_time_method method, ath_bytes body)
{
    ath_clip *clip = file->clips + index;
    double *times = file->times + clip->first_frame, first = 0.0, step = 0.0;
    if (method != 2 && ath_parse_steady(body, method, index, &first, &step) != ATH_OK) return ATH_BAD_CHUNK;
    for (int32_t i = 0; i < clip->frame_count; i++) {
        if (method == 0 || method == 4) times[i] = first + (double)i * step;
        if (method == 1 || method == 3) times[i] = first + (double)i / step;
        if (!ath_is_finite(times[i]) || (i > 0 && !(times[i] > times[i - 1]))) return ATH_BAD_CHUNK;
    }
    clip->duration = times[clip->frame_count - 1] - times[0];
    return ATH_OK;
}

static int read_time(ath_file *file, ath_fault_info *fault)
{
    ath_bytes chunk, body;
    ath_time_method method;
    int result = load(file, ATH_TIME, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_time(chunk, file->info.clip_count, &method, &body);
    if (result == ATH_OK && method == 2)
        result = ath_decode_times(file->scratch, body.bytes, body.size, file->info.frame_count, file->times);
    for (int32_t i = 0; result == ATH_OK && i < file->info.clip_count; i++) result = time_clip(file, i, method, body);
    return result;
}

/* ---- opening ---- */

static void set_info(ath_file *file, uint64_t prelude)
{
    const ath_header *header = &file->header;
    ath_info *info = &file->info;
    info->file_length = header->file_length;
    info->prelude_length = prelude;
    info->max_error = header->max_error;
    info->vertex_count = (int32_t)header->vertex_count;
    info->branch_count = (int32_t)header->branch_count;
    info->frame_count = (int32_t)header->frame_count;
    info->segment_count = (int32_t)header->segment_count;
    info->level_count = header->level_count;
    info->full_level_count = header->full_level_count;
    info->layer_count = header->layer_count;
    info->chunk_count = (int32_t)header->chunk_count;
    info->is_float64 = header->is_float64;
    info->is_predicted = header->is_predicted;
}

/* One level more than the lossy ones gives the very positions of the source. */
static int check_levels(const ath_file *file, ath_fault_info *fault)
{
    int32_t lossy = ath_lossy_levels(file), found = file->info.full_level_count;
    int placed = file->plan.height == 0 || !file->header.is_predicted;
    if (placed && (found == lossy || found == lossy + 1)) return ATH_OK;
    return ath_refuse(fault, ATH_BAD_HEADER, ATH_FIELD_FULL_LEVEL_COUNT, found, lossy, lossy + 1);
}

static int read_prelude(ath_file *file, const ath_limits *limits, ath_fault_info *fault)
{
    int result = read_clips(file, fault);
    if (result == ATH_OK) result = check_memory(&file->header, limits, (uint64_t)file->longest, fault);
    if (result == ATH_OK) result = count_coded(file, fault);
    if (result == ATH_OK) result = read_hierarchy(file, limits, fault);
    if (result != ATH_OK) return result;
    build_plan(file);
    file->info.node_count = file->plan.node_count;
    file->info.depth_levels = ath_min(file->info.level_count, file->plan.height + 2);
    if ((result = check_levels(file, fault)) != ATH_OK) return result;
    plan_levels(file);
    if ((result = check_motion_chunks(file, fault)) != ATH_OK) return result;
    if ((result = check_joins(file, fault)) != ATH_OK) return result;
    plan_layers(file);
    if ((result = read_rest(file, fault)) != ATH_OK) return result;
    if ((result = read_time(file, fault)) != ATH_OK) return result;
    if (!file->info.rest_is_host) know_rest(file);
    return ATH_OK;
}

/* Parses the front into the file, once these are known to fit into the memory. */
static int read_front(ath_file *file, size_t memory_bytes, const uint8_t *bytes, size_t available,
                      const ath_limits *limits, ath_fault_info *fault)
{
    ath_header header;
    ath_file counted;
    uint64_t needed;
    int result = ath_read_header(bytes, available, limits, &header, &needed, fault);
    if (result != ATH_OK) return result;
    header.has_faces = 0; /* not known before the table is read, which needs memory; what they need comes last */
    if (memory_bytes < carve_file(file, &header, 0)) return ath_refuse(fault, ATH_NO_MEMORY, ATH_FIELD_NONE, 0, 0, 0);
    memset(file, 0, sizeof *file);
    carve_file(file, &header, (uint8_t *)file);
    result = ath_read_tables(bytes, available, limits, &header, &needed, file->chunks, file->errors, file->joins,
                             file->repeats, fault);
    file->header = header;
    set_info(file, needed);
    if (result == ATH_OK) result = check_least_memory(&header, limits, fault);
    if (result != ATH_OK) return result;
    if (memory_bytes < carve_file(&counted, &header, 0))
        return ath_refuse(fault, ATH_NO_MEMORY, ATH_FIELD_NONE, 0, 0, 0);
    carve_file(file, &header, (uint8_t *)file);
    return ATH_OK;
}

int ath_open(void *memory, size_t memory_bytes, const uint8_t *bytes, size_t available, const ath_limits *limits,
             ath_fault_info *fault)
{
    ath_limits chosen = limits_or_default(limits);
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    ath_file *file = (ath_file *)memory;
    if (!ath_fits(memory, memory_bytes, sizeof *file)) return ath_refuse(why, ATH_NO_MEMORY, ATH_FIELD_NONE, 0, 0, 0);
    int result = read_front(file, memory_bytes, bytes, available, &chosen, why);
    if (result == ATH_OK) {
        ath_feed(file, bytes, 0, available);
        result = read_prelude(file, &chosen, why);
    }
    why->code = result;
    return result;
}

/* ---- the host's mesh ---- */

/* The bits of a vertex's numbers, of which -0.0 counts as 0.0. */
static void mesh_bits(const uint8_t *xyz, uint32_t bits[3])
{
    memcpy(bits, xyz, 3 * sizeof *bits);
    for (int k = 0; k < 3; k++)
        if (bits[k] == 0x80000000) bits[k] = 0;
}

/* FORMAT.md, "REST": of the bytes from the first to the last, and from the last to the first. */
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

/* The first vertex with a number that is infinite or NaN; count: none. */
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
    for (size_t v = 0; v < file->header.vertex_count; v++) {
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
    if (file->rest_known) return ATH_OK; /* it is this one */
    copy_mesh(file, bytes, stride);
    take_numbers(file);
    know_rest(file);
    return ATH_OK;
}

/* ---- building ---- */

static int32_t wave_kind(const ath_file *file, int32_t segment, int32_t of_nodes)
{
    if (clip_of(file, segment)->periodic) return ATH_PERIODIC;
    return of_nodes ? ATH_BEAM : ATH_SMOOTH;
}

static uint64_t carve_build(ath_file *file, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint8_t are_there[ATH_WAVE_KINDS][ATH_SEGMENT_FRAMES + 1] = {{0}};
    for (int32_t s = 0; s < file->info.segment_count; s++)
        for (int32_t of_nodes = 0; of_nodes < 2; of_nodes++)
            are_there[wave_kind(file, s, of_nodes)][ath_file_frames(file, s)] = 1;
    file->bases = (double *)ath_take(&arena, file->bases_count * sizeof(double));
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

int ath_build(ath_file *file, void *memory, size_t memory_bytes)
{
    ath_file counted = *file;
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    if (!ath_fits(memory, memory_bytes, carve_build(&counted, 0))) return ATH_NO_MEMORY;
    carve_build(file, (uint8_t *)memory);
    if (file->bases_count > 0) { /* laid out again: the gaps may be a layer's since */
        ath_basis_layout(file->pieces, file->plan.piece_count, file->rest, file->gaps, (int32_t *)file->scratch);
        ath_basis_fill(file->pieces, file->plan.piece_count, file->rest, file->gaps, 0, (double *)file->scratch,
                       file->bases);
    }
    file->plan.bases = file->bases;
    for (int32_t kind = 0; kind < ATH_WAVE_KINDS; kind++)
        for (int32_t frames = 1; frames <= ATH_SEGMENT_FRAMES; frames++)
            if (file->waves[kind][frames]) ath_waves(frames, kind, file->waves[kind][frames]);
    return ATH_OK;
}

/* ---- refinements ---- */

static size_t place_of(const ath_file *file, ath_order order, size_t v)
{
    return order == ATH_SOURCE_ORDER ? (size_t)file->vertex_source[v] : v;
}

/* What a layer refines. */
static const ath_plan *plan_before(const ath_file *file, int32_t q)
{
    return q > file->first_layer ? &file->layers[q - 1].plan : &file->plan;
}

/* What a layer refines, if that has bases. */
static const ath_plan *known_bases(const ath_file *file, int32_t q)
{
    return q > file->first_layer || file->bases_count > 0 ? plan_before(file, q) : 0;
}

static const int32_t *rest_steps_before(const ath_file *file, int32_t q)
{
    return q > file->first_layer ? file->layers[q - 1].rest_steps : file->rest_steps;
}

static int decode_layer_rest(ath_file *file, int32_t q, ath_bytes chunk)
{
    ath_layer *layer = &file->layers[q];
    ath_bytes body;
    double step;
    int result = ath_parse_refined_rest(chunk, &step, &body);
    if (result == ATH_OK)
        result = ath_decode_rest(file->scratch, body.bytes, body.size, file->branches, file->info.branch_count, step,
                                 file->connected, rest_steps_before(file, q), plan_before(file, q)->rest,
                                 layer->rest_steps, layer->rest);
    return result;
}

/* The layer's rest pose, once that of the layer before is known. */
static int read_layer_rest(ath_file *file, int32_t q, ath_fault_info *fault)
{
    ath_layer *layer = &file->layers[q];
    const ath_chunk *chunk = ath_file_chunk(file, ATH_REFINED_REST, q > 0 ? ath_level_of_layer(file, q) : 1, 0);
    layer->plan.rest = plan_before(file, q)->rest;
    if (!chunk) {
        memcpy(layer->rest_steps, rest_steps_before(file, q), 3 * (size_t)file->header.vertex_count * sizeof(int32_t));
        return ATH_OK;
    }
    ath_bytes content = {chunk->bytes, chunk->length};
    int32_t index = (int32_t)(chunk - file->chunks);
    int result = ath_check_chunk(file, index, fault);
    if (result != ATH_OK) return result;
    if (file->rest_is_exact || decode_layer_rest(file, q, content) != ATH_OK) {
        ath_refuse(fault, ATH_BAD_CHUNK, ATH_FIELD_CONTENT, 0, 0, 0);
        return ath_fault_at(fault, chunk, index);
    }
    layer->plan.rest = layer->rest;
    layer->bases_count = (uint64_t)ath_basis_layout(layer->pieces, layer->plan.piece_count, layer->rest, file->gaps,
                                                    (int32_t *)file->scratch);
    if (q == 0) ath_plan_nodes(&layer->plan, layer->nodes);
    return ATH_OK;
}

int ath_refine_size(ath_file *file, int32_t level, size_t *memory_bytes, ath_fault_info *fault)
{
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    ath_arena counted = {0, 0};
    *memory_bytes = 0;
    why->code = ATH_OK;
    if (level < 0 || level >= file->info.level_count) return ath_refuse(why, ATH_BAD_ARGUMENT, ATH_FIELD_NONE, 0, 0, 0);
    if (!file->rest_known)
        return ath_refuse(why, ATH_NEEDS_HOST_MESH, ATH_FIELD_HOST_MESH, 0, file->info.host_checksum[0],
                          file->info.vertex_count);
    for (int32_t q = file->first_layer; level > 0 && q <= ath_layer_of(file, level); q++) {
        ath_layer *layer = &file->layers[q];
        int result = layer->rest_known ? ATH_OK : read_layer_rest(file, q, why);
        if (result != ATH_OK) return result;
        layer->rest_known = 1;
        if (!layer->plan.bases) ath_take(&counted, layer->bases_count * sizeof(double));
    }
    *memory_bytes = ath_size_or_most(counted.used);
    return ATH_OK;
}

int ath_refine(ath_file *file, int32_t level, void *memory, size_t memory_bytes)
{
    ath_arena arena = {(uint8_t *)memory, 0};
    size_t needed;
    int result = ath_refine_size(file, level, &needed, 0);
    if (result != ATH_OK) return result;
    if (!file->bases || (needed > 0 && !ath_fits(memory, memory_bytes, needed))) return ATH_NO_MEMORY;
    for (int32_t q = file->first_layer; level > 0 && q <= ath_layer_of(file, level); q++) {
        ath_layer *layer = &file->layers[q];
        if (layer->plan.bases) continue;
        double *bases = (double *)ath_take(&arena, layer->bases_count * sizeof(double));
        if (layer->bases_count > 0) {
            ath_basis_layout(layer->pieces, layer->plan.piece_count, layer->rest, file->gaps, (int32_t *)file->scratch);
            ath_basis_fill(layer->pieces, layer->plan.piece_count, layer->rest, file->gaps, known_bases(file, q),
                           (double *)file->scratch, bases);
            layer->plan.bases = bases;
        } else {
            const ath_piece *before = plan_before(file, q)->pieces;
            for (int32_t p = 0; p < layer->plan.piece_count; p++) {
                layer->pieces[p].modes = before[p].modes;
                layer->pieces[p].basis = before[p].basis;
                layer->pieces[p].rank = before[p].rank;
            }
            layer->plan.bases = plan_before(file, q)->bases;
        }
    }
    return ATH_OK;
}

int ath_level_rest(const ath_file *file, int32_t level, ath_order order, double *xyz, size_t stride)
{
    if (level < 0 || level >= file->info.level_count) return ATH_BAD_ARGUMENT;
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    int32_t layer = ath_layer_of(file, level);
    const ath_plan *plan = ath_level_plan(file, level);
    if (plan != &file->plan && !file->layers[layer].rest_known) return ATH_BAD_ARGUMENT;
    for (size_t v = 0; v < file->header.vertex_count; v++) {
        double *out = (double *)(void *)((char *)xyz + place_of(file, order, v) * stride);
        for (size_t k = 0; k < 3; k++)
            out[k] = file->rest_is_exact ? file->source_rest[3 * v + k] : plan->rest[3 * v + k] + file->info.origin[k];
    }
    return ATH_OK;
}

/* ---- what a file holds ---- */

void ath_get_info(const ath_file *file, ath_info *info) { *info = file->info; }

const double *ath_errors(const ath_file *file) { return file->errors; }

const uint8_t *ath_joins(const ath_file *file) { return file->joins; }

const uint8_t *ath_repeats(const ath_file *file) { return file->repeats; }

const ath_branch *ath_branches(const ath_file *file) { return file->branches; }

const int32_t *ath_vertex_source(const ath_file *file) { return file->vertex_source; }

const int32_t *ath_branch_source(const ath_file *file) { return file->branch_source; }

const double *ath_times(const ath_file *file) { return file->times; }

const ath_clip *ath_clips(const ath_file *file) { return file->clips; }

int32_t ath_clip_named(const ath_file *file, const char *name)
{
    for (int32_t i = 0; i < file->info.clip_count; i++)
        if (same_name(file->clips[i].name, name)) return i;
    return -1;
}

double ath_seam_error(const ath_file *file, int32_t clip, int32_t level)
{
    return (double)file->seams[clip * file->header.full_level_count + level];
}

/* The finest reference pose that has been read. */
static const double *finest_reference(const ath_file *file)
{
    const double *reference = file->rest;
    for (int32_t q = file->first_layer; q < file->header.layer_count && file->layers[q].rest_known; q++)
        reference = file->layers[q].plan.rest;
    return reference;
}

/* The rest pose of the source, of which SOURCE_REST says how the reference pose bends into it. */
static int read_source_rest(ath_file *file, ath_fault_info *fault)
{
    ath_bytes chunk, body;
    ath_source_rest_head head;
    double *turns = (double *)(void *)((uint8_t *)file->scratch + turns_place());
    int result = load(file, ATH_SOURCE_REST, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_source_rest(chunk, &head, &body);
    if (result != ATH_OK) return result;
    if (head.exact)
        return ath_decode_exact_rest(file->scratch, body.bytes, body.size, file->branches, file->info.branch_count, 0,
                                     file->info.rest_is_float64, file->source_rest);
    result = ath_decode_source_rest(file->scratch, body.bytes, body.size, file->branches, file->info.branch_count,
                                    head.step, finest_reference(file), turns, file->source_rest);
    for (size_t i = 0; i < 3 * (size_t)file->header.vertex_count; i++)
        file->source_rest[i] = file->source_rest[i] + file->info.origin[i % 3];
    return result;
}

int ath_read_rest(ath_file *file, ath_fault_info *fault)
{
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    why->code = ATH_OK;
    if (!has_source_rest(file)) return ATH_OK;
    why->code = read_source_rest(file, why);
    file->source_rest_known = why->code == ATH_OK;
    return why->code;
}

/* ATH_OK where ath_rest can give it. */
static int rest_is_there(const ath_file *file)
{
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    return has_source_rest(file) && !file->source_rest_known ? ATH_MISSING : ATH_OK;
}

static double rest_number(const ath_file *file, const double *reference, size_t i)
{
    return file->source_rest ? file->source_rest[i] : reference[i] + file->info.origin[i % 3];
}

int ath_rest(const ath_file *file, ath_order order, float *xyz, size_t stride)
{
    int result = rest_is_there(file);
    if (result != ATH_OK) return result;
    const double *reference = finest_reference(file);
    for (size_t v = 0; v < file->header.vertex_count; v++) {
        float *out = (float *)(void *)((char *)xyz + place_of(file, order, v) * stride);
        for (size_t k = 0; k < 3; k++) out[k] = (float)rest_number(file, reference, 3 * v + k);
    }
    return ATH_OK;
}

int ath_rest_float64(const ath_file *file, ath_order order, double *xyz, size_t stride)
{
    int result = rest_is_there(file);
    if (result != ATH_OK) return result;
    const double *reference = finest_reference(file);
    for (size_t v = 0; v < file->header.vertex_count; v++) {
        double *out = (double *)(void *)((char *)xyz + place_of(file, order, v) * stride);
        for (size_t k = 0; k < 3; k++) out[k] = rest_number(file, reference, 3 * v + k);
    }
    return ATH_OK;
}

/* Of segments together: what at most a hundredth of each exceeds, at most a hundredth of all does; squares are weighted
 * by the frames of their segments. */
double ath_level_error(const ath_file *file, int32_t level, int32_t first, int32_t last, ath_measure measure)
{
    const double *errors = file->errors + ATH_MEASURES * (size_t)level * (size_t)file->info.segment_count + measure;
    double largest = 0.0, squares = 0.0, frames = 0.0;
    for (int32_t s = first; s <= last; s++) {
        double error = errors[ATH_MEASURES * s];
        double count = (double)(ath_segment_start(file, s + 1) - ath_segment_start(file, s)); /* repeats included */
        if (error > largest) largest = error;
        squares = squares + error * error * count;
        frames = frames + count;
    }
    return measure != ATH_RMS || first == last ? largest : ath_sqrt(squares / frames);
}

const ath_clip *ath_file_clip(const ath_file *file, int32_t frame)
{
    return clip_at(file, offsetof(ath_clip, first_frame), frame);
}

const double *ath_file_waves(const ath_file *file, int32_t segment)
{
    return file->waves[wave_kind(file, segment, 0)][ath_file_frames(file, segment)];
}

const double *ath_file_node_waves(const ath_file *file, int32_t segment)
{
    return file->waves[wave_kind(file, segment, 1)][ath_file_frames(file, segment)];
}

int32_t ath_segment_start(const ath_file *file, int32_t segment)
{
    const ath_clip *clip = clip_of(file, segment);
    int64_t within = segment - clip->first_segment;
    return clip->first_frame + (int32_t)(clip->frame_count * within / clip->segment_count);
}

int32_t ath_file_frames(const ath_file *file, int32_t segment)
{
    return file->coded[ath_segment_start(file, segment + 1) - 1] + 1;
}

int32_t ath_segment_before(const ath_file *file, int32_t segment)
{
    const ath_clip *clip = clip_at(file, offsetof(ath_clip, first_segment), segment);
    if (segment > clip->first_segment) return segment - 1;
    return clip->loop && clip->segment_count > 1 ? clip->first_segment + clip->segment_count - 1 : -1;
}

int32_t ath_join_at(const ath_file *file, int32_t segment, int32_t level)
{
    int32_t shown = ath_min(level, ath_lossy_levels(file) - 1);
    return file->has_joins ? file->joins[shown * file->info.segment_count + segment] : 0;
}

int32_t ath_joined_to(const ath_file *file, int32_t segment, int32_t level)
{
    return ath_join_at(file, segment, level) > 0 ? ath_segment_before(file, segment) : -1;
}

int32_t ath_segment_of(const ath_file *file, int32_t frame)
{
    const ath_clip *clip = ath_file_clip(file, frame);
    int64_t within = frame - clip->first_frame;
    int32_t segment = clip->first_segment + (int32_t)(within * clip->segment_count / clip->frame_count);
    while (segment + 1 < clip->first_segment + clip->segment_count && ath_segment_start(file, segment + 1) <= frame)
        segment++;
    return segment;
}

/* ---- chunks and bytes ---- */

const ath_chunk *ath_chunks(const ath_file *file) { return file->chunks; }

int ath_check_chunk(const ath_file *file, int32_t index, ath_fault_info *fault)
{
    const ath_chunk *chunk = file->chunks + index;
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    uint32_t found = chunk->bytes ? ath_crc32c(0, chunk->bytes, chunk->length) : 0;
    why->code = ATH_OK;
    if (!chunk->bytes)
        ath_refuse(why, ATH_MISSING, ATH_FIELD_CHUNK_SIZE, 0, chunk->length, chunk->length);
    else if (found != chunk->checksum)
        ath_refuse(why, ATH_BAD_CHECKSUM, ATH_FIELD_CHUNK_CHECKSUM, found, chunk->checksum, chunk->checksum);
    return ath_fault_at(why, chunk, index);
}

/* ---- polygons ---- */

static int find_polygons(const ath_file *file, int kind, ath_polygons *shape, ath_bytes *body, ath_fault_info *fault)
{
    ath_bytes chunk;
    if (!ath_find_chunk(file->chunks, file->header.chunk_count, kind, ATH_NO_LEVEL, 0))
        return ath_refuse(fault, ATH_BAD_ARGUMENT, ATH_FIELD_NONE, 0, 0, 0);
    int result = load(file, kind, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_polygons(chunk, shape, body);
    int too_small = ath_vertices_of_type(shape->index_type, file->info.vertex_count) < file->info.vertex_count;
    if (result == ATH_OK && shape->is_derived && (kind == ATH_FACES || too_small)) result = ATH_BAD_CHUNK;
    if (result == ATH_OK && kind == ATH_EDGES && !shape->is_derived && shape->columns != 2) result = ATH_BAD_CHUNK;
    return fault->code = result;
}

int ath_polygons_of(const ath_file *file, int kind, ath_polygons *shape, ath_fault_info *fault)
{
    ath_fault_info unwanted;
    ath_bytes body;
    return find_polygons(file, kind, shape, &body, fault ? fault : &unwanted);
}

size_t ath_polygons_size(const ath_file *file) { return ath_faces_memory(file->info.vertex_count); }

int ath_read_polygons(const ath_file *file, int kind, void *memory, size_t memory_bytes, uint32_t *counts,
                      int32_t *corners, ath_fault_info *fault)
{
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    ath_polygons shape;
    ath_bytes body;
    int result = find_polygons(file, kind, &shape, &body, why);
    if (result != ATH_OK || shape.is_derived) return result;
    if (!ath_fits(memory, memory_bytes, ath_polygons_size(file)))
        return ath_refuse(why, ATH_NO_MEMORY, ATH_FIELD_NONE, 0, 0, 0);
    return why->code = ath_decode_faces(memory, body, &shape, file->info.vertex_count, counts, corners);
}

const ath_chunk *ath_file_chunk(const ath_file *file, int32_t kind, int32_t level, int32_t segment)
{
    return ath_find_chunk(file->chunks, file->header.chunk_count, kind, level,
                          ath_is_shared(kind) ? 0 : (uint32_t)segment);
}

/* First chunk that ends behind `offset`. */
static uint32_t chunk_at(const ath_file *file, uint64_t offset)
{
    uint32_t low = 0, high = file->header.chunk_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (file->chunks[middle].offset + file->chunks[middle].length <= offset)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

void ath_feed(ath_file *file, const uint8_t *bytes, uint64_t offset, size_t size)
{
    uint64_t end = offset + size;
    for (uint32_t i = chunk_at(file, offset); i < file->header.chunk_count; i++) {
        ath_chunk *chunk = file->chunks + i;
        if (chunk->offset + chunk->length > end) break;
        if (chunk->offset >= offset && chunk->length > 0) chunk->bytes = bytes + (chunk->offset - offset);
    }
}

void ath_drop(ath_file *file, uint64_t offset, uint64_t size)
{
    for (uint32_t i = chunk_at(file, offset); i < file->header.chunk_count && file->chunks[i].offset < offset + size;
         i++)
        if (file->chunks[i].length > 0) file->chunks[i].bytes = 0;
}

/* Ranges in the making, of what is asked for. */
typedef struct {
    const ath_file *file;
    int32_t level, all;
    uint64_t end; /* of the chunk written or counted last */
    ath_range *ranges;
    int32_t capacity, count;
} range_list;

/* Nothing where the chunk is null, empty, or there and not asked for. */
static void add_range(range_list *list, const ath_chunk *chunk, int all)
{
    if (!chunk || chunk->length == 0 || (chunk->bytes && !all)) return;
    int joined = list->count > 0 && chunk->offset == list->end;
    list->end = chunk->offset + chunk->length;
    if (!joined) list->count++;
    if (list->count > list->capacity) return;
    if (!joined) list->ranges[list->count - 1].offset = chunk->offset;
    list->ranges[list->count - 1].size = list->end - list->ranges[list->count - 1].offset;
}

/* As ath_file_needs; not, unless `all` are asked for, of a rest pose that has been read. */
static int is_used(const ath_file *file, int32_t kind, int32_t d, int32_t level, int all)
{
    if (!ath_file_needs(file, kind, d, level)) return 0;
    return all || kind != ATH_REFINED_REST || !file->layers[ath_layer_of(file, d)].rest_known;
}

/* Looks at the chunks of these segments alone: who asks for one segment after the other must not look at all chunks for
 * each. only_end: what those joined to them need of them. */
static void add_segments(range_list *list, int32_t d, int32_t first, int32_t last, int only_end)
{
    const ath_file *file = list->file;
    uint32_t i = ath_first_chunk(file->chunks, file->header.chunk_count, ATH_STEMS, d, (uint32_t)first);
    for (; i < file->header.chunk_count; i++) {
        const ath_chunk *chunk = file->chunks + i;
        if (!ath_is_motion(chunk) || chunk->level != d || (int32_t)chunk->segment > last) break;
        if (only_end && !ath_shapes_end(chunk->kind)) continue;
        if (is_used(file, chunk->kind, d, list->level, list->all)) add_range(list, chunk, list->all);
    }
}

/* What all segments share, where it does not stand with segments that are looked at. */
static void add_shared(range_list *list, int32_t d)
{
    for (int32_t kind = ATH_SHAPES; kind <= ATH_REFINED_REST; kind++)
        if (ath_is_shared(kind) && is_used(list->file, kind, d, list->level, list->all))
            add_range(list, ath_file_chunk(list->file, kind, d, 0), list->all);
}

int32_t ath_onward_ranges(const ath_file *file, int32_t from_level, int32_t level, int32_t first_segment,
                          int32_t last_segment, int all, ath_range *ranges, int32_t capacity)
{
    range_list list = {file, level, all, 0, ranges, capacity, 0};
    for (int32_t d = from_level + 1; d <= level; d++) {
        if (first_segment > 0) add_shared(&list, d);
        add_segments(&list, d, first_segment, last_segment, 0);
    }
    return list.count;
}

int32_t ath_ranges(const ath_file *file, int32_t level, int32_t first_segment, int32_t last_segment, int all,
                   ath_range *ranges, int32_t capacity)
{
    range_list list = {file, level, all, 0, ranges, capacity, 0};
    const ath_clip *last = clip_at(file, offsetof(ath_clip, first_segment), last_segment);
    int32_t of_loop = last->first_segment < first_segment ? -1 : ath_joined_to(file, last->first_segment, level);
    int32_t before = ath_joined_to(file, first_segment, level);
    if (before > first_segment) before = -1; /* a loop's */
    for (int32_t d = 0; d <= level; d++) {
        if (before != 0 && first_segment > 0) add_shared(&list, d);
        if (before >= 0) add_segments(&list, d, before, before, 1);
        add_segments(&list, d, first_segment, last_segment, 0);
        if (of_loop > last_segment) add_segments(&list, d, of_loop, of_loop, 1);
    }
    return list.count;
}

static int has_chunks(const ath_file *file, int32_t segment, int32_t level, int only_end)
{
    for (int32_t kind = ATH_STEMS; kind <= ATH_PREDICTED; kind++)
        for (int32_t d = 0; d <= level; d++) {
            if (!is_used(file, kind, d, level, 0) || (only_end && !ath_shapes_end(kind))) continue;
            const ath_chunk *chunk = ath_file_chunk(file, kind, d, segment);
            if (chunk && !chunk->bytes) return 0;
        }
    return 1;
}

static int is_ready(const ath_file *file, int32_t segment, int32_t level)
{
    int32_t before = ath_joined_to(file, segment, level);
    return has_chunks(file, segment, level, 0) && (before < 0 || has_chunks(file, before, level, 1));
}

int32_t ath_ready_level(const ath_file *file, int32_t segment)
{
    for (int32_t level = file->info.level_count - 1; level >= 0; level--)
        if (is_ready(file, segment, level)) return level;
    return -1;
}

/* ---- parts of a level ---- */

/* Walks over the parts in order; `parts` may be null. */
static void walk_cut(const ath_file *file, int32_t level, ath_part *parts, int32_t count[3])
{
    const ath_plan *plan = &file->plan;
    ath_part run = {0, 0, -1, 0};
    int32_t n = 0;
    count[0] = count[1] = count[2] = 0;
    for (int32_t p = 0; p <= plan->piece_count; p++) {
        const ath_piece *piece = plan->pieces + p;
        int exact = p < plan->piece_count && piece->level <= level;
        if (run.count > 0 && !exact) {
            if (parts) parts[count[0]] = run;
            count[0]++;
            run.count = 0;
        }
        if (exact && run.count == 0) {
            run.first = piece->first;
            run.index = count[2];
        }
        if (exact) run.count += piece->count;
        if (exact) count[2] += piece->count;
        while (n < plan->node_count && plan->nodes[n].piece < p) n++;
        if (n == plan->node_count || plan->nodes[n].piece != p || !ath_is_shown(plan->nodes + n, level)) continue;
        ath_part node = {plan->nodes[n].first, plan->nodes[n].count, plan->nodes[n].branch, count[1]};
        if (parts) parts[count[0]] = node;
        count[0]++;
        count[1]++;
    }
}

void ath_cut_size(const ath_file *file, int32_t level, int32_t *parts, int32_t *nodes, int32_t *exact_vertices)
{
    int32_t count[3];
    walk_cut(file, level, 0, count);
    if (parts) *parts = count[0];
    if (nodes) *nodes = count[1];
    if (exact_vertices) *exact_vertices = count[2];
}

void ath_cut(const ath_file *file, int32_t level, ath_part *parts)
{
    int32_t count[3];
    walk_cut(file, level, parts, count);
}
