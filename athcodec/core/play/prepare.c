/* Decodes the chunks of a segment into positions and maps: the streams of all levels side by side, piece by piece. A
 * piece is placed as soon as its integers are decoded, so that only attach caches are kept. */
#include "play/prepare.h"
#include "bits/exact.inl"
#include "model/foresee.h"
#include "model/maps.h"
#include "model/refine.h"
#include "play/join.h"
#include "play/keep.h"
#include "play/store.h"
#include "streams/decode.h"
#include "streams/motion_streams.inl"
#include "streams/predict.h"

enum { CHECKSUM_STEP = 1 << 16 };

typedef enum { BEFORE, CHECKSUMS, HEADS, FRAMES, PIECES, DONE, FAILED } prepare_phase;

typedef struct {
    ath_coder coder;
    shape_model *model;
    refined_shape_model *refined; /* replaces `model` in a refinement */
    int32_t shift;                /* see ath_parse_refined_shapes */
    const ath_chunk *chunk;       /* null: no piece of the level has shapes */
} shapes_reader;

typedef struct {
    ath_coder coder;
    coefficient_model *model;
    refinement_model *refined; /* replaces `model` in a refinement */
    uint32_t *history;
    double *temporal;
    const ath_chunk *chunk; /* null: the level has none, or this preparation does not need it */
} stems_reader;

typedef struct {
    ath_coder coder;
    affine_model *model;
    uint32_t *history;
    const ath_chunk *chunk;
} affines_reader;

typedef struct {
    ath_coder coder;
    correction_model *model;
    double step;
    const ath_chunk *chunk;
} corrections_reader;

typedef struct {
    ath_coder coder;
    exact_model *model;
    int32_t length[3];
    const ath_chunk *chunk;
} exact_reader;

/* A layer of precision, which one piece after the other passes through. */
typedef struct {
    const ath_plan *plan;
    ath_motion motion;
    ath_scratch scratch;
    ath_piece_rows rows;
    int32_t counts[ATH_SLOTS];
    int32_t *shape_integers; /* all 0 between pieces */
    double *unit_shapes;
    ath_piece_before before; /* the piece in the layer before */
    double turn_steps[3];    /* rotation steps in the layer before */
    const double *placed;    /* null: the piece is not placed in this layer */
    uint8_t used[ATH_PIECE_VERTICES];
} layer_work;

/* The segment that is asked for, and what its preparation starts from. */
typedef struct {
    const ath_file *file;
    void *memory;    /* memory of the segment */
    int32_t is_full; /* 1: that memory has room for positions */
    void *positions; /* destination of the positions; null: that memory */
    int32_t index, level;
    const ath_segment *from; /* this segment at an earlier level; null: none */
    const void *kept;        /* integers of `from`; null: none */
    kept_head *keeps;        /* memory of what is kept, written by `keeping`; null: none */
    kept_writer keeping;
    ath_watcher *watcher; /* null: none */
} preparation;

struct ath_work {
    const ath_file *file;
    ath_segment *segment;
    preparation asked;
    ath_join join;
    int32_t only_end; /* 1: the segment before the one asked for is in preparation */
    shapes_reader shapes[ATH_LEVELS];
    stems_reader stems[ATH_LEVELS];
    affines_reader affines[ATH_LEVELS];
    corrections_reader corrections;
    exact_reader exact_level;
    ath_prediction *prediction;
    const ath_chunk *predicted; /* null: there is none, or this preparation does not need it */
    ath_stream streams[ATH_LEVELS];
    layer_work layers[ATH_LAYERS];
    ath_node_rows node;
    void *prelude_model;
    prepare_phase phase;
    const ath_segment *shown_before; /* the level whose positions make_exact starts from; null: none */
    const uint8_t *kept;             /* the next piece to restore; null: pieces are decoded */
    kept_head *keeps;                /* asked.keeps while the segment asked for is in preparation */
    kept_writer keeping;
    int32_t index, level;       /* the segment in preparation */
    int32_t first_level;        /* first level whose chunks are read */
    int32_t first_layer, layer; /* first and last layer that pieces pass through */
    int32_t next;               /* next level of CHECKSUMS and HEADS, next piece of PIECES */
    int32_t next_kind;          /* next kind of CHECKSUMS */
    uint32_t crc, crc_at;
    int32_t next_node, exact, shown;
    ath_fault_info fault;
    int32_t node_step;
};

/* ---- memory ---- */

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

static uint64_t carve_work(ath_work *work, const ath_file *file, int32_t frames, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t row = 3 * (uint64_t)frames * sizeof(int32_t);
    ath_take(&arena, sizeof *work);
    if (file->has_joins) ath_carve_end(&work->join, file, &arena);
    for (int32_t d = 0; d < file->header.stage_count; d++) {
        if (file->stems_levels >> d & 1) carve_stems(work, file, d, frames, &arena);
        if (file->shown_affines >> d & 1) {
            work->affines[d].model = (affine_model *)ath_take(&arena, sizeof(affine_model));
            work->affines[d].history = (uint32_t *)ath_take(&arena, history_size(frames));
        }
    }
    work->corrections.model = (correction_model *)ath_take(&arena, sizeof(correction_model));
    if (ath_file_is_lossless(file)) work->exact_level.model = (exact_model *)ath_take(&arena, sizeof(exact_model));
    if (file->header.is_predicted)
        work->prediction = (ath_prediction *)ath_take(&arena, ath_prediction_size(file->plan.vertex_count));
    work->prelude_model = ath_take(&arena, ath_prelude_model_size());
    work->node.rows = (int32_t *)ath_take(&arena, 4 * row);
    for (int32_t q = 0; q <= ath_layer_of(file, file->header.stage_count - 1); q++)
        carve_layer(work->layers + q, file, q, frames, &arena);
    return arena.used;
}

static uint64_t carve_segment(ath_segment *segment, const ath_file *file, int32_t level, int32_t frames, int is_full,
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
    return ath_size_or_most(carve_work(&counted, file, file->longest, 0));
}

size_t ath_segment_size(const ath_file *file, int32_t level)
{
    ath_segment counted;
    return ath_size_or_most(carve_segment(&counted, file, level, file->longest, 1, 0));
}

/* Returns whether the vertices of each piece stand side by side in the source, which may have the pieces in another
 * order. Predicted motion is written by vertex, not by piece. */
