/* Opening a file: its memory, and the chunks of the prelude. */
#include "file/file.h"
#include "streams/decode.h"

enum { NAME_BYTES = 256 }; /* bytes of a clip's name with its terminating zero */
enum { LEAST_PIECE = 32 }; /* fewest vertices of a long stem's pieces: whole rings, at most 64 vertices */

static int32_t most_pieces(const ath_header *header)
{
    return (int32_t)(header->branch_count + header->place_count / LEAST_PIECE);
}

static uint64_t scratch_size(const ath_header *header)
{
    uint64_t size = ath_larger(header->place_count, ath_basis_table_size(most_pieces(header))) * sizeof(int32_t);
    size = ath_larger(size, (uint64_t)header->branch_count * 9 * sizeof(double)); /* turns of SOURCE_REST */
    return ath_larger(size, ATH_BASIS_WORK * sizeof(double));
}

/* If the file has layers, all of them get memory for a rest pose, stored or not. */
static void carve_layers(ath_file *file, const ath_header *header, ath_arena *arena)
{
    uint64_t vertices = header->place_count;
    if (header->layer_count < 2) return;
    file->rest_steps = (int32_t *)ath_take(arena, vertices * 3 * sizeof(int32_t));
    file->layers[0].nodes = (ath_node *)ath_take(arena, header->branch_count * sizeof(ath_node));
    for (int32_t q = 0; q < header->layer_count; q++) {
        file->layers[q].pieces = (ath_piece *)ath_take(arena, (uint64_t)most_pieces(header) * sizeof(ath_piece));
        file->layers[q].rest = (double *)ath_take(arena, vertices * 3 * sizeof(double));
        file->layers[q].rest_steps = (int32_t *)ath_take(arena, vertices * 3 * sizeof(int32_t));
    }
}

/* Returns the bytes of FACES as read, and of scratch memory to read and build them. */
static uint64_t mesh_work(const ath_header *header)
{
    uint64_t places = header->place_count, read = (MESH_CORNERS + MESH_FACES) * places * sizeof(int32_t);
    uint64_t building = ath_mesh_work(places, MESH_CORNERS * places) * sizeof(int32_t);
    return read + ath_larger(building, ath_faces_memory((int32_t)header->vertex_count, (int32_t)header->place_count));
}

/* Places the file's arrays behind its struct, or only counts them if the base is null. Returns the bytes of all. */
static uint64_t carve_file(ath_file *file, const ath_header *header, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t vertices = header->place_count, branches = header->branch_count;
    int32_t place_count = (int32_t)header->place_count;
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
    file->vertex_places = (int32_t *)ath_take(&arena, (uint64_t)header->vertex_count * sizeof(int32_t));
    if (header->vertex_count > header->place_count)
        file->places_work = ath_take(&arena, ath_faces_memory(place_count, place_count));
    file->times = (double *)ath_take(&arena, (uint64_t)header->frame_count * sizeof(double));
    file->rest = (double *)ath_take(&arena, vertices * 3 * sizeof(double));
    file->source_rest = (double *)ath_take(&arena, vertices * 3 * sizeof(double));
    file->pieces = (ath_piece *)ath_take(&arena, (uint64_t)most_pieces(header) * sizeof(ath_piece));
    file->nodes = (ath_node *)ath_take(&arena, branches * sizeof(ath_node));
    file->gaps = (uint8_t *)ath_take(&arena, vertices);
    file->model = ath_take(&arena, ath_prelude_model_size());
    file->scratch = ath_take(&arena, scratch_size(header));
    carve_layers(file, header, &arena);
    if (header->has_faces) ath_carve_mesh(&file->mesh, &arena, vertices, MESH_CORNERS * vertices, mesh_work(header));
    return arena.used;
}

