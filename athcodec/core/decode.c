/* Streams, read: streams.h compiled for decoding. */
#include "streams.h"

size_t ath_model_size(void)
{
    size_t size = sizeof(affine_model);
    if (size < sizeof(hierarchy_model)) size = sizeof(hierarchy_model);
    if (size < sizeof(exact_model)) size = sizeof(exact_model);
    if (size < sizeof(correction_model)) size = sizeof(correction_model);
    return size;
}

static int finished(const ath_coder *coder, int valid) { return valid && coder_finish(coder) ? ATH_OK : ATH_BAD_STREAM; }

/* Marks every value seen by the sign of the entry that it names, and clears the marks. */
static int is_permutation(int32_t count, int32_t *source)
{
    int distinct = 1;
    for (int32_t i = 0; i < count && distinct; i++) {
        int32_t value = source[i] < 0 ? -source[i] - 1 : source[i];
        distinct = source[value] >= 0;
        source[value] = distinct ? -source[value] - 1 : source[value];
    }
    for (int32_t i = 0; i < count; i++)
        if (source[i] < 0) source[i] = -source[i] - 1;
    return distinct;
}

/* Inside the subtree of a whole node there are no nodes, so nothing there may be whole. */
static int whole_are_nodes(const ath_branch *branches, int32_t branch_count)
{
    int32_t inside_until = 0;
    for (int32_t b = 0; b < branch_count; b++) {
        if (!(branches[b].flags & ATH_WHOLE)) continue;
        if (b < inside_until) return 0;
        inside_until = b + branches[b].subtree;
    }
    return 1;
}

int ath_decode_hierarchy(void *model, const uint8_t *bytes, size_t size, int32_t branch_count, int32_t vertex_count,
                         ath_branch *branches, int32_t *branch_source, int32_t *vertex_source)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    int valid = code_hierarchy(&coder, model, branch_count, vertex_count, branches, branch_source, vertex_source);
    valid = valid && is_permutation(branch_count, branch_source) && is_permutation(vertex_count, vertex_source);
    valid = valid && ath_count_pieces(branches, branch_count, vertex_count) > 0;
    valid = valid && whole_are_nodes(branches, branch_count);
    return finished(&coder, valid);
}

int ath_decode_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches, int32_t branch_count,
                    double step, double *rest)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    code_rest(&coder, model, branches, branch_count, step, 0, rest);
    return finished(&coder, 1);
}

int ath_decode_exact_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                          int32_t branch_count, int wide, double *rest)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_exact_rest(&coder, (exact_model *)model, branches, branch_count, wide, rest));
}

int ath_decode_times(void *model, const uint8_t *bytes, size_t size, int32_t frame_count, double *times)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_times(&coder, (exact_model *)model, frame_count, times));
}

int ath_decode_temporal(void *model, const uint8_t *bytes, size_t size, int32_t rank, int32_t frames, int32_t limit,
                        int32_t *basis)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_temporal(&coder, model, rank, frames, limit, basis));
}

int ath_decode_stems(void *model, const uint8_t *bytes, size_t size, const ath_shape *shape, const ath_motion *motion,
                     int32_t level)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_stems(&coder, model, shape, motion, level));
}

int ath_decode_affines(void *model, const uint8_t *bytes, size_t size, const ath_shape *shape, const ath_motion *motion,
                       int32_t level)
{
    ath_coder coder;
    coder_start(&coder, bytes, size);
    return finished(&coder, code_affines(&coder, model, shape, motion, level));
}

static void correct(int32_t v, int32_t frames, int32_t row[][3], double step, int wide, void *positions)
{
    for (int32_t t = 0; t < frames; t++)
        for (int32_t axis = 0; axis < 3; axis++) {
            size_t at = ((size_t)v * 3 + (size_t)axis) * (size_t)frames + (size_t)t;
            if (row[t][axis] == 0) continue;
            if (wide)
                ((double *)positions)[at] = ath_corrected(((double *)positions)[at], row[t][axis], step);
            else
                ((float *)positions)[at] = (float)ath_corrected((double)((float *)positions)[at], row[t][axis], step);
        }
}

int ath_decode_corrections(void *memory, const uint8_t *bytes, size_t size, int32_t vertex_count, int32_t frames,
                           double step, int wide, void *positions)
{
    ath_coder coder;
    correction_model *model = memory;
    int32_t before = 0;
    coder_start(&coder, bytes, size);
    correction_model_init(model);
    for (int32_t v = 0; v < vertex_count; v++) {
        int any = coder_bit(&coder, &model->vertex[before], 0);
        memset(model->row[1], 0, sizeof model->row[1]);
        if (any) {
            code_corrected_frames(&coder, model, frames);
            correct(v, frames, model->row[1], step, wide, positions);
        }
        if (any || before & 1) memcpy(model->row[0], model->row[1], sizeof model->row[0]);
        before = (before << 1 | any) & 3;
    }
    return finished(&coder, 1);
}
