/* The contents of an opened file: clips, segments, chunks, polygons, parts of a level. */
#include "file/file.h"
#include "streams/decode.h"

static int same_name(const char *a, const char *b)
{
    while (*a && *a == *b) a++, b++;
    return *a == *b;
}

/* Returns the last clip that begins at or before a frame or segment. `first`: offset in ath_clip. */
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

const ath_clip *ath_segment_clip(const ath_file *file, int32_t segment)
{
    return clip_at(file, offsetof(ath_clip, first_segment), segment);
}

void ath_get_info(const ath_file *file, ath_info *info) { *info = file->info; }
const double *ath_errors(const ath_file *file) { return file->errors; }
const uint8_t *ath_joins(const ath_file *file) { return file->joins; }
const uint8_t *ath_stages(const ath_file *file) { return file->header.stages; }
const uint8_t *ath_repeats(const ath_file *file) { return file->repeats; }
const ath_branch *ath_branches(const ath_file *file) { return file->branches; }
const int32_t *ath_vertex_source(const ath_file *file) { return file->vertex_source; }
const int32_t *ath_vertex_places(const ath_file *file) { return file->vertex_places; }
const int32_t *ath_branch_source(const ath_file *file) { return file->branch_source; }
const double *ath_times(const ath_file *file) { return file->times; }
const ath_clip *ath_clips(const ath_file *file) { return file->clips; }

int32_t ath_clip_among(const ath_file *file, int32_t count, const char *name)
{
    for (int32_t i = 0; i < count; i++)
        if (same_name(file->clips[i].name, name)) return i;
    return -1;
}

int32_t ath_clip_named(const ath_file *file, const char *name)
{
    return ath_clip_among(file, file->info.clip_count, name);
}

double ath_seam_error(const ath_file *file, int32_t clip, int32_t level)
{
    return (double)file->seams[clip * file->header.full_level_count + level];
}

