/* The streams of a segment: stems, maps of nodes, corrections. Compiled once for each direction. A call codes one unit,
 * so that a decoder reads all stages side by side, piece by piece. */
#ifndef ATH_STREAMS_MOTION_STREAMS_INL
#define ATH_STREAMS_MOTION_STREAMS_INL

#include "bits/refinements.inl"
#include "model/corrections.h"
#include "model/refine.h"

/* ---- shapes ---- */

typedef struct {
    coefficient_model rows;
    uint32_t history[HISTORY_ROWS * ATH_SHAPE_MODES];
    number_model count;
    int32_t count_before[2]; /* counts of the piece before, by part */
} shape_model;

static void shape_model_init(shape_model *model)
{
    coefficient_model_init(&model->rows, ATH_SHAPE_MODES, model->history);
    number_model_init(&model->count);
    model->count_before[0] = model->count_before[1] = 0;
}

/* Codes the shapes of a piece that the stream of one stage holds: the base stage has the first ones and, if it is full,
 * the piece's own stage the others. integers: ATH_SHAPE_NUMBERS per shape, zero on entry when decoding. count: all
 * shapes when encoding, else those that are known. Returns the new count; -1: it is not valid. */
static int32_t code_shapes(ath_coder *coder, shape_model *model, const ath_piece *piece, int32_t stage, int32_t count,
                           int32_t *integers)
{
    int32_t most = ath_base_shapes(piece), from = 0, part = stage != ath_base_stage(piece), above_count = -1;
    if (part) {
        if (piece->stage != stage || count < most) return count;
        from = most;
        most = 3 * ath_shape_modes(piece);
    }
    int32_t given = ath_min(count, most) - from;
    int32_t own =
        (int32_t)code_unsigned(coder, &model->count, (uint32_t)model->count_before[part] * 16, (uint32_t)given);
    model->count_before[part] = own;
    if (own > most - from) return -1;
    for (int32_t s = from; s < from + own; s++)
        above_count = code_row(coder, &model->rows, ATH_SHAPE_MODES, ath_shape_modes(piece), s, above_count,
                               integers + s * ATH_SHAPE_NUMBERS);
    return model->rows.invalid ? -1 : from + own;
}

typedef struct {
    refinement_model rows;
    uint32_t history[HISTORY_ROWS * ATH_SHAPE_MODES];
    number_model count;
} refined_shape_model;

static void refined_shape_model_init(refined_shape_model *model)
{
    refinement_model_init(&model->rows, ATH_SHAPE_MODES, model->history);
    number_model_init(&model->count);
}

/* Codes all shapes of a piece in a refinement, about those of the layer before, `coarse`, times 2 ^ shift. Returns
 * their number; -1: it is not valid. */
static int32_t code_refined_shapes(ath_coder *coder, refined_shape_model *model, const ath_piece *piece,
                                   int32_t coarse_count, const int32_t *coarse, int32_t shift, int32_t count,
                                   int32_t *integers)
{
    static const int32_t nothing[ATH_SHAPE_NUMBERS] = {0};
    int32_t modes = ath_shape_modes(piece), above_count = -1;
    int32_t own = (int32_t)code_unsigned(coder, &model->count, (uint32_t)coarse_count * 16, (uint32_t)count);
    if (own > 3 * modes) return -1;
    for (int32_t s = 0; s < own; s++) {
        const int32_t *known = s < coarse_count ? coarse + s * ATH_SHAPE_NUMBERS : nothing;
        int32_t predicted[ATH_SHAPE_NUMBERS];
        uint32_t ratio = 1u << shift;
        row_prediction prediction = {predicted, known, 0, ATH_SHAPE_MODES, ATH_SHAPE_MODES, {ratio, ratio, ratio}};
        for (int32_t i = 0; i < ATH_SHAPE_NUMBERS; i++) predicted[i] = shifted(known[i], shift);
        above_count =
            code_refined_row(coder, &model->rows, modes, s, above_count, &prediction, integers + s * ATH_SHAPE_NUMBERS);
    }
    return model->rows.rows.invalid ? -1 : own;
}

/* ---- stems ---- */

static void note_count(const ath_piece_rows *rows, int32_t slot, int32_t count)
{
    if (rows->counts) rows->counts[slot] = count;
}

