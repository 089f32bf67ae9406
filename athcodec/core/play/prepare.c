/* Decodes the chunks of a segment into positions and maps, phase by phase: checksums (checksums.c), heads of streams
 * (heads.c), predicted frames or pieces (pieces.c, correct.c). If the segment is joined to the one before it, the end of
 * that one is prepared first, in the same memory. */
#include "play/prepare.h"
#include "play/checksums.h"
#include "play/correct.h"
#include "play/heads.h"
#include "play/pieces.h"

/* ---- start ---- */

void ath_watch(ath_work *work, ath_watcher *watcher) { work->asked.watcher = watcher; }
const ath_file *ath_watched_file(const ath_work *work) { return work->file; }
int32_t ath_watched_level(const ath_work *work) { return ath_level_of(&work->file->header, work->asked.stage); }

static int32_t steps_of(const ath_file *file, int32_t segment, int32_t stage)
{
    int32_t checks = 0, heads = stage + 2;
    for (int32_t d = 0; d <= stage; d++)
        for (int32_t kind = ATH_STEMS; kind <= ATH_PREDICTED; kind = ath_kind_after(kind))
            checks += ath_checksum_steps(ath_wanted_chunk(file, segment, stage, kind, d));
    int32_t predictions = ath_predicts(file) && stage > 0
                              ? ath_prediction_steps(file->plan.vertex_count, ath_file_frames(file, segment))
                              : 0;
    return checks + heads + predictions + file->plan.piece_count + 1;
}

int32_t ath_prepare_steps(const ath_file *file, int32_t segment, int32_t level)
{
    int32_t before = ath_joined_to(file, segment, level);
    int32_t stage = ath_file_stage(file, level);
    return steps_of(file, segment, stage) + (before < 0 ? 0 : 1 + steps_of(file, before, stage));
}

/* Returns a chunk of the segment, null if it has none, and notes the first that has not been fed. */
static const ath_chunk *fed_chunk(ath_work *work, int32_t kind, int32_t d)
{
    const ath_chunk *chunk = ath_chunk_of(work, kind, d);
    if (chunk && !chunk->bytes && work->fault.code == ATH_OK)
        ath_refuse_chunk(work, ATH_MISSING, ATH_FIELD_CHUNK_SIZE, chunk, 0, chunk->length);
    return chunk;
}

static int find_chunks(ath_work *work)
{
    int32_t shown = ath_min(work->stage, ath_lossy_stages(work->file) - 1);
    for (int32_t d = 0; d <= work->stage; d++) {
        work->stems[d].chunk = fed_chunk(work, ATH_STEMS, d);
        work->affines[d].chunk = fed_chunk(work, ATH_AFFINES, d);
        work->shapes[d].chunk = fed_chunk(work, ATH_SHAPES, d);
    }
    work->predicted = fed_chunk(work, ATH_PREDICTED, shown);
    work->corrections.chunk = fed_chunk(work, ATH_CORRECTIONS, shown);
    work->exact_level.chunk = fed_chunk(work, ATH_EXACT, work->stage);
    return work->fault.code;
}

static void set_waves(const ath_work *work, ath_stream *stream)
{
    stream->temporal = ath_file_waves(work->file, work->index);
    stream->temporal_rank = work->segment->frames;
    stream->root = ATH_NO_ROOT;
}

static void restore_streams(ath_work *work)
{
    work->kept += sizeof(kept_head);
    for (int32_t d = 0; d < work->first_stage; d++) {
        ath_stream *stream = work->streams + d;
        if (!ath_has_stream(work->file, d)) continue;
        work->kept = ath_kept_stream(work->kept, stream, work->stems[d].temporal, work->segment->frames);
        if (stream->root < 0) set_waves(work, stream);
    }
}

static void ready_layer(ath_work *work, int32_t q)
{
    layer_work *layer = work->layers + q;
    size_t row = 3 * (size_t)work->segment->frames * sizeof(int32_t);
    layer->plan = ath_layer_plan(work->file, q, work->stage);
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
    work->layer = ath_layer_of(work->file, work->stage);
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
    segment->in_source_order = !ath_is_source_order(file);
}

