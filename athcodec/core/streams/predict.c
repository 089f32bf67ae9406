/* Predicted motion, compiled for decoding. */
#include "streams/predict.h"
#include "streams/predicted.inl"

enum { STEP_VERTICES = 1024 };

struct ath_prediction {
    prediction segment; /* its arrays follow this struct */
    ath_coder coder;
    int32_t frames, vertex; /* vertex: how many vertices of the frame are decoded */
    int32_t next;           /* the vertex that comes next */
};

static uint64_t carve_all(ath_prediction *p, int32_t vertex_count, uint8_t *base)
{
    ath_arena arena = {base, 0};
    ath_take(&arena, sizeof *p);
    return arena.used + carve_prediction(&p->segment, vertex_count, base ? base + arena.used : 0);
}

uint64_t ath_prediction_size(int32_t vertex_count)
{
    ath_prediction counted;
    return carve_all(&counted, vertex_count, 0);
}

int ath_prediction_start(ath_prediction *p, const ath_plan *plan, int loose_alone, const double *origin, int32_t frames,
                         int is_float64, ath_bytes chunk, void *positions)
{
    prediction *segment = &p->segment;
    ath_bytes body;
    carve_all(p, plan->vertex_count, (uint8_t *)p);
    if (ath_parse_stepped(chunk, &segment->step, &body) != ATH_OK) return ATH_BAD_CHUNK;
    start_prediction(segment, plan, loose_alone, origin, is_float64, positions);
    coder_start(&p->coder, body.bytes, body.size);
    p->frames = frames;
    p->vertex = 0;
    return ATH_OK;
}

int32_t ath_prediction_steps(int32_t vertex_count, int32_t frames)
{
    int64_t steps = (int64_t)frames * ((vertex_count - 1) / STEP_VERTICES + 1);
    return steps < INT32_MAX / 2 ? (int32_t)steps : INT32_MAX / 2;
}

static void decode_vertex(ath_coder *coder, prediction *p, int32_t v)
{
    predicted_way way;
    int32_t steps[3] = {0, 0, 0};
    if (follows(p, v)) {
        follow(p, v);
        return;
    }
    predict_vertex(&p->model, p->step, p->vertices, &p->around, v, &way);
    code_steps(coder, &p->model, p->vertices, v, steps);
    place_vertex(p, v, &way, steps);
    learn_vertex(&p->model, p->vertices, &p->around, v, &way);
    if (p->vertices[v].leads) code_followed(coder, &p->model, p->vertices + v, 0);
}

int ath_prediction_step(ath_prediction *p)
{
    prediction *segment = &p->segment;
    int copied = 0;
    if (p->vertex == 0 && !start_frame(&p->coder, segment, &copied, 0)) return ATH_BAD_CHUNK;
    int32_t count = segment->coded_count, stop = copied ? count : ath_min(p->vertex + STEP_VERTICES, count);
    ath_coder coder = p->coder;
    if (p->vertex == 0) p->next = segment->first;
    for (int32_t i = p->vertex; !copied && i < stop; i++) {
        decode_vertex(&coder, segment, p->next);
        p->next = segment->vertices[p->next].next;
    }
    p->coder = coder;
    p->vertex = stop;
    if (stop < count) return ATH_MORE;
    p->vertex = 0;
    if (++segment->frame < p->frames) return ATH_MORE;
    return coder_finish(&p->coder) ? ATH_OK : ATH_BAD_CHUNK;
}