/* Codes the rows of a piece that the stream of one stage holds. */
static void code_piece(ath_coder *coder, coefficient_model *model, const ath_plan *plan, const ath_stream *stream,
                       int32_t frames, int32_t p, int32_t stage, const ath_piece_rows *rows)
{
    const ath_piece *piece = plan->pieces + p;
    int32_t from = 0, to = 0, above_count = -1, rank = stream->temporal_rank;
    if (stage == ath_base_stage(piece)) {
        if (ath_has_shift(piece))
            note_count(rows, SHIFT_SLOT, code_row(coder, model, frames, rank, SHIFT_SLOT, -1, rows->shift));
        if (ath_has_rotation(plan, piece, stream))
            note_count(rows, ROTATION_SLOT, code_row(coder, model, frames, rank, ROTATION_SLOT, -1, rows->rotation));
    }
    if (piece->low_stage == stage) to = ath_min(piece->low_modes, ath_rank(piece));
    if (piece->stage == stage) {
        from = piece->low_modes;
        to = ath_rank(piece);
    }
    for (int32_t m = from; m < to; m++) {
        if (ath_is_shape_row(piece, rows, m) && 3 * m >= rows->shape_count) continue;
        above_count = code_row(coder, model, frames, rank, m, above_count, ath_row(rows->modes, m, frames));
        note_count(rows, m, above_count);
    }
}

static void note_extent(const ath_piece_rows *rows, int32_t slot, const int32_t *row, int32_t frames, int32_t most)
{
    if (rows->counts) rows->counts[slot] = ath_row_extent(row, frames, most);
}

static void code_refined_track(ath_coder *coder, refinement_model *model, const ath_stream *stream,
                               const ath_motion *motion, int32_t slot, const uint32_t ratios[3],
                               const int32_t *predicted, const int32_t *coarse, const ath_piece_rows *rows,
                               int32_t *row)
{
    row_prediction prediction = {predicted, coarse, 0, motion->frames, rows->reach, {ratios[0], ratios[1], ratios[2]}};
    int32_t count = code_refined_row(coder, model, stream->temporal_rank, slot, -1, &prediction, row);
    note_extent(rows, slot, row, motion->frames, ath_max(count, rows->reach));
}

/* The stream of a refinement holds a piece's tracks first, since the predictions of the modes need the attach frame
 * that the tracks make. */
static void code_refined_tracks(ath_coder *coder, refinement_model *model, const ath_plan *plan,
                                const ath_stream *stream, const ath_motion *motion, const ath_piece *piece,
                                const ath_piece_rows *rows)
{
    uint32_t ratio = (uint32_t)motion->ratio, ratios[3] = {ratio, ratio, ratio};
    if (ath_has_shift(piece))
        code_refined_track(coder, model, stream, motion, SHIFT_SLOT, ratios, rows->predicted_shift, rows->coarse_shift,
                           rows, rows->shift);
    if (ath_has_rotation(plan, piece, stream)) {
        ath_turning turning = ath_turning_of(plan, piece, stream);
        ath_turn_ratios(motion, &turning, rows->coarse_turn_steps, ratios);
        code_refined_track(coder, model, stream, motion, ROTATION_SLOT, ratios, rows->predicted_rotation,
                           rows->coarse_rotation, rows, rows->rotation);
    }
}

static void code_refined_modes(ath_coder *coder, refinement_model *model, const ath_stream *stream,
                               const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows)
{
    int32_t T = motion->frames, above_count = -1;
    uint32_t ratio = (uint32_t)motion->ratio;
    row_prediction prediction = {0, 0, 0, T, 0, {ratio, ratio, ratio}};
    for (int32_t m = 0; m < ath_rank(piece); m++) {
        if (ath_is_shape_row(piece, rows, m) && 3 * m >= rows->shape_count) continue;
        prediction.row = ath_row(rows->predicted_modes, m, T);
        prediction.reach = m < rows->reached_modes ? rows->reach : 0;
        const int32_t *coarse = rows->coarse_modes ? rows->coarse_modes + (size_t)m * 3 * (size_t)T : 0;
        prediction.coarse = coarse;
        prediction.below = m + 1 < ath_rank(piece) ? (coarse ? coarse : prediction.row) + 3 * T : 0;
        above_count = code_refined_row(coder, model, stream->temporal_rank, m, above_count, &prediction,
                                       ath_row(rows->modes, m, T));
        note_extent(rows, m, ath_row(rows->modes, m, T), T, ath_max(above_count, prediction.reach));
    }
}

/* ---- maps of nodes ---- */

typedef struct {
    coefficient_model rows;
    number_model step;
    int32_t step_before;
} affine_model;

static void affine_model_init(affine_model *model, int32_t frames, uint32_t *history)
{
    coefficient_model_init(&model->rows, frames, history);
    number_model_init(&model->step);
    model->step_before = 0;
}

