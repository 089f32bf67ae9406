/* The stream at the front of a file (FORMAT.md, "Front stream"): counts, keys and lengths of chunks, announced errors.
 * Compiled once for each direction. */
#ifndef ATH_CONTAINER_FRONT_INL
#define ATH_CONTAINER_FRONT_INL

#include "container/header.h"
#include "bits/numbers.inl"

enum { KNOWN_KINDS = 17, KIND_BITS = 5, SIZE_BITS = 30 };

static const uint16_t known_kinds[KNOWN_KINDS] = {
    ATH_HIERARCHY, ATH_REST,         ATH_TIME,      ATH_METADATA,  ATH_FACES,       ATH_EDGES,
    ATH_CLIPS,     ATH_SOURCE_REST,  ATH_STEMS,     ATH_AFFINES,   ATH_CORRECTIONS, ATH_SHAPES,
    ATH_EXACT,     ATH_REFINED_REST, ATH_PREDICTED, ATH_ATTRIBUTE, ATH_PLACES};

typedef struct {
    ath_context kind[KNOWN_KINDS + 1][1 << KIND_BITS], usual[KNOWN_KINDS + 1]; /* by the kind of the chunk before */
    number_model place, size;
    int32_t bits[KNOWN_KINDS + 1]; /* bits of the last length, by kind */
    int32_t before;                /* index of the kind before; KNOWN_KINDS: unknown */
    int32_t was_motion;
    int32_t stage;
    uint32_t segment;
} chunk_model;

typedef struct {
    number_model number;
    uint32_t mean[2][ATH_MEASURES]; /* magnitudes in 1/16: along a level, and from level to level */
} error_model;

static uint64_t code_raw_bits(ath_coder *coder, int32_t count, uint64_t value)
{
    uint64_t coded = 0;
    while (count-- > 0) coded = coded << 1 | (uint64_t)coder_raw_bit(coder, (int)(value >> count & 1));
    return coded;
}

/* A function, not inlined as in the loops of the motion, since the front is short. */
static uint32_t code_magnitude(ath_coder *coder, number_model *model, uint32_t expected, uint32_t value)
{
    return code_unsigned(coder, model, expected, value);
}

static int32_t code_change(ath_coder *coder, number_model *model, uint32_t expected, int32_t value)
{
    uint32_t magnitude = code_magnitude(coder, model, expected, magnitude_of(value));
    if (magnitude == 0) return 0;
    return coder_raw_bit(coder, value < 0) ? -(int32_t)magnitude : (int32_t)magnitude;
}

static uint32_t code_from(ath_coder *coder, number_model *model, uint32_t least, uint32_t expected, uint32_t value)
{
    return least + code_magnitude(coder, model, expected, value - least);
}

static void code_counts(ath_coder *coder, ath_header *header)
{
    number_model counts;
    ath_context predicted, split;
    uint64_t bits;
    number_model_init(&counts);
    header->place_count = code_from(coder, &counts, 1, 1 << 16, header->place_count);
    uint32_t branches = 2 * clipped((int32_t)header->place_count);
    header->branch_count = code_from(coder, &counts, 1, branches, header->branch_count);
    header->frame_count = code_from(coder, &counts, 1, 1 << 11, header->frame_count);
    header->segment_count = code_from(coder, &counts, 1, header->frame_count / 4, header->segment_count);
    header->full_level_count = (int32_t)code_from(coder, &counts, 1, 64, (uint32_t)header->full_level_count);
    header->level_count =
        header->full_level_count
        - (int32_t)code_from(coder, &counts, 0, 0, (uint32_t)(header->full_level_count - header->level_count));
    header->clip_count = (int32_t)code_from(coder, &counts, 1, 0, (uint32_t)header->clip_count);
    header->layer_count = (int32_t)code_from(coder, &counts, 1, 16, (uint32_t)header->layer_count);
    context_init(&split, 6000);
    if (coder_bit(coder, &split, header->vertex_count > header->place_count))
        header->vertex_count =
            header->place_count + code_from(coder, &counts, 1, 1 << 16, header->vertex_count - header->place_count);
    else
        header->vertex_count = header->place_count;
    header->is_float64 = coder_raw_bit(coder, header->is_float64);
    context_init(&predicted, 6000);
    header->is_predicted = coder_bit(coder, &predicted, header->is_predicted);
    memcpy(&bits, &header->max_error, sizeof bits);
    bits = code_raw_bits(coder, 63, bits);
    memcpy(&header->max_error, &bits, sizeof bits);
}