static int are_side_by_side(const ath_file *file)
{
    const int32_t *source = file->vertex_source;
    if (file->header.is_predicted) return 0;
    for (const ath_piece *piece = file->plan.pieces; piece < file->plan.pieces + file->plan.piece_count; piece++)
        for (int32_t v = piece->first; v < piece->first + piece->count; v++)
            if (source[v] - source[piece->first] != v - piece->first) return 0;
    return 1;
}

static int is_source_order(const ath_file *file)
{
    int32_t vertex = 0;
    while (vertex < file->plan.vertex_count && file->vertex_source[vertex] == vertex) vertex++;
    return vertex == file->plan.vertex_count;
}

/* Returns whether ath_positions only copies the positions of a segment at a level, piece by piece. */
static int are_copied(const ath_file *file, int32_t index, int32_t level)
{
    int32_t exact, frames = ath_segment_start(file, index + 1) - ath_segment_start(file, index);
    ath_cut_size(file, level, 0, 0, &exact);
    if (ath_is_split(file) || exact < file->plan.vertex_count || frames != ath_file_frames(file, index)) return 0;
    return is_source_order(file) || are_side_by_side(file);
}

size_t ath_segment_size_to(const ath_file *file, int32_t segment, int32_t level)
{
    ath_segment counted;
    int is_full = !are_copied(file, segment, level) || ath_joined_to(file, segment, level) >= 0;
    return ath_size_or_most(carve_segment(&counted, file, level, file->longest, is_full, 0));
}

int ath_keep(ath_work *work, void *memory, size_t memory_bytes)
{
    kept_head *head = (kept_head *)memory;
    if (!ath_fits(memory, memory_bytes, sizeof *head)) return ATH_NO_MEMORY;
    head->bytes = 0;
    if (!ath_can_be_kept(work->file, work->level)) return ATH_OK;
    head->segment = work->index;
    head->level = work->level;
    work->asked.keeps = work->keeps = head;
    work->keeping.at = (uint8_t *)(head + 1);
    work->keeping.end = (uint8_t *)memory + memory_bytes;
    work->asked.keeping = work->keeping;
    return ATH_OK;
}

void ath_watch(ath_work *work, ath_watcher *watcher) { work->asked.watcher = watcher; }
const ath_file *ath_watched_file(const ath_work *work) { return work->file; }
int32_t ath_watched_level(const ath_work *work) { return ath_level_of(&work->file->header, work->asked.level); }

/* The observer follows the segment asked for, not the one before it. */
static ath_watcher *watcher_of(const ath_work *work) { return work->only_end ? 0 : work->asked.watcher; }

static void set_waves(const ath_work *work, ath_stream *stream)
{
    stream->temporal = ath_file_waves(work->file, work->index);
    stream->temporal_rank = work->segment->frames;
    stream->root = ATH_NO_ROOT;
}

static void restore_streams(ath_work *work)
{
    work->kept += sizeof(kept_head);
    for (int32_t d = 0; d < work->first_level; d++) {
        ath_stream *stream = work->streams + d;
        if (!ath_has_stream(work->file, d)) continue;
        work->kept = ath_kept_stream(work->kept, stream, work->stems[d].temporal, work->segment->frames);
        if (stream->root < 0) set_waves(work, stream);
    }
}

/* ---- start ---- */

static const ath_chunk *wanted_chunk(const ath_file *file, int32_t segment, int32_t level, int32_t kind, int32_t d)
{
    return ath_file_needs(file, kind, d, level) ? ath_file_chunk(file, kind, d, segment) : 0;
}

static const ath_chunk *chunk_of(const ath_work *work, int32_t kind, int32_t d)
{
    if (d < work->first_level || (work->only_end && !ath_shapes_end(kind))) return 0;
    return wanted_chunk(work->file, work->index, work->level, kind, d);
}

static int32_t checksum_steps(const ath_chunk *chunk)
{
    return chunk && chunk->length > 0 ? (int32_t)((chunk->length - 1) / CHECKSUM_STEP) + 1 : 1;
}

/* Skips REFINED_REST, which has been read. */
static int32_t kind_after(int32_t kind) { return kind == ATH_EXACT ? ATH_PREDICTED : kind + 1; }

static int32_t steps_of(const ath_file *file, int32_t segment, int32_t level)
{
    int32_t checks = 0, heads = level + 2;
    for (int32_t d = 0; d <= level; d++)
        for (int32_t kind = ATH_STEMS; kind <= ATH_PREDICTED; kind = kind_after(kind))
            checks += checksum_steps(wanted_chunk(file, segment, level, kind, d));
    int32_t predictions = file->header.is_predicted && level > 0
                              ? ath_prediction_steps(file->plan.vertex_count, ath_file_frames(file, segment))
                              : 0;
    return checks + heads + predictions + file->plan.piece_count + 1;
}

int32_t ath_prepare_steps(const ath_file *file, int32_t segment, int32_t level)
{
    int32_t before = ath_joined_to(file, segment, level);
    level = ath_file_stage(file, level);
    return steps_of(file, segment, level) + (before < 0 ? 0 : 1 + steps_of(file, before, level));
}

static int refuse(ath_work *work, int code, ath_field field, const ath_chunk *chunk, double found, double expected)
{
    ath_refuse(&work->fault, code, field, found, expected, expected);
    return ath_fault_at(&work->fault, chunk, (int32_t)(chunk - work->file->chunks));
}

/* Notes the chunk if the result says that its content is not valid. */
static int blame(ath_work *work, const ath_chunk *chunk, int result)
{
    return result == ATH_OK ? ATH_OK : refuse(work, result, ATH_FIELD_CONTENT, chunk, 0, 0);
}

/* Returns a chunk of the segment, null if it has none, and notes the first that has not been fed. */
static const ath_chunk *fed_chunk(ath_work *work, int32_t kind, int32_t d)
{
    const ath_chunk *chunk = chunk_of(work, kind, d);
    if (chunk && !chunk->bytes && work->fault.code == ATH_OK)
        refuse(work, ATH_MISSING, ATH_FIELD_CHUNK_SIZE, chunk, 0, chunk->length);
    return chunk;
}