/* Checks the memory of a segment, which does not depend on the decoder (FORMAT.md, "Limits"). */
static int check_memory(const ath_header *header, const ath_limits *limits, uint64_t frames, ath_fault_info *fault)
{
    uint64_t twins = header->vertex_count - header->place_count;
    uint64_t needed =
        header->place_count * (ATH_BYTES_PER_FRAME * frames + ATH_BYTES_PER_VERTEX) + twins * ATH_BYTES_PER_TWIN;
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

/* Gives a clip the frames and segments after those before it; ATH_BAD_CHUNK: there are not enough left. */
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
    return ath_clip_among(file, index, clip->name) < 0 ? ATH_OK : ATH_BAD_CHUNK;
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
    int result = ath_load(file, ATH_CLIPS, &chunk, fault);
    for (int32_t i = 0; result == ATH_OK && i < header->clip_count; i++) result = read_clip(file, i, &chunk);
    if (result != ATH_OK) return result;
    const ath_clip *last = file->clips + header->clip_count - 1;
    int whole = chunk.size == 0 && last->first_frame + last->frame_count == (int32_t)header->frame_count
                && last->first_segment + last->segment_count == (int32_t)header->segment_count;
    return whole ? ATH_OK : ATH_BAD_CHUNK;
}

/* Counts coded frames. The first frame of a segment cannot repeat, since the segment lacks the frame before. */
static int count_coded(ath_file *file, ath_fault_info *fault)
{
    for (int32_t s = 0, i = 0; s < file->info.segment_count; s++) {
        int32_t start = i, stop = ath_segment_start(file, s + 1);
        for (int32_t coded = -1; i < stop; i++) {
            coded += !file->repeats[i];
            file->coded[i] = (uint8_t)coded;
        }
        if (!file->repeats[start]) continue;
        return ath_refuse_entry(fault, ATH_FIELD_REPEAT, ATH_NO_LEVEL, (uint32_t)s, start);
    }
    return ATH_OK;
}

static int check_depth(const ath_file *file, ath_fault_info *fault)
{
    int32_t deepest = 0;
    for (int32_t b = 0; b < file->info.branch_count; b++) deepest = ath_max(deepest, file->branches[b].depth);
    if ((uint32_t)deepest < file->limits.hierarchy_depth) return ATH_OK;
    fault->field = ATH_FIELD_HIERARCHY_DEPTH;
    fault->found = (double)deepest + 1;
    fault->most = (double)file->limits.hierarchy_depth;
    return fault->code = ATH_LIMIT_EXCEEDED;
}

static int read_hierarchy(ath_file *file, ath_fault_info *fault)
{
    const ath_header *header = &file->header;
    int32_t branch_count = (int32_t)header->branch_count, vertex_count = (int32_t)header->place_count;
    ath_bytes chunk;
    int result = check_memory(header, &file->limits, (uint64_t)file->longest, fault);
    if (result == ATH_OK) result = count_coded(file, fault);
    if (result == ATH_OK) result = ath_load(file, ATH_HIERARCHY, &chunk, fault);
    if (result != ATH_OK) return result;
    memset(file->branches, 0, (size_t)branch_count * sizeof *file->branches);
    result = ath_decode_hierarchy(file->model, chunk.bytes, chunk.size, branch_count, vertex_count, file->branches,
                                  file->branch_source, file->vertex_source);
    if (result != ATH_OK) return result;
    return check_depth(file, fault);
}

/* Begins to read which vertices share a place. */
static int prepare_places(ath_file *file, ath_fault_info *fault)
{
    const ath_header *header = &file->header;
    ath_bytes chunk;
    const ath_chunk *unwanted = ath_find_chunk(file->chunks, header->chunk_count, ATH_PLACES, ATH_NO_LEVEL, 0);
    if (!ath_is_split(file) && unwanted) {
        ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_KIND, ATH_PLACES, 0, 0);
        return ath_fault_at(fault, unwanted, (int32_t)(unwanted - file->chunks));
    }
    if (!ath_is_split(file)) return ATH_OK;
    int result = ath_load(file, ATH_PLACES, &chunk, fault);
    if (result != ATH_OK) return result;
    return ath_start_places(file->places_work, chunk, &file->shape, (int32_t)header->vertex_count,
                            (int32_t)header->place_count, file->vertex_places);
}

