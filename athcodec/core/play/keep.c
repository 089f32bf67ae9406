/* Integers are kept in bytes of seven bits, low bits first, with the sign below them. */
#include "play/keep.h"

enum { KEPT_NUMBER = 5 }; /* bytes of the longest number */

/* An ath_stream. The waves of a learned basis follow, temporal_rank x frames floats, which hold them exactly. */
typedef struct {
    double step, rotation_step_factor, turn_step;
    int32_t temporal_rank, root;
} kept_stream;

static size_t row_most(int32_t frames) { return KEPT_NUMBER * (1 + 3 * (size_t)frames); }

int ath_can_be_kept(const ath_file *file, int32_t stage)
{
    return stage > file->plan.height && stage < ath_min(file->header.stage_count, ath_lossy_stages(file)) - 1;
}

size_t ath_keep_size(const ath_file *file, int32_t level)
{
    const ath_plan *plan = &file->plan;
    int32_t stage = ath_file_stage(file, level);
    if (!ath_can_be_kept(file, stage)) return 0;
    uint64_t T = (uint64_t)file->longest, pieces = (uint64_t)plan->piece_count, size = sizeof(kept_head);
    size += ((uint64_t)plan->vertex_count + 2 * pieces) * row_most(file->longest) + pieces * KEPT_NUMBER;
    for (int32_t d = 0; d <= stage; d++) {
        if (!ath_has_stream(file, d)) continue;
        size += sizeof(kept_stream) + T * T * sizeof(float);
        if (ath_file_chunk(file, ATH_SHAPES, d, 0)) size += pieces * ATH_MOST_SHAPES * row_most(ATH_SHAPE_MODES);
    }
    return ath_size_or_most(size);
}

size_t ath_kept_size(const void *kept) { return (size_t)((const kept_head *)kept)->bytes; }

/* Returns where the next `size` bytes go; null: nowhere. */
static void *take(kept_writer *to, size_t size)
{
    uint8_t *at = to->at && (size_t)(to->end - to->at) >= size ? to->at : 0;
    to->at = at ? at + size : 0;
    return at;
}

static uint8_t *put_kept(uint8_t *at, int32_t number)
{
    uint32_t left = (uint32_t)number << 1 ^ (number < 0 ? 0xffffffffu : 0);
    for (; left > 127; left >>= 7) *at++ = (uint8_t)(left | 128);
    *at++ = (uint8_t)left;
    return at;
}

/* Three axes of `frames` integers, of which those from `count` on are 0. */
static void keep_row(kept_writer *to, const int32_t *row, int32_t frames, int32_t count)
{
    uint8_t *at = (uint8_t *)take(to, row_most(count));
    if (!at) return;
    at = put_kept(at, count);
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < count; k++) at = put_kept(at, row[axis * frames + k]);
    to->at = at;
}

static size_t learned_numbers(const ath_stream *stream, int32_t frames)
{
    return stream->root < 0 ? 0 : (size_t)stream->temporal_rank * (size_t)frames;
}

void ath_keep_stream(kept_writer *to, const ath_stream *stream, int32_t frames)
{
    kept_stream kept = {stream->step, stream->rotation_step_factor, stream->turn_step, stream->temporal_rank,
                        stream->root};
    size_t learned = learned_numbers(stream, frames);
    uint8_t *at = (uint8_t *)take(to, sizeof kept + learned * sizeof(float));
    if (!at) return;
    memcpy(at, &kept, sizeof kept);
    float *waves = (float *)(void *)(at + sizeof kept);
    for (size_t i = 0; i < learned; i++) waves[i] = (float)stream->temporal[i];
}

void ath_keep_piece(kept_writer *to, const ath_piece *piece, const ath_piece_rows *rows, const int32_t *shape_integers,
                    int32_t frames)
{
    uint8_t *at = (uint8_t *)take(to, KEPT_NUMBER);
    if (at) to->at = put_kept(at, rows->shape_count);
    for (int32_t s = 0; s < rows->shape_count; s++)
        keep_row(to, shape_integers + s * ATH_SHAPE_NUMBERS, ATH_SHAPE_MODES, ATH_SHAPE_MODES);
    keep_row(to, rows->shift, frames, rows->counts[SHIFT_SLOT]);
    keep_row(to, rows->rotation, frames, rows->counts[ROTATION_SLOT]);
    for (int32_t m = 0; m < piece->count; m++) keep_row(to, ath_row(rows->modes, m, frames), frames, rows->counts[m]);
}

static const uint8_t *kept_number(const uint8_t *at, int32_t *number)
{
    uint32_t bits = *at & 127;
    for (int32_t shift = 7; *at++ > 127; shift += 7) bits |= (uint32_t)(*at & 127) << shift;
    *number = (int32_t)(bits >> 1) ^ -(int32_t)(bits & 1);
    return at;
}

static const uint8_t *kept_row(const uint8_t *at, int32_t *row, int32_t frames, int32_t *count)
{
    at = kept_number(at, count);
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < *count; k++) at = kept_number(at, row + axis * frames + k);
    return at;
}

const uint8_t *ath_kept_stream(const uint8_t *at, ath_stream *stream, double *learned, int32_t frames)
{
    kept_stream kept;
    memcpy(&kept, at, sizeof kept);
    stream->step = kept.step;
    stream->rotation_step_factor = kept.rotation_step_factor;
    stream->turn_step = kept.turn_step;
    stream->temporal_rank = kept.temporal_rank;
    stream->root = kept.root;
    size_t count = learned_numbers(stream, frames);
    const float *waves = (const float *)(const void *)(at + sizeof kept);
    for (size_t i = 0; i < count; i++) learned[i] = (double)waves[i];
    if (count > 0) stream->temporal = learned;
    return at + sizeof kept + count * sizeof *waves;
}

const uint8_t *ath_kept_piece(const uint8_t *at, const ath_piece *piece, ath_piece_rows *rows, int32_t *shape_integers,
                              double *unit_shapes, int32_t frames)
{
    int32_t count;
    at = kept_number(at, &rows->shape_count);
    for (int32_t s = 0; s < rows->shape_count; s++)
        at = kept_row(at, shape_integers + s * ATH_SHAPE_NUMBERS, ATH_SHAPE_MODES, &count);
    ath_unit_shapes(rows->shape_count, shape_integers, unit_shapes);
    at = kept_row(at, rows->shift, frames, rows->counts + SHIFT_SLOT);
    at = kept_row(at, rows->rotation, frames, rows->counts + ROTATION_SLOT);
    for (int32_t m = 0; m < piece->count; m++)
        at = kept_row(at, ath_row(rows->modes, m, frames), frames, rows->counts + m);
    return at;
}