/* Begins to prepare the segment asked for or, for its end, the one before that. */
static int begin(ath_work *work, const preparation *asked, int32_t index, int32_t stage)
{
    const ath_file *file = asked->file;
    ath_segment *segment = (ath_segment *)asked->memory;
    int32_t frames = ath_file_frames(file, index);
    ath_join join = work->join;
    memset(work, 0, sizeof *work);
    memset(segment, 0, sizeof *segment);
    ath_carve_work(work, file, frames, (uint8_t *)work);
    ath_carve_segment(segment, file, ath_level_of(&file->header, stage), frames, asked->is_full, (uint8_t *)segment);
    segment->index = segment->level = segment->stage = -1;
    work->file = file;
    work->segment = segment;
    work->asked = *asked;
    work->only_end = index != asked->index;
    work->index = index;
    work->stage = stage;
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
        work->first_stage = asked->from->stage + 1;
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
    if (stage > file->built_stage || !ath_stage_plan(file, stage)->bases
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
    if (before->index != ath_segment_before(work->file, work->index) || before->stage != work->stage)
        return ATH_BAD_ARGUMENT;
    ath_take_end(&work->join, before);
    work->phase = CHECKSUMS;
    return ATH_OK;
}

int ath_prepare_to(ath_work *work, void *positions)
{
    if (!ath_are_copied(work->file, work->asked.index, ath_level_of(&work->file->header, work->asked.stage)))
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
                 ath_min(asked.stage, ath_lossy_stages(work->file) - 1));
}

static int go_on(ath_work *work)
{
    preparation asked = work->asked;
    ath_take_end(&work->join, work->segment);
    ath_set_join(&work->join, ath_join_at(work->file, asked.index, asked.stage));
    return begin(work, &asked, asked.index, asked.stage);
}

/* ---- steps ---- */

static int do_frames(ath_work *work)
{
    int result = ath_prediction_step(work->prediction);
    if (result == ATH_OK) ath_next_phase(work, PIECES);
    return result == ATH_MORE ? ATH_OK : ath_blame(work, work->predicted, result);
}

static int finish_stream(ath_work *work, const ath_chunk *chunk, const ath_coder *coder)
{
    return ath_blame(work, chunk, !chunk || coder_finish(coder) ? ATH_OK : ATH_BAD_CHUNK);
}

static int finish(ath_work *work)
{
    for (int32_t d = 0; d <= work->stage; d++)
        if (finish_stream(work, work->shapes[d].chunk, &work->shapes[d].coder)
            || finish_stream(work, work->stems[d].chunk, &work->stems[d].coder)
            || finish_stream(work, work->affines[d].chunk, &work->affines[d].coder))
            return ATH_BAD_CHUNK;
    if (work->only_end) return go_on(work);
    if (finish_stream(work, work->corrections.chunk, &work->corrections.coder)
        || finish_stream(work, work->exact_level.chunk, &work->exact_level.coder))
        return ATH_BAD_CHUNK;
    work->segment->index = work->index;
    work->segment->stage = work->stage;
    work->segment->level = ath_level_of(&work->file->header, work->stage);
    ath_cut(work->file, work->segment->level, work->segment->parts);
    if (ath_watcher_of(work))
        ath_watcher_of(work)->done(ath_watcher_of(work), &work->layers[work->layer].motion, work->segment);
    if (work->keeping.at) work->keeps->bytes = (uint64_t)(work->keeping.at - (uint8_t *)work->keeps);
    work->phase = DONE;
    return ATH_OK;
}

static int do_step(ath_work *work)
{
    int result = work->phase == FAILED                       ? ATH_BAD_ARGUMENT
                 : work->phase == DONE                       ? ATH_OK
                 : !work->segment->positions                 ? ATH_NO_MEMORY
                 : work->phase == BEFORE                     ? go_back(work)
                 : work->phase == CHECKSUMS                  ? ath_check_some(work)
                 : work->phase == HEADS                      ? ath_open_stage(work)
                 : work->phase == FRAMES                     ? do_frames(work)
                 : work->next < work->file->plan.piece_count ? ath_do_piece(work)
                                                             : finish(work);
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
        const ath_chunk *chunk = ath_chunk_to_check(work);
        cost += chunk ? (int32_t)ath_size_to_check(work, chunk) / 8 : 0;
    } else if (work->phase == FRAMES) {
        cost *= ath_min(plan->vertex_count, 1024);
    } else if (work->phase != PIECES || p == plan->piece_count) {
        cost *= frames;
    } else {
        int32_t layers = work->layer - work->first_layer + (work->exact_level.chunk ? 16 : 1);
        if (plan->pieces[p].stage <= work->stage) cost += plan->pieces[p].count * layers * frames;
        if (n < plan->node_count && plan->nodes[n].piece == p && ath_is_shown(plan->nodes + n, work->stage))
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

static int is_last_lossy(const ath_file *file, int32_t stage) { return stage == ath_lossy_stages(file) - 1; }

int ath_goes_on(const ath_file *file, const ath_segment *from, const void *kept, int32_t level)
{
    const kept_head *head = (const kept_head *)kept;
    if (from->level < 0 || from->level >= level || level >= file->info.level_count) return 0;
    if (is_last_lossy(file, from->stage)) return 1;
    return head && head->bytes > 0 && head->segment == from->index && head->stage == from->stage;
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