/* Turns the numbers of places into vertices in file order and back, all of which the file has as decoded so far. */
static void number_vertices(ath_file *file)
{
    const ath_header *header = &file->header;
    int32_t *number = (int32_t *)file->scratch; /* in file order, of each place */
    int32_t vertex_count = (int32_t)header->vertex_count, place_count = (int32_t)header->place_count;
    for (int32_t v = 0; v < place_count; v++) number[file->vertex_source[v]] = v;
    for (int32_t i = vertex_count - 1; i >= 0; i--) {
        int32_t v = number[ath_is_split(file) ? file->vertex_places[i] : i];
        file->vertex_places[i] = v;
        file->vertex_source[v] = i; /* the first vertex there comes last */
    }
}

static int read_places(ath_file *file, int32_t *cost)
{
    int result = ath_is_split(file) ? ath_decode_faces(file->places_work, cost) : ATH_OK;
    if (result == ATH_OK) number_vertices(file);
    return result;
}

static void build_plan(ath_file *file)
{
    ath_plan *plan = &file->plan;
    plan->vertex_count = (int32_t)file->header.place_count;
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

/* Pieces of a layer follow with its rest pose. */
static void plan_layers(ath_file *file)
{
    file->first_layer = ath_file_chunk(file, ATH_REFINED_REST, 1, 0) ? 0 : 1;
    for (int32_t q = file->first_layer; q < file->header.layer_count; q++) {
        file->layers[q].plan = file->plan;
        file->layers[q].plan.pieces = file->layers[q].pieces;
    }
    if (file->first_layer > 0) return;
    memcpy(file->layers[0].nodes, file->nodes, (size_t)file->plan.node_count * sizeof *file->nodes);
    file->layers[0].plan.nodes = file->layers[0].nodes;
}

/* Notes which stages have which chunks. */
static void plan_stages(ath_file *file)
{
    const ath_plan *plan = &file->plan;
    file->stems_stages = 0;
    memset(file->affine_stages, 0, sizeof file->affine_stages);
    for (int32_t p = 0; p < plan->piece_count && !file->header.is_predicted; p++) {
        file->stems_stages |= 1u << plan->pieces[p].stage;
        if (plan->pieces[p].low_stage >= 0) file->stems_stages |= 1u << plan->pieces[p].low_stage;
    }
    for (int32_t q = 1; q < file->header.layer_count; q++) file->stems_stages |= 1u << ath_stage_of_layer(file, q);
    for (int32_t n = 0; n < plan->node_count; n++) {
        const ath_node *node = plan->nodes + n;
        for (int32_t stage = node->stage; node->coded && stage <= node->last_stage; stage++)
            file->affine_stages[stage] |= 1u << node->stage;
    }
    file->shown_affines = 0;
    for (int32_t level = 0; level < file->info.level_count; level++)
        file->shown_affines |= file->affine_stages[ath_file_stage(file, level)];
}

/* Returns whether a stored level needs, or may have, chunks of this kind at a stage. */
static int may_stand(const ath_file *file, int32_t kind, int32_t d)
{
    if (kind == ATH_AFFINES) return file->shown_affines >> d & 1;
    if (kind == ATH_CORRECTIONS && ath_file_stage(file, ath_level_of(&file->header, d)) != d) return 0;
    return ath_file_needs(file, kind, d, d);
}

static int is_wanted(const ath_file *file, const ath_chunk *chunk)
{
    if (ath_is_shared(chunk->kind) && chunk->segment > 0) return 0;
    return !ath_is_motion(chunk) || !ath_kind_name(chunk->kind) || may_stand(file, chunk->kind, chunk->stage);
}

static int refuse_first_missing(const ath_file *file, int32_t kind, int32_t level, ath_fault_info *fault)
{
    int32_t segment = 0;
    while (ath_file_chunk(file, kind, level, segment)) segment++;
    return ath_refuse_missing(fault, kind, ath_level_of(&file->header, level), (uint32_t)segment);
}

/* Checks that the table has the motion chunks that the hierarchy asks for, and no others. */
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
            if (chunk->kind == kinds[i]) count[i][chunk->stage]++;
    }
    for (int32_t i = 0; i < required; i++)
        for (int32_t d = 0; d < file->header.stage_count; d++)
            if (may_stand(file, kinds[i], d) && count[i][d] < file->info.segment_count)
                return refuse_first_missing(file, kinds[i], d, fault);
    return ATH_OK;
}

