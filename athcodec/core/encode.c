/* Streams, written: streams.h compiled for encoding. */
#define ATH_ENCODING
#include "streams.h"

/* The size written; -1: no space, -2: the input is not something that the stream can hold. */
static int64_t written(ath_coder *coder, int valid) { return valid ? coder_finish(coder) : -2; }

int64_t ath_encode_hierarchy(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                             int32_t branch_count, int32_t vertex_count, const int32_t *branch_source,
                             const int32_t *vertex_source)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    int valid = code_hierarchy(&coder, model, branch_count, vertex_count, (ath_branch *)branches,
                               (int32_t *)branch_source, (int32_t *)vertex_source);
    ath_count_pieces((ath_branch *)branches, branch_count, vertex_count); /* `subtree` served as memory */
    return written(&coder, valid);
}

int64_t ath_encode_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches, int32_t branch_count,
                        double step, const double *source, double *rest)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    code_rest(&coder, model, branches, branch_count, step, source, rest);
    return coder_finish(&coder);
}

int64_t ath_encode_exact_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                              int32_t branch_count, int wide, const double *rest)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_exact_rest(&coder, (exact_model *)model, branches, branch_count, wide, (double *)rest));
}

int64_t ath_encode_times(void *model, uint8_t *bytes, size_t capacity, int32_t frame_count, const double *times)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_times(&coder, (exact_model *)model, frame_count, (double *)times));
}

int64_t ath_encode_temporal(void *model, uint8_t *bytes, size_t capacity, int32_t rank, int32_t frames,
                            int32_t limit, const int32_t *basis)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_temporal(&coder, model, rank, frames, limit, (int32_t *)basis));
}

int64_t ath_encode_stems(void *model, uint8_t *bytes, size_t capacity, const ath_shape *shape, const ath_motion *motion,
                         int32_t level)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_stems(&coder, model, shape, motion, level));
}

int64_t ath_encode_affines(void *model, uint8_t *bytes, size_t capacity, const ath_shape *shape,
                           const ath_motion *motion, int32_t level)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_affines(&coder, model, shape, motion, level));
}

int64_t ath_encode_corrections(void *memory, uint8_t *bytes, size_t capacity, int32_t vertex_count, int32_t frames,
                               const int32_t *corrections, int64_t count)
{
    ath_coder coder;
    correction_model *model = memory;
    int64_t next = 0;
    int32_t before = 0;
    coder_start(&coder, bytes, capacity);
    correction_model_init(model);
    for (int32_t v = 0; v < vertex_count; v++) {
        int any = next < count && corrections[5 * next] == v;
        coder_bit(&coder, &model->vertex[before], any);
        memset(model->row[1], 0, sizeof model->row[1]);
        for (; next < count && corrections[5 * next] == v; next++)
            memcpy(model->row[1][corrections[5 * next + 1]], corrections + 5 * next + 2, 3 * sizeof(int32_t));
        if (any) code_corrected_frames(&coder, model, frames);
        memcpy(model->row[0], model->row[1], sizeof model->row[0]);
        before = (before << 1 | any) & 3;
    }
    return coder_finish(&coder);
}