static int find_chunks(ath_work *work)
{
    int32_t shown = ath_min(work->level, ath_lossy_levels(work->file) - 1);
    for (int32_t d = 0; d <= work->level; d++) {
        work->stems[d].chunk = fed_chunk(work, ATH_STEMS, d);
        work->affines[d].chunk = fed_chunk(work, ATH_AFFINES, d);
        work->shapes[d].chunk = fed_chunk(work, ATH_SHAPES, d);
    }
    work->predicted = fed_chunk(work, ATH_PREDICTED, shown);
    work->corrections.chunk = fed_chunk(work, ATH_CORRECTIONS, shown);
    work->exact_level.chunk = fed_chunk(work, ATH_EXACT, work->level);
    return work->fault.code;
}

static void ready_layer(ath_work *work, int32_t q)
{
    layer_work *layer = work->layers + q;
    size_t row = 3 * (size_t)work->segment->frames * sizeof(int32_t);
    layer->plan = ath_layer_plan(work->file, q, work->level);
    layer->motion.frames = work->segment->frames;
    layer->motion.streams = work->streams;
    layer->motion.waves = ath_file_node_waves(work->file, work->index);
    layer->motion.ratio = 1;
    layer->scratch = ath_motion_scratch(layer->plan, &layer->motion);
    layer->rows.counts = layer->counts;
    layer->rows.shapes = layer->unit_shapes;
    memset(layer->shape_integers, 0, ATH_MOST_SHAPES * ATH_SHAPE_NUMBERS * sizeof(int32_t));
    memset(layer->rows.modes, 0, (size_t)work->file->plan.longest * row);
    if (q > 0) memset(layer->rows.predicted_modes, 0, (size_t)work->file->plan.longest * row);
    layer->rows.reach = layer->rows.reached_modes = 0;
    memset(layer->rows.rotation, 0, row);
    memset(layer->rows.shift, 0, row);
}

static void ready_motion(ath_work *work)
{
    work->layer = ath_layer_of(work->file, work->level);
    for (int32_t q = work->first_layer; q <= work->layer; q++) ready_layer(work, q);
    work->node.step = &work->node_step;
    memset(work->node.rows, 0, 4 * 3 * (size_t)work->segment->frames * sizeof *work->node.rows);
    for (int32_t d = 0; d < ATH_LEVELS; d++) {
        work->streams[d].step = 1.0;
        set_waves(work, work->streams + d);
    }
}

static void put_elsewhere(ath_segment *segment, const ath_file *file, void *positions)
{
    segment->positions = positions;
    segment->in_source_order = !is_source_order(file);
}

/* Begins to prepare the segment asked for or, for its end, the one before that. */
static int begin(ath_work *work, const preparation *asked, int32_t index, int32_t level)
{
    const ath_file *file = asked->file;
    ath_segment *segment = (ath_segment *)asked->memory;
    int32_t frames = ath_file_frames(file, index);
    ath_join join = work->join;
    memset(work, 0, sizeof *work);
    memset(segment, 0, sizeof *segment);
    carve_work(work, file, frames, (uint8_t *)work);
    carve_segment(segment, file, ath_level_of(&file->header, level), frames, asked->is_full, (uint8_t *)segment);
    segment->index = segment->level = segment->stage = -1;
    work->file = file;
    work->segment = segment;
    work->asked = *asked;
    work->only_end = index != asked->index;
    work->index = index;
    work->level = level;
    work->next_kind = ATH_STEMS;
    if (!work->only_end) {
        join.maps = work->join.maps;
        join.positions = work->join.positions;
        work->join = join;
        work->keeps = asked->keeps;
        work->keeping = asked->keeping;
        if (asked->positions) put_elsewhere(segment, file, asked->positions);
    }
    if (asked->from && !work->only_end) {
        work->first_level = asked->from->stage + 1;
        work->first_layer = ath_layer_of(file, asked->from->stage);
        work->shown_before = asked->kept ? 0 : asked->from;
        work->kept = (const uint8_t *)asked->kept;
    }
    ready_motion(work);
    if (work->kept) restore_streams(work);
    int result = find_chunks(work);
    work->phase = result == ATH_OK ? CHECKSUMS : FAILED;
    return result;
}

static int start(void *memory, size_t work_bytes, const ath_file *file, int32_t index, int32_t level,
                 void *segment_memory, size_t segment_bytes, const ath_segment *before, const void *kept)
{
    ath_work *work = (ath_work *)memory;
    if (index < 0 || index >= file->info.segment_count || level < 0 || level >= file->info.level_count)
        return ATH_BAD_ARGUMENT;
    int32_t stage = ath_file_stage(file, level);
    size_t full = ath_segment_size(file, level);
    int is_full = segment_bytes >= full;
    preparation asked = {file, segment_memory, is_full, 0, index, stage, before, kept, 0, {0, 0}, 0};
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    if (stage > file->built_level || !ath_level_plan(file, stage)->bases
        || !ath_fits(memory, work_bytes, ath_work_size(file))
        || !ath_fits(segment_memory, segment_bytes, is_full ? full : ath_segment_size_to(file, index, level)))
        return ATH_NO_MEMORY;
    memset(work, 0, sizeof *work);
    int result = begin(work, &asked, index, stage), join = ath_join_at(file, index, stage);
    if (result != ATH_OK || join == 0 || work->shown_before) return result; /* `before` is joined already */
    ath_set_join(&work->join, join);
    work->phase = BEFORE;
    return ATH_OK;
}

int ath_prepare_start(void *memory, size_t work_bytes, const ath_file *file, int32_t index, int32_t level,
                      void *segment_memory, size_t segment_bytes)
{
    return start(memory, work_bytes, file, index, level, segment_memory, segment_bytes, 0, 0);
}

int ath_follow(ath_work *work, const ath_segment *before)
{
    if (work->phase != BEFORE) return ATH_OK;
    if (before->index != ath_segment_before(work->file, work->index) || before->stage != work->level)
        return ATH_BAD_ARGUMENT;
    ath_take_end(&work->join, before);
    work->phase = CHECKSUMS;
    return ATH_OK;
}

int ath_prepare_to(ath_work *work, void *positions)
{
    if (!are_copied(work->file, work->asked.index, ath_level_of(&work->file->header, work->asked.level)))
        return ATH_BAD_ARGUMENT;
    work->asked.positions = positions;
    put_elsewhere(work->segment, work->file, positions);
    return ATH_OK;
}