/* The largest error and the largest percentile hold for all segments together. Mean squares are weighted by frames. */
double ath_level_error(const ath_file *file, int32_t level, int32_t first, int32_t last, ath_measure measure)
{
    const double *errors = file->errors + ATH_MEASURES * (size_t)level * (size_t)file->info.segment_count + measure;
    double largest = 0.0, squares = 0.0, frames = 0.0;
    for (int32_t s = first; s <= last; s++) {
        double error = errors[ATH_MEASURES * s];
        double count = (double)(ath_segment_start(file, s + 1) - ath_segment_start(file, s)); /* with repeats */
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

int32_t ath_segment_start(const ath_file *file, int32_t segment)
{
    const ath_clip *clip = ath_segment_clip(file, segment);
    int64_t within = segment - clip->first_segment;
    return clip->first_frame + (int32_t)(clip->frame_count * within / clip->segment_count);
}

int32_t ath_file_frames(const ath_file *file, int32_t segment)
{
    return file->coded[ath_segment_start(file, segment + 1) - 1] + 1;
}

int32_t ath_segment_before(const ath_file *file, int32_t segment)
{
    const ath_clip *clip = ath_segment_clip(file, segment);
    if (segment > clip->first_segment) return segment - 1;
    return clip->loop && clip->segment_count > 1 ? clip->first_segment + clip->segment_count - 1 : -1;
}

int32_t ath_join_at(const ath_file *file, int32_t segment, int32_t stage)
{
    int32_t shown = ath_level_of(&file->header, ath_min(stage, ath_lossy_stages(file) - 1));
    return file->has_joins ? file->joins[shown * file->info.segment_count + segment] : 0;
}

int32_t ath_joined_to(const ath_file *file, int32_t segment, int32_t level)
{
    return ath_join_at(file, segment, ath_file_stage(file, level)) > 0 ? ath_segment_before(file, segment) : -1;
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

void ath_fill_places(const ath_file *file, void *xyz, size_t stride, size_t bytes)
{
    if (!ath_is_split(file)) return;
    for (size_t i = 0; i < file->header.vertex_count; i++) {
        size_t first = (size_t)file->vertex_source[file->vertex_places[i]];
        if (first != i) memcpy((char *)xyz + i * stride, (char *)xyz + first * stride, bytes);
    }
}

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

int ath_refuse_missing(ath_fault_info *fault, int32_t kind, int32_t level, uint32_t segment)
{
    ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_MISSING_CHUNK, 0, 1, 1);
    fault->kind = (uint16_t)kind;
    fault->level = (uint8_t)level;
    fault->segment = segment;
    return ATH_BAD_CHUNK_TABLE;
}

int ath_load(const ath_file *file, int32_t kind, ath_bytes *content, ath_fault_info *fault)
{
    const ath_chunk *chunk = ath_find_chunk(file->chunks, file->header.chunk_count, kind, ATH_NO_LEVEL, 0);
    if (!chunk) return ath_refuse_missing(fault, kind, ATH_NO_LEVEL, 0);
    int32_t index = (int32_t)(chunk - file->chunks);
    content->bytes = chunk->bytes;
    content->size = chunk->length;
    int result = ath_check_chunk(file, index, fault);
    if (result != ATH_OK) return result;
    ath_refuse(fault, ATH_BAD_CHUNK, ATH_FIELD_CONTENT, 0, 0, 0);
    ath_fault_at(fault, chunk, index);
    return ATH_OK;
}

const ath_chunk *ath_file_chunk(const ath_file *file, int32_t kind, int32_t stage, int32_t segment)
{
    return ath_find_chunk(file->chunks, file->header.chunk_count, kind, stage,
                          ath_is_shared(kind) ? 0 : (uint32_t)segment);
}

/* If nothing of stage 0 serves other stages, stage 1 may refine the rest pose. */
static int stands_alone(const ath_file *file) { return !((file->stems_stages | file->affine_stages[1]) & 1); }

int ath_file_needs(const ath_file *file, int32_t kind, int32_t d, int32_t stage)
{
    if (kind == ATH_STEMS) return d <= stage && (file->stems_stages >> d & 1);
    if (kind == ATH_AFFINES) return file->affine_stages[stage] >> d & 1;
    if (kind == ATH_SHAPES) return d <= stage && (file->stems_stages >> d & 1);
    int32_t shown = ath_min(stage, ath_lossy_stages(file) - 1);
    if (kind == ATH_CORRECTIONS) return d == shown && d > file->plan.height && !file->header.is_predicted;
    if (kind == ATH_PREDICTED && file->predicted_trees) return d == shown && d == ath_lossy_stages(file) - 1;
    if (kind == ATH_PREDICTED) return d == shown && d > file->plan.height && file->header.is_predicted;
    if (kind == ATH_REFINED_REST && d <= shown && file->header.layer_count > 1)
        return d > file->plan.height + 1 || (d == 1 && stands_alone(file));
    return kind == ATH_EXACT && d == stage && d > shown;
}

static int find_polygons(const ath_file *file, int kind, ath_polygons *shape, ath_bytes *body, ath_fault_info *fault)
{
    ath_bytes chunk;
    if (!ath_find_chunk(file->chunks, file->header.chunk_count, kind, ATH_NO_LEVEL, 0))
        return ath_refuse(fault, ATH_BAD_ARGUMENT, ATH_FIELD_NONE, 0, 0, 0);
    int result = ath_load(file, kind, &chunk, fault);
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

size_t ath_polygons_size(const ath_file *file)
{
    return ath_size_or_most(ath_faces_memory(file->info.vertex_count, file->info.place_count));
}

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
    ath_start_faces(memory, body, &shape, file->info.vertex_count, file->vertex_places, file->info.place_count, counts,
                    corners);
    return why->code = ath_decode_faces(memory, 0);
}

/* Counts the parts, nodes and exact vertices of a level, and fills the parts unless `parts` is null. */
static void walk_cut(const ath_file *file, int32_t level, ath_part *parts, int32_t count[3])
{
    const ath_plan *plan = &file->plan;
    int32_t stage = ath_file_stage(file, level);
    ath_part run = {0, 0, -1, 0};
    int32_t n = 0;
    count[0] = count[1] = count[2] = 0;
    for (int32_t p = 0; p <= plan->piece_count; p++) {
        const ath_piece *piece = plan->pieces + p;
        int exact = p < plan->piece_count && piece->stage <= stage;
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
        if (n == plan->node_count || plan->nodes[n].piece != p || !ath_is_shown(plan->nodes + n, stage)) continue;
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