static int check_joins(ath_file *file, ath_fault_info *fault)
{
    int32_t segments = file->info.segment_count, lossy = ath_lossy_stages(file);
    if (file->header.is_predicted) lossy = 1; /* only maps are joined, not predicted motion */
    for (int32_t i = 0; i < file->info.level_count * segments; i++) {
        int32_t level = i / segments, segment = i % segments, width = file->joins[i] % ATH_JOIN_SLOPED;
        if (width == 0) continue;
        int32_t before = ath_segment_before(file, segment);
        int goes_on = before >= 0 && ath_file_frames(file, before) >= ATH_END_FRAMES;
        file->has_joins = 1;
        if (goes_on && ath_file_stage(file, level) < lossy && width <= ath_file_frames(file, segment) - 2) continue;
        return ath_refuse_entry(fault, ATH_FIELD_JOIN, level, (uint32_t)segment, 0);
    }
    return ATH_OK;
}

static int time_clip(const ath_file *file, int32_t index, ath_time_method method, ath_bytes body)
{
    ath_clip *clip = file->clips + index;
    double *times = file->times + clip->first_frame, first = 0.0, step = 0.0;
    if (method != ATH_TIME_STREAM && ath_parse_steady(body, method, index, &first, &step) != ATH_OK)
        return ATH_BAD_CHUNK;
    for (int32_t i = 0; i < clip->frame_count; i++) {
        if (method == ATH_TIME_STEP) times[i] = first + (double)i * step;
        if (method == ATH_TIME_RATE) times[i] = (double)i / step;
        if (!ath_is_finite(times[i]) || (i > 0 && !(times[i] > times[i - 1]))) return ATH_BAD_CHUNK;
    }
    clip->duration = times[clip->frame_count - 1] - times[0];
    return ATH_OK;
}

static int read_time(ath_file *file, ath_fault_info *fault)
{
    ath_bytes chunk, body;
    ath_time_method method;
    int result = ath_load(file, ATH_TIME, &chunk, fault);
    if (result == ATH_OK) result = ath_parse_time(chunk, file->info.clip_count, &method, &body);
    if (result == ATH_OK && method == ATH_TIME_STREAM)
        result = ath_decode_times(file->model, body.bytes, body.size, file->info.frame_count, file->times);
    for (int32_t i = 0; result == ATH_OK && i < file->info.clip_count; i++) result = time_clip(file, i, method, body);
    return result;
}

