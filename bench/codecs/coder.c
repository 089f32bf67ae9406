/* athcodec's own entropy coder for what the baselines have to store, so that opponents do not lose for
 * want of a good one. Compiled twice, as the core's models are: with ATH_ENCODING it writes, without it
 * reads. Rows of three axes over frequency are coded as stems are (code_row), tables of other integers
 * under the magnitude of their neighbours. Hierarchies, poses and corrections are those of a file: the installed
 * encoder writes them, and what follows reads them with the core's functions. Encoders return the
 * size, -1 (no space) or -2 (not something the stream can hold), decoders 1 or 0 (not valid). */
#include <stdint.h>
#include <stdlib.h>

#include "streams/hierarchy.inl"
#include "streams/motion_streams.inl"
#include "streams/rest.inl"

#ifdef _WIN32
#define BENCH_API __declspec(dllexport)
#else
#define BENCH_API __attribute__((visibility("default")))
#endif

#ifdef ATH_ENCODING
typedef uint8_t *stream_bytes;
static int64_t finish(ath_coder *coder, int valid) { return valid ? coder_finish(coder) : -2; }
#else
typedef const uint8_t *stream_bytes;
static int64_t finish(ath_coder *coder, int valid) { return valid && coder_finish(coder); }
#endif

/* row_count x 3 x frames integers below 2^30, at most ATH_SEGMENT_FRAMES frames. `unit` rows, at most
 * ATH_SLOTS, belong together, each with its own history; 1: every row goes on from the one before. */
BENCH_API int64_t bench_rows(stream_bytes bytes, int64_t size, int32_t row_count, int32_t frames, int32_t unit,
                             int32_t *rows)
{
    if (frames > ATH_SEGMENT_FRAMES || unit < 1 || unit > ATH_SLOTS) return ENCODING ? -2 : 0;
    ath_coder coder;
    coefficient_model *model = malloc(sizeof *model);
    uint32_t *history = malloc(history_size(frames));
    if (!model || !history) abort();
    int32_t above_count = -1;
    coder_start(&coder, bytes, (size_t)size);
    coefficient_model_init(model, frames, history);
    for (int32_t r = 0; r < row_count && !model->invalid; r++) {
        if (unit > 1 && r % unit == 0) above_count = -1;
        int32_t *row = ath_row(rows, r, frames);
        above_count = code_row(&coder, model, frames, frames, r % unit, above_count, row);
    }
    int64_t result = finish(&coder, !model->invalid);
    free(history);
    free(model);
    return result;
}

/* Magnitudes of a table's last two rows, zeros around them, and what is usual in each column, in 1/16. */
typedef struct {
    number_model number;
    uint32_t *above, *own, *usual;
} table_model;

static uint32_t expected_in_table(const table_model *model, int32_t c)
{
    const uint32_t *above = model->above + c, *own = model->own + c;
    uint32_t near = 2 * above[0] + above[-1] + above[1] + 2 * own[-1] + own[-2];
    return (2 * near + 3 * model->usual[c]) / 4;
}

static void code_table_row(ath_coder *coder, table_model *model, int32_t columns, int32_t *row)
{
    for (int32_t c = 0; c < columns; c++) {
        row[c] = code_signed(coder, &model->number, expected_in_table(model, c), row[c]);
        uint32_t magnitude = clipped(row[c]);
        model->own[c] = magnitude;
        model->usual[c] = model->usual[c] - (model->usual[c] + 3) / 4 + magnitude * 4;
    }
    uint32_t *turned = model->above;
    model->above = model->own;
    model->own = turned;
}

/* A table of integers below 2^30, each under the magnitudes near it and those usual in its column. */
BENCH_API int64_t bench_table(stream_bytes bytes, int64_t size, int32_t row_count, int32_t columns, int32_t *table)
{
    ath_coder coder;
    table_model *model = malloc(sizeof *model);
    size_t width = (size_t)columns + 3;
    uint32_t *memory = calloc(3 * width, sizeof *memory);
    if (!model || !memory) abort();
    number_model_init(&model->number);
    model->above = memory + 2;
    model->own = memory + width + 2;
    model->usual = memory + 2 * width + 2;
    for (int32_t c = 0; c < columns; c++) model->usual[c] = 32;
    coder_start(&coder, bytes, (size_t)size);
    for (int32_t r = 0; r < row_count; r++) code_table_row(&coder, model, columns, table + (size_t)r * (size_t)columns);
    free(memory);
    free(model);
    return finish(&coder, 1);
}

#ifndef ATH_ENCODING
BENCH_API int64_t bench_hierarchy(stream_bytes bytes, int64_t size, int32_t branch_count, int32_t vertex_count,
                                  ath_branch *branches, int32_t *branch_source, int32_t *vertex_source)
{
    ath_coder coder;
    hierarchy_model *model = malloc(sizeof *model);
    if (!model) abort();
    coder_start(&coder, bytes, (size_t)size);
    int valid = code_hierarchy(&coder, model, branch_count, vertex_count, branches, branch_source, vertex_source);
    free(model);
    return finish(&coder, valid);
}

/* The pose that athcodec's encoder writes for these branches, vertex_count x 3. */
BENCH_API int64_t bench_pose(stream_bytes bytes, int64_t size, const ath_branch *branches, int32_t branch_count,
                             double step, double *pose)
{
    ath_coder coder;
    rest_model *model = malloc(sizeof *model);
    if (!model) abort();
    model->layer = (rest_layer){.branches = branches, .branch_count = branch_count, .step = step, .rest = pose};
    coder_start(&coder, bytes, (size_t)size);
    start_rest(&coder, model);
    int valid = code_rest(&coder, model, NULL, NULL);
    free(model);
    return finish(&coder, valid);
}

/* Adds the corrections of `frames` frames to positions, vertex_count x 3 x stride. */
BENCH_API int64_t bench_corrections(stream_bytes bytes, int64_t size, int32_t vertex_count, int32_t frames, double step,
                                    int32_t stride, float *positions)
{
    ath_coder coder;
    correction_model *model = malloc(sizeof *model);
    if (!model) abort();
    coder_start(&coder, bytes, (size_t)size);
    correction_model_init(model);
    for (int32_t v = 0; v < vertex_count; v++) {
        const correction_row *row = code_vertex(&coder, model, frames, 0);
        if (!row) continue;
        ath_corrected_parts parts;
        correction_parts(row, frames, parts);
        for (size_t axis = 0; axis < 3; axis++)
            for (int32_t t = 0; t < frames; t++) {
                float *at = positions + ((size_t)v * 3 + axis) * (size_t)stride + t;
                if (is_reached(row, t) && parts[t][axis] != 0.0)
                    *at = (float)ath_corrected((double)*at, parts[t][axis], step);
            }
    }
    free(model);
    return finish(&coder, 1);
}
#endif