/* Prepares the segment before in the memory of the one asked for. */
static int go_back(ath_work *work)
{
    preparation asked = work->asked;
    return begin(work, &asked, ath_segment_before(work->file, asked.index),
                 ath_min(asked.level, ath_lossy_levels(work->file) - 1));
}

static int go_on(ath_work *work)
{
    preparation asked = work->asked;
    ath_take_end(&work->join, work->segment);
    ath_set_join(&work->join, ath_join_at(work->file, asked.index, asked.level));
    return begin(work, &asked, asked.index, asked.level);
}

/* ---- steps ---- */

static ath_bytes bytes_of(const ath_chunk *chunk)
{
    ath_bytes bytes = {chunk->bytes, chunk->length};
    return bytes;
}

static const ath_chunk *chunk_to_check(const ath_work *work) { return chunk_of(work, work->next_kind, work->next); }

static void next_phase(ath_work *work, prepare_phase phase)
{
    work->phase = phase;
    work->next = 0;
}

/* Moves on to the next chunk of the level, or to the next level. */
static void next_to_check(ath_work *work)
{
    work->crc = work->crc_at = 0;
    work->next_kind = kind_after(work->next_kind);
    if (work->next_kind <= ATH_PREDICTED) return;
    work->next_kind = ATH_STEMS;
    if (work->next++ == work->level) next_phase(work, HEADS);
}

static uint32_t size_to_check(const ath_work *work, const ath_chunk *chunk)
{
    uint32_t left = chunk->length - work->crc_at;
    return left < (uint32_t)CHECKSUM_STEP ? left : (uint32_t)CHECKSUM_STEP;
}

static int check_some(ath_work *work)
{
    const ath_chunk *chunk = chunk_to_check(work);
    if (chunk && work->crc_at < chunk->length) {
        uint32_t size = size_to_check(work, chunk);
        work->crc = ath_crc32c(work->crc, chunk->bytes + work->crc_at, size);
        work->crc_at += size;
    }
    if (chunk && work->crc_at < chunk->length) return ATH_OK;
    if (chunk && work->crc != chunk->checksum)
        return refuse(work, ATH_BAD_CHECKSUM, ATH_FIELD_CHUNK_CHECKSUM, chunk, work->crc, chunk->checksum);
    next_to_check(work);
    return ATH_OK;
}

/* Reads the rows from `known` on, as integers of waves. */
static int read_waves(ath_work *work, const ath_stems_head *head, int32_t known, int32_t d)
{
    stems_reader *reader = work->stems + d;
    coefficient_model *rows = reader->refined ? &reader->refined->rows : reader->model;
    int32_t frames = work->segment->frames, exponents[BASIS_AXES], integers[BASIS_AXES * ATH_SEGMENT_FRAMES];
    basis_model model = basis_model_of(rows, (number_model *)work->prelude_model, frames, reader->history);
    ath_coder coder;
    coder_start(&coder, head->basis.bytes, head->basis.size);
    for (int32_t count; known < head->rank; known += count) {
        count = ath_min(head->rank - known, BASIS_AXES);
        memset(integers, 0, BASIS_AXES * (size_t)frames * sizeof *integers);
        if (!code_basis_rows(&coder, &model, frames, count, exponents, integers)) return ATH_BAD_CHUNK;
        ath_add_basis_rows(ath_file_waves(work->file, work->index), frames, known, count, exponents, integers,
                           reader->temporal);
    }
    return coder_finish(&coder) ? ATH_OK : ATH_BAD_CHUNK;
}

/* Reads the rows from `known` on as samples. Their integers are decoded into the far half of the rows' memory. */
static int read_entries(ath_work *work, const ath_stems_head *head, int32_t known, int32_t d)
{
    int32_t frames = work->segment->frames;
    size_t count = (size_t)(head->rank - known) * (size_t)frames;
    double *rows = work->stems[d].temporal + (size_t)known * (size_t)frames;
    int32_t *integers = (int32_t *)(void *)rows + count;
    int result = ath_decode_temporal(work->prelude_model, head->basis.bytes, head->basis.size, head->rank - known,
                                     frames, integers);
    for (size_t i = 0; result == ATH_OK && i < count; i++) rows[i] = (double)integers[i] / (double)ATH_MOST_SAMPLE;
    return result;
}

/* A basis begins with the rows of another one, if it has a base, and goes on with its own rows. */
static int read_temporal(ath_work *work, const ath_stems_head *head, int32_t d)
{
    stems_reader *reader = work->stems + d;
    ath_stream *stream = work->streams + d;
    const ath_stream *base = head->base >= 0 && head->base < d ? work->streams + head->base : 0;
    if (head->base >= 0 && (!base || base->root < 0 || base->temporal_rank > head->rank)) return ATH_BAD_CHUNK;
    int32_t known = base ? base->temporal_rank : 0;
    if (base) memcpy(reader->temporal, base->temporal, (size_t)known * (size_t)work->segment->frames * sizeof(double));
    stream->temporal = reader->temporal;
    stream->temporal_rank = head->rank;
    stream->root = base ? base->root : d;
    return head->basis_kind == ATH_BASIS_IN_WAVES ? read_waves(work, head, known, d)
                                                  : read_entries(work, head, known, d);
}

static int open_stems(ath_work *work, int32_t d)
{
    stems_reader *reader = work->stems + d;
    ath_stream *stream = work->streams + d;
    ath_stems_head head;
    ath_bytes body;
    int32_t frames = work->segment->frames, q = ath_layer_of(work->file, d);
    int result = q > 0 ? ath_parse_refined_stems(bytes_of(reader->chunk), frames, &head, &body)
                       : ath_parse_stems(bytes_of(reader->chunk), frames, &head, &body);
    if (result != ATH_OK) return result;
    stream->step = head.step;
    stream->rotation_step_factor = head.rotation_step_factor;
    stream->turn_step = head.turn > 0 ? ath_node_step(-head.turn) : 0.0;
    if (head.basis_kind != ATH_WAVES) result = read_temporal(work, &head, d);
    if (q > 0) {
        work->layers[q].motion.ratio = head.ratio;
        refinement_model_init(reader->refined, frames, reader->history);
    } else {
        coefficient_model_init(reader->model, frames, reader->history);
    }
    coder_start(&reader->coder, body.bytes, body.size);
    return result;
}