static int code_node(ath_coder *coder, affine_model *model, const ath_plan *plan, int32_t frames, int32_t n,
                     const ath_node_rows *rows)
{
    const ath_node *node = plan->nodes + n;
    int32_t before = model->step_before, above_count = -1;
    int32_t change = code_signed(coder, &model->step, 32, *rows->step - before);
    if (before + change < -200 || before + change > 200) return 0;
    *rows->step = model->step_before = before + change;
    for (int32_t r = 0; r < node->rank; r++)
        above_count = code_row(coder, &model->rows, frames, frames, r, above_count, ath_row(rows->rows, r, frames));
    if (ath_has_shift(plan->pieces + node->piece))
        code_row(coder, &model->rows, frames, frames, SHIFT_SLOT, -1, ath_row(rows->rows, 3, frames));
    return !model->rows.invalid;
}

/* ---- learned bases in waves ---- */

enum { BASIS_AXES = 3 };

typedef struct {
    coefficient_model *rows;
    number_model *steps;
    int32_t step_before, above_count;
} basis_model;

/* Codes up to three rows of a basis as the axes of one row: the exponent of each, as the change from the one before,
 * then the integers. */
static int code_basis_rows(ath_coder *coder, basis_model *model, int32_t frames, int32_t count, int32_t *exponents,
                           int32_t *row)
{
    for (int32_t r = 0; r < count; r++) {
        int32_t before = model->step_before, change = code_signed(coder, model->steps, 32, exponents[r] - before);
        if (before + change < -200 || before + change > 200) return 0;
        exponents[r] = model->step_before = before + change;
    }
    model->above_count = code_row(coder, model->rows, frames, frames, 0, model->above_count, row);
    return !model->rows->invalid;
}

static basis_model basis_model_of(coefficient_model *rows, number_model *steps, int32_t frames, uint32_t *history)
{
    coefficient_model_init(rows, frames, history);
    number_model_init(steps);
    basis_model model = {rows, steps, 0, -1};
    return model;
}

/* ---- corrections ---- */

enum { CORRECTION_BLOCK = 8, CORRECTION_BLOCKS = ATH_SEGMENT_FRAMES / CORRECTION_BLOCK };

/* The corrections of one vertex, with a bit per frame that has one and a byte per block of frames. The bytes before the
 * first block and behind the last one are 0. */
typedef struct {
    ath_correction of[ATH_SEGMENT_FRAMES];
    uint8_t blocks[1 + CORRECTION_BLOCKS + 1];
} correction_row;

typedef struct {
    ath_context vertex[4], block[2][4], frame[3][3][2], zero[2][3], sign[3][3];
    ath_context width[1 + ATH_FOOTPRINTS][ATH_FOOTPRINTS - 1];
    number_model size;
    correction_row row[2]; /* rows of the vertex before and of this one, at `turn` */
    int32_t turn;
    int32_t before; /* a bit for each of the two vertices before: whether it had any */
} correction_model;

static void correction_model_init(correction_model *model)
{
    memset(model, 0, sizeof *model);
    for (int32_t i = 0; i < 4; i++) context_init(&model->vertex[i], i == 0 ? 4000 : 32768);
    for (int32_t i = 0; i < 2; i++)
        for (int32_t j = 0; j < 4; j++) context_init(&model->block[i][j], 8000);
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++)
            for (int32_t k = 0; k < 2; k++) context_init(&model->frame[i][j][k], i || j ? 32768 : 6000);
    for (int32_t i = 0; i < 2; i++)
        for (int32_t j = 0; j < 3; j++) context_init(&model->zero[i][j], 32768);
    for (int32_t i = 0; i < 3; i++)
        for (int32_t j = 0; j < 3; j++) context_init(&model->sign[i][j], 32768);
    for (int32_t i = 0; i <= ATH_FOOTPRINTS; i++)
        for (int32_t j = 0; j < ATH_FOOTPRINTS - 1; j++) context_init(&model->width[i][j], 32768);
    number_model_init(&model->size);
}

ATH_INLINE int has_correction(const correction_row *row, int32_t t)
{
    return row->blocks[(t + CORRECTION_BLOCK) / CORRECTION_BLOCK] >> (t & (CORRECTION_BLOCK - 1)) & 1;
}

static void set_correction(correction_row *row, int32_t t)
{
    uint8_t *block = &row->blocks[1 + t / CORRECTION_BLOCK];
    *block = (uint8_t)(*block | 1u << t % CORRECTION_BLOCK);
}

static void clear_corrections(correction_row *row)
{
    for (int32_t b = 0; b < CORRECTION_BLOCKS; b++) {
        if (row->blocks[1 + b]) memset(row->of + b * CORRECTION_BLOCK, 0, sizeof row->of[0] * CORRECTION_BLOCK);
        row->blocks[1 + b] = 0;
    }
}