/* Codes which stages are levels. A decoded stage may be ATH_LEVELS or more, which is too many. */
static void code_stages(ath_coder *coder, ath_header *header)
{
    ath_context skipped;
    context_init(&skipped, 6000);
    for (int32_t level = 0, stage = 0; level < ath_min(header->full_level_count, ATH_LEVELS); level++, stage++) {
        while (stage < ATH_LEVELS && coder_bit(coder, &skipped, stage < header->stages[level])) stage++;
        header->stages[level] = (uint8_t)stage;
    }
}

static void chunk_model_init(chunk_model *model)
{
    for (int32_t i = 0; i <= KNOWN_KINDS; i++) {
        for (int32_t node = 0; node < 1 << KIND_BITS; node++)
            context_init(&model->kind[i][node], node > 1 ? 32768 : 2000);
        context_init(&model->usual[i], 60000);
        model->bits[i] = 8;
    }
    number_model_init(&model->place);
    number_model_init(&model->size);
    model->before = KNOWN_KINDS;
    model->was_motion = model->stage = 0;
    model->segment = 0;
}

static int32_t code_kind(ath_coder *coder, chunk_model *model, uint16_t *kind)
{
    int32_t index = 0, node = 1;
    while (ENCODING && index < KNOWN_KINDS && known_kinds[index] != *kind) index++;
    for (int32_t bit = KIND_BITS - 1; bit >= 0; bit--)
        node = node << 1 | coder_bit(coder, &model->kind[model->before][node], index >> bit & 1);
    index = ath_min(node - (1 << KIND_BITS), KNOWN_KINDS);
    *kind = index < KNOWN_KINDS ? known_kinds[index] : (uint16_t)code_raw_bits(coder, 16, *kind);
    return index;
}

/* Codes stage and segment of a motion chunk. They are usually those of the chunk before, or the next ones if this kind
 * cannot follow there. */
static void code_place(ath_coder *coder, chunk_model *model, uint32_t segment_count, int32_t index, ath_chunk *chunk)
{
    int32_t stage = model->stage, next = model->was_motion && index <= model->before;
    uint32_t segment = model->segment;
    if (next && ++segment >= segment_count) {
        segment = 0;
        stage++;
    }
    int usual = coder_bit(coder, &model->usual[model->before], chunk->stage == stage && chunk->segment == segment);
    if (!usual) {
        stage =
            model->stage + (int32_t)code_magnitude(coder, &model->place, 16, (uint32_t)(chunk->stage - model->stage));
        uint32_t first = stage == model->stage ? model->segment : 0;
        segment = first + code_magnitude(coder, &model->place, 16, chunk->segment - first);
    }
    model->stage = stage;
    model->segment = chunk->segment = segment;
}

/* Codes kind, stage, segment and length. The stage, which may not fit ath_chunk, is left in model->stage. */
static void code_chunk(ath_coder *coder, chunk_model *model, uint32_t segment_count, ath_chunk *chunk)
{
    int32_t index = code_kind(coder, model, &chunk->kind), motion = ath_is_motion(chunk);
    if (motion) code_place(coder, model, segment_count, index, chunk);
    int32_t bits = bit_length(chunk->length), usual = model->bits[index];
    bits = ath_max(0, ath_min(usual + code_change(coder, &model->size, 16, bits - usual), SIZE_BITS));
    chunk->length = bits > 0 ? (uint32_t)code_mantissa(coder, model->size.mantissa[bits - 1], bits, chunk->length) : 0;
    model->bits[index] = bits;
    model->before = index;
    model->was_motion = motion;
}