static int open_shapes(shapes_reader *reader)
{
    ath_bytes body = bytes_of(reader->chunk);
    if (reader->refined) {
        int result = ath_parse_refined_shapes(body, &reader->shift, &body);
        if (result != ATH_OK) return result;
        refined_shape_model_init(reader->refined);
    } else {
        shape_model_init(reader->model);
    }
    coder_start(&reader->coder, body.bytes, body.size);
    return ATH_OK;
}

static int open_corrections(corrections_reader *reader)
{
    ath_bytes body;
    int result = ath_parse_stepped(bytes_of(reader->chunk), &reader->step, &body);
    if (result != ATH_OK) return result;
    correction_model_init(reader->model);
    coder_start(&reader->coder, body.bytes, body.size);
    return ATH_OK;
}

static int open_predicted(ath_work *work)
{
    const ath_segment *segment = work->segment;
    return blame(work, work->predicted,
                 ath_prediction_start(work->prediction, &work->file->plan, work->file->info.origin, segment->frames,
                                      segment->is_float64, bytes_of(work->predicted), segment->positions));
}

/* Opens the streams of one level. */
static int open_level(ath_work *work)
{
    int32_t d = work->next++, result = ATH_OK;
    if (d > work->level) {
        const ath_chunk *chunk = work->corrections.chunk;
        if (work->exact_level.chunk) {
            exact_model_init(work->exact_level.model);
            coder_start(&work->exact_level.coder, work->exact_level.chunk->bytes, work->exact_level.chunk->length);
        }
        next_phase(work, work->predicted ? FRAMES : PIECES);
        for (int32_t k = 0; work->keeping.at && k <= work->level; k++)
            if (ath_has_stream(work->file, k))
                ath_keep_stream(&work->keeping, work->streams + k, work->segment->frames);
        if (work->predicted) return open_predicted(work);
        return chunk ? blame(work, chunk, open_corrections(&work->corrections)) : ATH_OK;
    }
    affines_reader *affines = work->affines + d;
    if (affines->chunk) {
        affine_model_init(affines->model, work->segment->frames, affines->history);
        coder_start(&affines->coder, affines->chunk->bytes, affines->chunk->length);
    }
    const ath_chunk *shapes = work->shapes[d].chunk, *stems = work->stems[d].chunk;
    if (shapes && (result = open_shapes(work->shapes + d)) != ATH_OK) return blame(work, shapes, result);
    return stems ? blame(work, stems, open_stems(work, d)) : ATH_OK;
}

/* ---- pieces ---- */

static void clear_row(int32_t *row, int32_t frames, int32_t *count)
{
    for (int32_t axis = 0; axis < 3 && *count > 0; axis++) memset(row + axis * frames, 0, (size_t)*count * sizeof *row);
    *count = 0;
}

/* code_row needs rows of zeros. */
static void clear_piece(layer_work *layer, const ath_piece *piece)
{
    int32_t T = layer->motion.frames;
    for (int32_t m = 0; m < piece->count; m++) {
        int32_t reach = layer->rows.reach;
        clear_row(ath_row(layer->rows.modes, m, T), T, layer->counts + m);
        if (m < layer->rows.reached_modes) clear_row(ath_row(layer->rows.predicted_modes, m, T), T, &reach);
    }
    memset(layer->shape_integers, 0, (size_t)layer->rows.shape_count * ATH_SHAPE_NUMBERS * sizeof(int32_t));
    layer->rows.shape_count = 0;
    clear_row(layer->rows.shift, T, layer->counts + SHIFT_SLOT);
    clear_row(layer->rows.rotation, T, layer->counts + ROTATION_SLOT);
}

/* Reads the shapes that a level adds to the piece. */
static int read_shapes(ath_work *work, const ath_piece *piece, int32_t level)
{
    shapes_reader *reader = work->shapes + level;
    layer_work *layer = work->layers;
    int32_t known = layer->rows.shape_count;
    int32_t count = code_shapes(&reader->coder, reader->model, piece, level, known, layer->shape_integers);
    if (count < 0) return blame(work, reader->chunk, ATH_BAD_CHUNK);
    size_t from = (size_t)known * ATH_SHAPE_NUMBERS;
    if (!ath_unit_shapes(count - known, layer->shape_integers + from, layer->unit_shapes + from))
        return blame(work, reader->chunk, ATH_BAD_CHUNK);
    layer->rows.shape_count = count;
    return ATH_OK;
}

static int read_piece(ath_work *work, int32_t p, int32_t level)
{
    stems_reader *reader = work->stems + level;
    ath_coder coder = reader->coder;
    layer_work *layer = work->layers;
    if (work->shapes[level].chunk && read_shapes(work, layer->plan->pieces + p, level) != ATH_OK) return ATH_BAD_CHUNK;
    code_piece(&coder, reader->model, layer->plan, work->streams + level, layer->motion.frames, p, level, &layer->rows);
    reader->coder = coder;
    return blame(work, reader->chunk, reader->model->invalid ? ATH_BAD_CHUNK : ATH_OK);
}

static int read_first_layer(ath_work *work, int32_t p)
{
    const ath_piece *piece = work->file->plan.pieces + p;
    int result = ATH_OK;
    if (piece->low_level >= 0 && piece->low_level <= work->level) result = read_piece(work, p, piece->low_level);
    if (piece->level <= work->level && result == ATH_OK) result = read_piece(work, p, piece->level);
    return result;
}

/* ---- refinements ---- */

static int refine_shapes(ath_work *work, int32_t q, const ath_piece *piece)
{
    shapes_reader *reader = work->shapes + piece->level;
    layer_work *layer = work->layers + q, *before = layer - 1;
    if (!reader->chunk) return ATH_OK;
    int32_t count = code_refined_shapes(&reader->coder, reader->refined, piece, before->rows.shape_count,
                                        before->shape_integers, reader->shift, 0, layer->shape_integers);
    if (count < 0 || !ath_unit_shapes(count, layer->shape_integers, layer->unit_shapes))
        return blame(work, reader->chunk, ATH_BAD_CHUNK);
    layer->rows.shape_count = count;
    return ATH_OK;
}

