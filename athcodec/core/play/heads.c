/* The second phase: heads of chunks and learned time bases, stage by stage. Streams are ready to be read then. */
#include "play/heads.h"

static ath_bytes bytes_of(const ath_chunk *chunk)
{
    ath_bytes bytes = {chunk->bytes, chunk->length};
    return bytes;
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
    const ath_file *file = work->file;
    size_t number = ath_number_size(segment->is_float64), numbers = 3 * (size_t)file->plan.vertex_count;
    if (file->predicted_trees) memset(segment->positions, 0, (size_t)segment->frames * numbers * number);
    return ath_blame(work, work->predicted,
                     ath_prediction_start(work->prediction, ath_layer_plan(file, work->layer, work->stage),
                                          file->predicted_trees, file->info.origin, segment->frames,
                                          segment->is_float64, bytes_of(work->predicted), segment->positions));
}

/* Opens the streams of one stage. */
int ath_open_stage(ath_work *work)
{
    int32_t d = work->next++, result = ATH_OK;
    if (d > work->stage) {
        const ath_chunk *chunk = work->corrections.chunk;
        if (work->exact_level.chunk) {
            exact_model_init(work->exact_level.model);
            coder_start(&work->exact_level.coder, work->exact_level.chunk->bytes, work->exact_level.chunk->length);
        }
        ath_next_phase(work, work->predicted ? FRAMES : PIECES);
        for (int32_t k = 0; work->keeping.at && k <= work->stage; k++)
            if (ath_has_stream(work->file, k))
                ath_keep_stream(&work->keeping, work->streams + k, work->segment->frames);
        if (work->predicted && (result = open_predicted(work)) != ATH_OK) return result;
        return chunk ? ath_blame(work, chunk, open_corrections(&work->corrections)) : ATH_OK;
    }
    affines_reader *affines = work->affines + d;
    if (affines->chunk) {
        affine_model_init(affines->model, work->segment->frames, affines->history);
        coder_start(&affines->coder, affines->chunk->bytes, affines->chunk->length);
    }
    const ath_chunk *shapes = work->shapes[d].chunk, *stems = work->stems[d].chunk;
    if (shapes && (result = open_shapes(work->shapes + d)) != ATH_OK) return ath_blame(work, shapes, result);
    return stems ? ath_blame(work, stems, open_stems(work, d)) : ATH_OK;
}