static void error_model_init(error_model *model)
{
    number_model_init(&model->number);
    for (int32_t i = 0; i < ATH_MEASURES; i++) {
        model->mean[0][i] = 64;
        model->mean[1][i] = 1024;
    }
}

/* Codes the errors of a level in a segment about those before. Returns 0 if a decoded one is out of range. */
static int code_errors(ath_coder *coder, error_model *model, int first_segment, const int32_t *before, int32_t *errors)
{
    uint32_t *mean = model->mean[first_segment];
    int32_t change = 0;
    for (int32_t i = 0; i < ATH_MEASURES; i++) {
        int32_t further = code_change(coder, &model->number, mean[i], errors[i] - before[i] - change);
        mean[i] = averaged(mean[i], further);
        change += further;
        errors[i] = before[i] + change;
        if (errors[i] < 0 || errors[i] >= ATH_SHORT_FLOATS) return 0;
    }
    return 1;
}

typedef struct {
    number_model change;
    ath_context joined[3]; /* by whether the segment before is joined; 2: there is none */
    ath_context sloped[2]; /* by whether the last join is sloped */
    int32_t last;          /* the last join whose width is not 0 */
} join_model;

static void join_model_init(join_model *model)
{
    number_model_init(&model->change);
    for (int32_t i = 0; i < 3; i++) context_init(&model->joined[i], 32768);
    for (int32_t i = 0; i < 2; i++) context_init(&model->sloped[i], 32768);
    model->last = 16;
}

/* Codes how a segment is joined to the one before it. before: how that one is joined; -1: this is the first. Returns -1
 * if the decoded join is out of range. */
static int32_t code_join(ath_coder *coder, join_model *model, int32_t before, int32_t join)
{
    if (!coder_bit(coder, &model->joined[before < 0 ? 2 : before > 0], join > 0)) return 0;
    int32_t width = model->last % ATH_JOIN_SLOPED, sloped = model->last >= ATH_JOIN_SLOPED;
    sloped = coder_bit(coder, &model->sloped[sloped], join >= ATH_JOIN_SLOPED);
    width += code_change(coder, &model->change, 64, join % ATH_JOIN_SLOPED - width);
    model->last = width + ATH_JOIN_SLOPED * sloped;
    return width > 0 && width < ATH_JOIN_SLOPED ? model->last : -1;
}

enum { MOST_SHOWN = 8 };

/* Contexts are chosen by how many frames show the current positions, and how many showed those before. */
typedef struct {
    ath_context repeats[MOST_SHOWN][MOST_SHOWN];
    int32_t shown, before; /* at most MOST_SHOWN */
} repeat_model;

static int code_has_repeats(ath_coder *coder, repeat_model *model, int has_repeats)
{
    ath_context any;
    for (int32_t i = 0; i < MOST_SHOWN * MOST_SHOWN; i++) context_init(&model->repeats[0][0] + i, 32768);
    model->shown = model->before = 1;
    context_init(&any, 1000);
    return coder_bit(coder, &any, has_repeats);
}

static int code_repeat(ath_coder *coder, repeat_model *model, int repeats)
{
    repeats = coder_bit(coder, &model->repeats[model->shown - 1][model->before - 1], repeats);
    if (!repeats) model->before = model->shown;
    model->shown = repeats ? ath_min(model->shown + 1, MOST_SHOWN) : 1;
    return repeats;
}

/* Returns the prediction of the errors of the first level in the first segment. */
static int32_t first_error(double max_error)
{
    uint32_t bits;
    float narrow = (float)max_error;
    memcpy(&bits, &narrow, sizeof bits);
    return ath_min((int32_t)(bits >> ATH_SHORT_SHIFT), ATH_SHORT_FLOATS - 1);
}

#endif