/* Collects what this layer predicts piece p from: the piece's rows in the layer before. */
static void look_before(ath_work *work, int32_t q, int32_t p)
{
    layer_work *layer = work->layers + q;
    const layer_work *coarse = layer - 1;
    const ath_piece *piece = coarse->plan->pieces + p;
    ath_piece_before *before = &layer->before;
    int32_t T = layer->motion.frames, root = work->streams[layer->plan->pieces[p].level].root;
    int same = ath_base_stream(&coarse->motion, piece)->root == root;
    before->rotation = coarse->counts[ROTATION_SLOT] > 0 ? coarse->scratch.rotation : 0;
    before->shift = coarse->counts[SHIFT_SLOT] > 0 ? coarse->scratch.shift : 0;
    before->frames = 0;
    layer->rows.coarse_turn_steps = 0;
    if (piece->flags & ATH_RIGID) {
        ath_turning turning = ath_turning_of(coarse->plan, piece, ath_base_stream(&coarse->motion, piece));
        memcpy(layer->turn_steps, turning.steps, sizeof turning.steps);
        before->frames = coarse->scratch.at.point;
        layer->rows.coarse_turn_steps = layer->turn_steps;
    }
    before->modes = 0;
    before->frequencies = ath_max(ath_row_extent(coarse->rows.shift, T, coarse->counts[SHIFT_SLOT]),
                                  ath_row_extent(coarse->rows.rotation, T, coarse->counts[ROTATION_SLOT]));
    for (int32_t r = 0; r < ath_rank(piece); r++) {
        int32_t count = ath_row_extent(ath_row(coarse->rows.modes, r, T), T, coarse->counts[r]);
        before->frequencies = ath_max(before->frequencies, count);
        same = same && ath_mode_stream(&coarse->motion, piece, r)->root == root;
        if (count > 0) before->modes = coarse->rows.shape_count > 0 ? ath_max(ath_shape_modes(piece), r + 1) : r + 1;
    }
    if (!same && before->frequencies > 0) before->frequencies = T;
    int alike = (coarse->rows.shape_count > 0) == (layer->rows.shape_count > 0);
    layer->rows.reach = before->frequencies;
    layer->rows.reached_modes = ath_predicted_modes(layer->plan->pieces + p, before, &layer->rows);
    layer->rows.coarse_modes = same && alike ? coarse->rows.modes : 0;
    layer->rows.coarse_rotation = same ? coarse->rows.rotation : 0;
    layer->rows.coarse_shift = same ? coarse->rows.shift : 0;
}

/* Returns the place of the piece's first vertex among the positions. */
static size_t position_of_piece(const ath_work *work)
{
    return ath_position_of(work->file, work->segment, (size_t)work->exact);
}

static const double *placed_piece(layer_work *layer, int32_t p, const ath_float_frames *to)
{
    if (!layer->placed)
        layer->placed = ath_pose_used(layer->plan, &layer->motion, layer->plan->pieces + p, &layer->rows, layer->used,
                                      ATH_ALL_VERTICES, &layer->scratch, to);
    return layer->placed;
}

/* Places the piece after ath_turned_attach, in a layer before the last only what other pieces hang on. */
static void pose_piece(const ath_work *work, layer_work *layer, int32_t p)
{
    const ath_piece *piece = layer->plan->pieces + p;
    ath_segment *segment = work->segment;
    ath_float_frames to = {(float *)ath_vertex_at(segment, segment->positions, 0, position_of_piece(work)),
                           3 * (size_t)segment->exact_vertices, work->file->info.origin};
    ath_pose_tracks(&layer->motion, piece, &layer->rows, &layer->scratch, layer->used);
    layer->placed = 0;
    if (layer == work->layers + work->layer)
        placed_piece(layer, p, segment->is_float64 ? 0 : &to);
    else if (piece->attach_cache >= 0)
        ath_pose_used(layer->plan, &layer->motion, piece, &layer->rows, layer->used, piece->attached, &layer->scratch,
                      0);
}

static void predict_modes(layer_work *layer, int32_t p)
{
    layer_work *coarse = layer - 1;
    ath_placing placing = {coarse->plan, &coarse->rows, &coarse->scratch, coarse->used};
    if (ath_foresee_modes(layer->plan, &layer->motion, p, &layer->before, &placing, &layer->scratch, &layer->rows))
        return;
    layer->before.placed = placed_piece(coarse, p, 0);
    ath_predict_modes(layer->plan, &layer->motion, layer->plan->pieces + p, &layer->before, &layer->scratch,
                      &layer->rows);
}

static int refine_piece(ath_work *work, int32_t q, int32_t p)
{
    layer_work *layer = work->layers + q;
    const ath_piece *piece = layer->plan->pieces + p;
    const ath_stream *stream = work->streams + piece->level;
    stems_reader *reader = work->stems + piece->level;
    ath_coder coder = reader->coder;
    if (refine_shapes(work, q, piece) != ATH_OK) return ATH_BAD_CHUNK;
    look_before(work, q, p);
    ath_attach(layer->plan, &layer->motion, piece, layer->scratch.at);
    ath_predict_tracks(layer->plan, &layer->motion, piece, &layer->before, &layer->scratch, &layer->rows);
    code_refined_tracks(&coder, reader->refined, layer->plan, stream, &layer->motion, piece, &layer->rows);
    ath_turn_attached(layer->plan, &layer->motion, piece, &layer->rows, &layer->scratch);
    predict_modes(layer, p);
    code_refined_modes(&coder, reader->refined, stream, &layer->motion, piece, &layer->rows);
    reader->coder = coder;
    if (reader->refined->rows.invalid) return blame(work, reader->chunk, ATH_BAD_CHUNK);
    pose_piece(work, layer, p);
    return ATH_OK;
}

static void correct(ath_segment *segment, size_t at, double parts, double step)
{
    if (parts == 0.0) return;
    double position = ath_number_at(segment->positions, at, segment->is_float64);
    ath_put_number(segment->positions, at, segment->is_float64, ath_corrected(position, parts, step));
}

static void correct_vertex(const corrections_reader *reader, const correction_row *row, ath_segment *segment,
                           size_t position)
{
    ath_corrected_parts parts;
    correction_parts(row, segment->frames, parts);
    for (int32_t from = 0; from < segment->frames; from += CORRECTION_BLOCK)
        for (int32_t t = from; is_reached(row, from) && t < ath_min(from + CORRECTION_BLOCK, segment->frames); t++)
            for (size_t k = 0; k < 3; k++)
                correct(segment, ((size_t)t * (size_t)segment->exact_vertices + position) * 3 + k, parts[t][k],
                        reader->step);
}