static void set_info(ath_file *file, uint64_t prelude)
{
    const ath_header *header = &file->header;
    ath_info *info = &file->info;
    info->file_length = header->file_length;
    info->prelude_length = prelude;
    info->max_error = header->max_error;
    info->vertex_count = (int32_t)header->vertex_count;
    info->place_count = (int32_t)header->place_count;
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

/* A file may have one level beyond the last lossy one, which is exact and goes on from it. */
static int check_levels(const ath_file *file, ath_fault_info *fault)
{
    int32_t lossy = ath_lossy_stages(file), last = file->info.full_level_count - 1;
    int32_t found = ath_file_stage(file, last) + 1;
    int placed = !file->header.is_predicted || (file->plan.height == 0 && !file->predicted_trees);
    if (placed && found == lossy) return ATH_OK;
    if (placed && found == lossy + 1 && last > 0 && ath_file_stage(file, last - 1) == lossy - 1) return ATH_OK;
    return ath_refuse(fault, ATH_BAD_HEADER, ATH_FIELD_FULL_LEVEL_COUNT, found, lossy, lossy + 1);
}

static int read_plan(ath_file *file, ath_fault_info *fault)
{
    int result;
    build_plan(file);
    file->predicted_trees = 0;
    for (int32_t b = 0; b < file->plan.branch_count; b++)
        if (file->branches[b].parent < 0 && file->branches[b].flags & ATH_LOOSE) file->predicted_trees = 1;
    file->info.node_count = file->plan.node_count;
    file->info.depth_levels = ath_min(file->info.level_count, ath_level_of(&file->header, file->plan.height + 1) + 1);
    if ((result = check_levels(file, fault)) != ATH_OK) return result;
    plan_stages(file);
    if ((result = check_motion_chunks(file, fault)) != ATH_OK) return result;
    if ((result = check_joins(file, fault)) == ATH_OK) plan_layers(file);
    return result;
}

int ath_open_within(ath_file *file, int32_t *cost, ath_fault_info *fault)
{
    const int32_t first = 5, last = first + ATH_REST_PARTS; /* the parts that read REST, and the one behind them */
    ath_fault_info *why = &file->fault;
    int result = file->opened > last ? ATH_OK : ATH_MORE;
    while (result == ATH_MORE && (!cost || *cost > 0)) {
        int32_t part = file->opened; /* in the order of FORMAT.md, "Opening" */
        result = part == 0      ? read_clips(file, why)
                 : part == 1    ? read_hierarchy(file, why)
                 : part == 2    ? prepare_places(file, why)
                 : part == 3    ? read_places(file, cost)
                 : part == 4    ? read_plan(file, why)
                 : part == last ? read_time(file, why)
                                : ath_read_reference(file, part - first, cost, why);
        if (result != ATH_OK) continue;
        if (part == last && !file->info.rest_is_host) ath_know_rest(file);
        ath_spend(cost, ath_max(file->info.vertex_count, file->info.frame_count));
        if (file->opened++ < last) result = ATH_MORE;
    }
    why->code = result == ATH_MORE ? ATH_OK : result;
    if (fault) *fault = *why;
    return result;
}

/* Parses the front into the file after checking that it fits into the memory. */
static int read_front(ath_file *file, size_t memory_bytes, const uint8_t *bytes, size_t available,
                      const ath_limits *limits, ath_fault_info *fault)
{
    ath_header header;
    ath_file counted;
    uint64_t needed;
    int result = ath_read_header(bytes, available, limits, &header, &needed, fault);
    if (result != ATH_OK) return result;
    header.has_faces = 0; /* known once the table is read, which needs memory; the mesh's memory comes last */
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

int ath_open_start(void *memory, size_t memory_bytes, const uint8_t *bytes, size_t available, const ath_limits *limits,
                   ath_fault_info *fault)
{
    ath_limits chosen = limits_or_default(limits);
    ath_fault_info unwanted, *why = fault ? fault : &unwanted;
    ath_file *file = (ath_file *)memory;
    if (!ath_fits(memory, memory_bytes, sizeof *file)) return ath_refuse(why, ATH_NO_MEMORY, ATH_FIELD_NONE, 0, 0, 0);
    int result = read_front(file, memory_bytes, bytes, available, &chosen, why);
    why->code = result;
    if (result != ATH_OK) return result;
    ath_feed(file, bytes, 0, available);
    file->limits = chosen;
    return ATH_MORE;
}

int ath_open(void *memory, size_t memory_bytes, const uint8_t *bytes, size_t available, const ath_limits *limits,
             ath_fault_info *fault)
{
    int result = ath_open_start(memory, memory_bytes, bytes, available, limits, fault);
    return result == ATH_MORE ? ath_open_within((ath_file *)memory, 0, fault) : result;
}