/* Codes a vector that is not all 0. `like` is a neighbour, or zeros. */
static void code_correction(ath_coder *coder, correction_model *model, const ath_correction *like, ath_correction *own)
{
    int any = 0, alike = like->q[0] != 0 || like->q[1] != 0 || like->q[2] != 0;
    ath_context *width = model->width[alike ? 1 + like->width : 0];
    int32_t coded = 0;
    while (coded < ATH_FOOTPRINTS - 1 && coder_bit(coder, &width[coded], coded < own->width)) coded++;
    own->width = coded;
    for (int32_t axis = 0; axis < 3; axis++) {
        int32_t sign = like->q[axis] == 0 ? 0 : like->q[axis] < 0 ? 1 : 2;
        int nonzero = axis == 2 && !any;
        if (!nonzero) nonzero = coder_bit(coder, &model->zero[any][sign != 0 ? 1 : alike ? 2 : 0], own->q[axis] != 0);
        if (!nonzero) {
            own->q[axis] = 0;
            continue;
        }
        any = 1;
        int negative = coder_bit(coder, &model->sign[axis][sign], own->q[axis] < 0);
        uint32_t expected = clipped(like->q[axis]) * 16;
        int32_t magnitude = (int32_t)code_unsigned(coder, &model->size, expected, magnitude_of(own->q[axis]) - 1) + 1;
        own->q[axis] = negative ? -magnitude : magnitude;
    }
}

static void code_corrected_frames(ath_coder *coder, correction_model *model, int32_t frames,
                                  const correction_row *above, correction_row *row)
{
    int any = 0, block_before = 0;
    for (int32_t from = 0, b = 1; from < frames; from += CORRECTION_BLOCK, b++) {
        int32_t to = ath_min(from + CORRECTION_BLOCK, frames);
        const uint8_t *blocks = above->blocks + b;
        int beside = (blocks[0] != 0) + 2 * ((blocks[-1] | blocks[0] | blocks[1]) != 0);
        int block =
            to == frames && !any ? 1 : coder_bit(coder, &model->block[block_before][beside], row->blocks[b] != 0);
        int found = 0;
        block_before = block;
        any |= block;
        for (int32_t t = from; block && t < to; t++) {
            int earlier = has_correction(row, t - 1) ? 2 : has_correction(row, t - 2) ? 1 : 0;
            int near = has_correction(above, t)                                      ? 2
                       : has_correction(above, t - 1) | has_correction(above, t + 1) ? 1
                                                                                     : 0;
            int here = t == to - 1 && !found
                           ? 1
                           : coder_bit(coder, &model->frame[earlier][near][found], has_correction(row, t));
            if (!here) continue;
            found = 1;
            code_correction(coder, model, above->of + t, row->of + t);
            set_correction(row, t);
        }
    }
}

/* An encoder fills this row before code_vertex. */
static correction_row *next_row(correction_model *model) { return &model->row[model->turn]; }

/* Codes the corrections of the next vertex. Returns its row, valid until the vertex after it; null: it has none. */
static const correction_row *code_vertex(ath_coder *coder, correction_model *model, int32_t frames, int any)
{
    correction_row *row = next_row(model), *above = &model->row[1 - model->turn];
    any = coder_bit(coder, &model->vertex[model->before], any);
    if (any) code_corrected_frames(coder, model, frames, above, row);
    if (model->before & 1) clear_corrections(above);
    model->before = (model->before << 1 | any) & 3;
    model->turn = 1 - model->turn;
    return any ? row : 0;
}

#ifndef ATH_ENCODING
/* Returns whether corrections may reach the block of frame t. */
ATH_INLINE int is_reached(const correction_row *row, int32_t t)
{
    const uint8_t *blocks = row->blocks + t / CORRECTION_BLOCK;
    return (blocks[0] | blocks[1] | blocks[2]) != 0;
}

/* Sums the corrections in the blocks that they may reach. Other blocks are not written. */
static void correction_parts(const correction_row *row, int32_t frames, ath_corrected_parts parts)
{
    for (int32_t t = 0; t < frames; t += CORRECTION_BLOCK)
        if (is_reached(row, t)) memset(parts + t, 0, CORRECTION_BLOCK * sizeof parts[0]);
    for (int32_t from = 0, b = 1; from < frames; from += CORRECTION_BLOCK, b++)
        for (int32_t bits = row->blocks[b], t = from; bits; bits >>= 1, t++)
            if (bits & 1) ath_add_correction(frames, t, row->of + t, parts);
}
#endif

#endif