static void watch_corrections(const ath_work *work, const correction_row *row, int32_t position)
{
    ath_watcher *watcher = watcher_of(work);
    for (int32_t t = 0; t < work->segment->frames; t++)
        if (has_correction(row, t)) watcher->correction(watcher, position, t, row->of + t, work->corrections.step);
}

static void correct_piece(ath_work *work, const ath_piece *piece)
{
    corrections_reader *reader = &work->corrections;
    ath_coder coder = reader->coder;
    size_t position = position_of_piece(work);
    for (int32_t i = 0; i < piece->count; i++) {
        const correction_row *row = code_vertex(&coder, reader->model, work->segment->frames, 0);
        if (row) correct_vertex(reader, row, work->segment, position + (size_t)i);
        if (row && watcher_of(work)) watch_corrections(work, row, work->exact + i);
    }
    reader->coder = coder;
}

static int read_exact_point(ath_work *work, size_t at)
{
    exact_reader *reader = &work->exact_level;
    double known[3], number[3];
    for (size_t k = 0; k < 3; k++)
        known[k] = ath_number_at(work->segment->positions, at + k, work->segment->is_float64);
    if (!code_exact_point(&reader->coder, reader->model, work->segment->is_float64, known, reader->length, number))
        return 0;
    for (size_t k = 0; k < 3; k++)
        ath_put_number(work->segment->positions, at + k, work->segment->is_float64, number[k]);
    return 1;
}

/* Replaces the positions of the last lossy level by the source's own. */
static int make_exact(ath_work *work, const ath_piece *piece)
{
    size_t vertices = (size_t)work->segment->exact_vertices, position = position_of_piece(work);
    for (int32_t i = 0; i < piece->count; i++)
        for (size_t t = 0; t < (size_t)work->segment->frames; t++)
            if (!read_exact_point(work, (t * vertices + position + (size_t)i) * 3))
                return blame(work, work->exact_level.chunk, ATH_BAD_CHUNK);
    return ATH_OK;
}

static int do_frames(ath_work *work)
{
    int result = ath_prediction_step(work->prediction);
    if (result == ATH_OK) next_phase(work, PIECES);
    return result == ATH_MORE ? ATH_OK : blame(work, work->predicted, result);
}

static void watch_piece(const ath_work *work, int32_t p)
{
    ath_watcher *watcher = watcher_of(work);
    const layer_work *layer = work->layers + work->layer;
    watcher->piece(watcher, layer->plan, &layer->motion, p, &layer->rows);
}

/* Returns whether nothing depends on where a layer before the last has a piece. */
static int is_idle(const layer_work *layer, const ath_piece *piece)
{
    int32_t any = layer->counts[SHIFT_SLOT] | layer->counts[ROTATION_SLOT];
    for (int32_t m = 0; m < ath_rank(piece); m++) any |= layer->counts[m];
    return any == 0 && piece->attach_cache < 0;
}

/* Places the piece at the first layer, then refines it layer by layer. */
static int place_piece(ath_work *work, int32_t p)
{
    const ath_piece *piece = work->file->plan.pieces + p;
    layer_work *layer = work->layers + work->first_layer;
    size_t vertex = (size_t)work->exact, position = position_of_piece(work);
    if (work->first_layer == work->layer || !is_idle(layer, layer->plan->pieces + p)) {
        ath_turned_attach(layer->plan, &layer->motion, p, &layer->rows, &layer->scratch);
        pose_piece(work, layer, p);
    }
    for (int32_t q = work->first_layer + 1; q <= work->layer; q++)
        if (refine_piece(work, q, p) != ATH_OK) return ATH_BAD_CHUNK;
    layer = work->layers + work->layer;
    if (work->keeping.at)
        ath_keep_piece(&work->keeping, piece, &layer->rows, layer->shape_integers, layer->motion.frames);
    if (watcher_of(work)) watch_piece(work, p);
    if (work->segment->is_float64)
        ath_store_doubles(work->segment, work->file->info.origin, position, piece->count, layer->placed);
    ath_keep_end(work->segment, position, vertex, (size_t)piece->count);
    if (work->join.width > 0)
        ath_join_vertices(&work->join, work->segment, position, vertex, (size_t)piece->count, watcher_of(work));
    if (work->corrections.chunk) correct_piece(work, piece);
    return ATH_OK;
}

static int show_piece(ath_work *work, int32_t p)
{
    const ath_piece *piece = work->file->plan.pieces + p;
    if (work->shown_before)
        ath_copy_vertices(work->file, work->segment, work->shown_before, (size_t)work->exact, (size_t)piece->count);
    else if (!work->predicted && place_piece(work, p) != ATH_OK)
        return ATH_BAD_CHUNK;
    int result = work->exact_level.chunk ? make_exact(work, piece) : ATH_OK;
    work->exact += piece->count;
    return result;
}

static void show_node(ath_work *work, int32_t n)
{
    ath_segment *segment = work->segment;
    size_t T = (size_t)segment->frames, nodes = (size_t)segment->node_count;
    double *maps = segment->maps + ATH_MAP * (size_t)work->shown++;
    layer_work *layer = work->layers;
    ath_watcher *watcher = watcher_of(work);
    if (watcher) watcher->node(watcher, layer->plan, &layer->motion, n, &layer->rows, &work->node);
    ath_node_map(layer->plan, &layer->motion, n, &layer->rows, &work->node, &layer->scratch);
    for (size_t t = 0; t < T; t++) {
        double *map = maps + t * nodes * ATH_MAP;
        for (size_t k = 0; k < 9; k++) map[k] = layer->scratch.at.rotation[k * T + t];
        for (size_t k = 0; k < 3; k++) map[9 + k] = layer->scratch.at.point[k * T + t];
    }
    if (work->join.width > 0) ath_join_map(&work->join, segment, (size_t)(work->shown - 1), watcher);
}

static int read_node(ath_work *work, int32_t n)
{
    const ath_node *node = work->file->plan.nodes + n;
    affines_reader *reader = work->affines + node->level;
    if (!node->coded || node->level > work->level || !reader->chunk) return ATH_OK;
    memset(work->node.rows, 0, 4 * 3 * (size_t)work->segment->frames * sizeof *work->node.rows);
    int valid = code_node(&reader->coder, reader->model, work->layers->plan, work->segment->frames, n, &work->node);
    return blame(work, reader->chunk, valid ? ATH_OK : ATH_BAD_CHUNK);
}

static int finish_stream(ath_work *work, const ath_chunk *chunk, const ath_coder *coder)
{
    return blame(work, chunk, !chunk || coder_finish(coder) ? ATH_OK : ATH_BAD_CHUNK);
}

static int finish(ath_work *work)
{
    for (int32_t d = 0; d <= work->level; d++)
        if (finish_stream(work, work->shapes[d].chunk, &work->shapes[d].coder)
            || finish_stream(work, work->stems[d].chunk, &work->stems[d].coder)
            || finish_stream(work, work->affines[d].chunk, &work->affines[d].coder))
            return ATH_BAD_CHUNK;
    if (work->only_end) return go_on(work);
    if (finish_stream(work, work->corrections.chunk, &work->corrections.coder)
        || finish_stream(work, work->exact_level.chunk, &work->exact_level.coder))
        return ATH_BAD_CHUNK;
    work->segment->index = work->index;
    work->segment->stage = work->level;
    work->segment->level = ath_level_of(&work->file->header, work->level);
    ath_cut(work->file, work->segment->level, work->segment->parts);
    if (watcher_of(work)) watcher_of(work)->done(watcher_of(work), &work->layers[work->layer].motion, work->segment);
    if (work->keeping.at) work->keeps->bytes = (uint64_t)(work->keeping.at - (uint8_t *)work->keeps);
    work->phase = DONE;
    return ATH_OK;
}

/* Prepares one piece, and the node that begins with it. */
static int do_piece(ath_work *work)
{
    const ath_plan *plan = &work->file->plan;
    int32_t p = work->next++, result = ATH_OK;
    if (p == plan->piece_count) return finish(work);
    const ath_piece *piece = plan->pieces + p;
    layer_work *first = work->layers + work->first_layer;
    if (work->first_level == 0 && !work->file->header.is_predicted) result = read_first_layer(work, p);
    if (work->kept)
        work->kept = ath_kept_piece(work->kept, piece, &first->rows, first->shape_integers, first->unit_shapes,
                                    first->motion.frames);
    if (result == ATH_OK && work->next_node < plan->node_count && plan->nodes[work->next_node].piece == p) {
        int32_t n = work->next_node++;
        result = read_node(work, n);
        if (result == ATH_OK && ath_is_shown(plan->nodes + n, work->level)) show_node(work, n);
    }
    if (result == ATH_OK && piece->level <= work->level) result = show_piece(work, p);
    for (int32_t q = work->first_layer; q <= work->layer; q++) clear_piece(work->layers + q, piece);
    return result;
}

static int do_step(ath_work *work)
{
    int result = work->phase == FAILED       ? ATH_BAD_ARGUMENT
                 : work->phase == DONE       ? ATH_OK
                 : !work->segment->positions ? ATH_NO_MEMORY
                 : work->phase == BEFORE     ? go_back(work)
                 : work->phase == CHECKSUMS  ? check_some(work)
                 : work->phase == HEADS      ? open_level(work)
                 : work->phase == FRAMES     ? do_frames(work)
                                             : do_piece(work);
    if (result != ATH_OK) work->phase = FAILED;
    return result != ATH_OK || work->phase == DONE ? result : ATH_MORE;
}

int ath_prepare_step(ath_work *work, int32_t steps)
{
    int result = ATH_MORE;
    for (; steps > 0 && result == ATH_MORE; steps--) result = do_step(work);
    return result;
}

/* Returns what the next step costs. The factors are ratios of times that were measured. */
static int32_t cost_of_step(const ath_work *work)
{
    const ath_plan *plan = &work->file->plan;
    int32_t frames = work->segment->frames, cost = 16, p = work->next, n = work->next_node;
    if (work->phase == CHECKSUMS) {
        const ath_chunk *chunk = chunk_to_check(work);
        cost += chunk ? (int32_t)size_to_check(work, chunk) / 8 : 0;
    } else if (work->phase == FRAMES) {
        cost *= ath_min(plan->vertex_count, 1024);
    } else if (work->phase != PIECES || p == plan->piece_count) {
        cost *= frames;
    } else {
        int32_t layers = work->layer - work->first_layer + (work->exact_level.chunk ? 16 : 1);
        if (plan->pieces[p].level <= work->level) cost += plan->pieces[p].count * layers * frames;
        if (n < plan->node_count && plan->nodes[n].piece == p && ath_is_shown(plan->nodes + n, work->level))
            cost += 6 * frames;
    }
    return cost;
}

int ath_prepare_within(ath_work *work, int32_t *cost)
{
    int result = ATH_MORE;
    while (*cost > 0 && result == ATH_MORE) {
        *cost -= cost_of_step(work);
        result = do_step(work);
    }
    return result;
}

int ath_prepare(void *work, size_t work_bytes, const ath_file *file, int32_t segment, int32_t level, void *memory,
                size_t memory_bytes)
{
    int result = ath_prepare_start(work, work_bytes, file, segment, level, memory, memory_bytes);
    if (result == ATH_OK) result = ATH_MORE;
    while (result == ATH_MORE) result = ath_prepare_step((ath_work *)work, INT32_MAX);
    return result;
}

static int is_last_lossy(const ath_file *file, int32_t level) { return level == ath_lossy_levels(file) - 1; }

int ath_goes_on(const ath_file *file, const ath_segment *from, const void *kept, int32_t level)
{
    const kept_head *head = (const kept_head *)kept;
    if (from->level < 0 || from->level >= level || level >= file->info.level_count) return 0;
    if (is_last_lossy(file, from->stage)) return 1;
    return head && head->bytes > 0 && head->segment == from->index && head->level == from->stage;
}

int ath_prepare_onward(void *work, size_t work_bytes, const ath_file *file, const ath_segment *from, const void *kept,
                       int32_t level, void *memory, size_t memory_bytes)
{
    if (!ath_goes_on(file, from, kept, level)) return ATH_BAD_ARGUMENT;
    return start(work, work_bytes, file, from->index, level, memory, memory_bytes, from,
                 is_last_lossy(file, from->stage) ? 0 : kept);
}

void ath_work_fault(const ath_work *work, ath_fault_info *fault) { *fault = work->fault; }
int32_t ath_segment_index(const ath_segment *segment) { return segment->index; }
int32_t ath_segment_level(const ath_segment *segment) { return segment->level; }
