/* The PREDICTED chunk of a segment (FORMAT.md, "Predicted motion"): frame by frame, each vertex is coded about a
 * prediction from decoded ones. Compiled once for each direction. */
#ifndef ATH_STREAMS_PREDICTED_INL
#define ATH_STREAMS_PREDICTED_INL

#include "container/container.h"
#include "bits/numbers.inl"
#include "model/plan.h"

enum { FRONT_GUESS = 6, OTHER_FRONT, GUESSES };
enum { RUNS = 8 };

/* The state of a vertex from frame to frame. */
typedef struct {
    double error[GUESSES];
    int32_t steps[3];      /* the last integers that were not all 0 */
    uint32_t size[2];      /* sums of the integers' magnitudes in the last two frames */
    int32_t before;        /* the vertex that this one follows; -1: none */
    int32_t base;          /* attach vertex, or first vertex, of the stem; -1: this is that vertex */
    int32_t near;          /* the vertex whose errors and integers are likely to be similar; -1: none */
    int32_t tip;           /* the last vertex of the stem; -1: this is an end */
    int32_t earlier, next; /* neighbours in the order of coding; -1: none */
    double along;          /* length of the stem at rest, from its base to this vertex */
    /* The rest is for the last vertex of a stem. */
    double reach[2];         /* how far its front had got along that length in the last two frames */
    int32_t front[2];        /* the first vertex that the front had not passed */
    int32_t leads, followed; /* whether others lie between the ends, and FOLLOW_NONE or how they follow */
} predicted_vertex;

/* How the vertices between the ends of a stem follow these: all of them as at rest, scaled; all of them, those that the
 * front has passed as at rest and the others at the tip; or only those others. */
enum { FOLLOW_NONE, FOLLOW_ENDS, FOLLOW_FRONT, FOLLOW_TIP, FOLLOW_CODES };

typedef struct {
    number_model numbers, distance;
    ath_context moved[4][4][3], sign[3][3], copied[RUNS][RUNS], usual[2];
    ath_context followed[FOLLOW_CODES - 1][FOLLOW_CODES][FOLLOW_CODES];
    int32_t run, last_run, last_distance, last_followed;
    double advance; /* how far the front of the last stem under way got in a frame */
} predicted_model;

/* Positions of the frames around the current one, less the origin, vertex_count x 3 each. */
typedef struct {
    const double *rest;
    const double *was[2]; /* the frame that this one is coded about, and the frame that that is coded about */
    double *now;
} predicted_frames;

/* Predicted ways of a vertex from its position in the frame that this one is coded about. */
typedef struct {
    double guess[GUESSES][3], way[3];
} predicted_way;

static void predicted_model_init(predicted_model *model)
{
    memset(model, 0, sizeof *model);
    number_model_init(&model->numbers);
    number_model_init(&model->distance);
    for (int32_t own = 0; own < 4; own++)
        for (int32_t near = 0; near < 4; near++)
            for (int32_t beside = 0; beside < 3; beside++)
                context_init(&model->moved[own][near][beside], own + near == 0 ? 6000 : 32768);
    for (int32_t near = 0; near < 3; near++)
        for (int32_t own = 0; own < 3; own++) context_init(&model->sign[near][own], 32768);
    for (int32_t run = 0; run < RUNS; run++)
        for (int32_t last = 0; last < RUNS; last++) context_init(&model->copied[run][last], 6000);
    for (int32_t copied = 0; copied < 2; copied++) context_init(&model->usual[copied], 60000);
    for (int32_t i = 0; i < (FOLLOW_CODES - 1) * FOLLOW_CODES * FOLLOW_CODES; i++)
        context_init(&model->followed[0][0][0] + i, 32768);
    model->last_distance = 1;
}

/* Codes whether a frame is a copy, and how many frames before it the frame is that it copies or is coded about. Returns
 * 0 if there is no such frame. */
ATH_INLINE int code_reference(ath_coder *coder, predicted_model *model, int32_t frame, int *copied, int32_t *distance)
{
    int32_t run = ath_min(model->run, RUNS - 1), last = ath_min(model->last_run, RUNS - 1);
    *copied = coder_bit(coder, &model->copied[run][last], *copied);
    int usual = coder_bit(coder, &model->usual[*copied], *distance == model->last_distance);
    if (usual)
        *distance = model->last_distance;
    else
        *distance = (int32_t)code_unsigned(coder, &model->distance, 64, (uint32_t)(*distance - 1)) + 1;
    if (*distance > frame + 1) return 0;
    model->last_distance = *distance;
    if (*copied) {
        model->run++;
    } else {
        model->last_run = model->run;
        model->run = 0;
    }
    return 1;
}

ATH_INLINE int is_number(double x) { return x - x == 0.0; }
ATH_INLINE double absolute(double x) { return x < 0.0 ? -x : x; }

/* Returns the extent of two vertices along their rest edge, over its length; near 1 if the step is longer. */
ATH_INLINE double grown(const double *rest, const double *now, int32_t from, int32_t to, double step)
{
    double along = step * step, length2 = along;
    if (from < 0 || to < 0) return 1.0;
    size_t p = 3 * (size_t)from, u = 3 * (size_t)to;
    for (size_t k = 0; k < 3; k++) {
        double edge = rest[u + k] - rest[p + k];
        along = along + edge * (now[u + k] - now[p + k]);
        length2 = length2 + edge * edge;
    }
    return length2 > 1e-60 ? along / length2 : 1.0;
}

/* Returns the scale of a stem from its ends or, for an end, extrapolates it from the frames before, up to that at rest. */
ATH_INLINE double stem_scale(const predicted_frames *frames, const predicted_vertex *vertex, int32_t v, double step)
{
    if (vertex->tip >= 0) return grown(frames->rest, frames->now, vertex->base, vertex->tip, step);
    double was = grown(frames->rest, frames->was[0], vertex->base, v, step);
    double will = was + (was - grown(frames->rest, frames->was[1], vertex->base, v, step));
    return was < 1.0 && will > 1.0 ? 1.0 : will;
}

/* Returns the first vertex of a stem after its base. */
ATH_INLINE int32_t stem_start(const predicted_vertex *vertices, int32_t tip)
{
    return vertices[tip].leads ? vertices[tip].next : tip;
}

/* Finds the point of a stem at rest that is nearest to its tip. */
static void learn_front(predicted_model *model, predicted_vertex *vertices, const predicted_frames *frames, int32_t tip)
{
    predicted_vertex *vertex = vertices + tip;
    const double *rest = frames->rest;
    int32_t base = vertex->base, from = base;
    if (base < 0) return;
    size_t b = 3 * (size_t)base;
    double tip_way[3], least = 0.0, start = 0.0;
    for (size_t k = 0; k < 3; k++) tip_way[k] = frames->now[3 * (size_t)tip + k] - frames->now[b + k];
    vertex->front[1] = vertex->front[0];
    vertex->reach[1] = vertex->reach[0];
    for (int32_t to = stem_start(vertices, tip); to <= tip; from = to++) {
        size_t u = 3 * (size_t)from, v = 3 * (size_t)to;
        double edge[3], way[3], dot = 0.0, length2 = 0.0, off2 = 0.0;
        for (size_t k = 0; k < 3; k++) {
            edge[k] = rest[v + k] - rest[u + k];
            way[k] = tip_way[k] - (rest[u + k] - rest[b + k]);
            dot = dot + edge[k] * way[k];
            length2 = length2 + edge[k] * edge[k];
        }
        double part = dot > 0.0 ? dot < length2 ? dot / length2 : 1.0 : 0.0;
        for (size_t k = 0; k < 3; k++) {
            double off = way[k] - part * edge[k];
            off2 = off2 + off * off;
        }
        if (from == base || off2 < least) {
            least = off2;
            vertex->reach[0] = start + part * (vertices[to].along - start);
            vertex->front[0] = to;
        }
        start = vertices[to].along;
    }
    double advance = vertex->reach[0] - vertex->reach[1];
    if (vertex->reach[1] > 0.0 && vertex->reach[0] < vertex->along) model->advance = advance;
}

/* Guesses that the tip of a stem has moved along the stem at rest, up to a length. */
static void guess_tip(const predicted_vertex *vertices, const predicted_frames *frames, int32_t tip, double reach,
                      double guess[3])
{
    const double *rest = frames->rest;
    int32_t base = vertices[tip].base, from = base, to = stem_start(vertices, tip);
    double start = 0.0;
    for (; to < tip && !(vertices[to].along >= reach); from = to++) start = vertices[to].along;
    double left = reach - start, length = vertices[to].along - start;
    double part = left > 0.0 ? left < length ? left / length : 1.0 : 0.0;
    size_t b = 3 * (size_t)base, u = 3 * (size_t)from, v = 3 * (size_t)to;
    for (size_t k = 0; k < 3; k++)
        guess[k] = (frames->now[b + k] - frames->was[0][3 * (size_t)tip + k])
                   + ((rest[u + k] - rest[b + k]) + part * (rest[v + k] - rest[u + k]));
}

/* Guesses where the front of a stem, which has been found for other vertices than the tip, moves a vertex. */
static void guess_front(const predicted_model *model, const predicted_vertex *vertices, const predicted_frames *frames,
                        int32_t v, predicted_way *p)
{
    const predicted_vertex *vertex = vertices + v;
    double *guess = p->guess[FRONT_GUESS], *other = p->guess[OTHER_FRONT];
    if (vertex->base < 0) {
        memset(guess, 0, sizeof p->guess[0]);
    } else if (vertex->tip < 0) {
        const predicted_vertex *base = vertices + vertex->base, *below = base->tip < 0 ? base : vertices + base->tip;
        double reach = vertex->reach[0], started = below->reach[0] - base->along;
        guess_tip(vertices, frames, v, reach + (reach - vertex->reach[1]), guess);
        guess_tip(vertices, frames, v, reach > 0.0 ? reach + model->advance : started, other);
        return;
    } else {
        size_t at = 3 * (size_t)v, t = 3 * (size_t)vertex->tip, u = 3 * (size_t)vertex->before;
        const double *now = frames->now, *was = frames->was[0];
        const int32_t *front = vertices[vertex->tip].front;
        for (size_t k = 0; k < 3; k++)
            guess[k] = v >= front[0]  ? now[t + k] - was[at + k]
                       : v < front[1] ? now[u + k] - was[u + k]
                                      : (now[u + k] - was[at + k]) + (frames->rest[at + k] - frames->rest[u + k]);
    }
    memcpy(other, guess, sizeof p->guess[0]);
}

ATH_INLINE void guess_axis(const predicted_vertex *vertex, const predicted_frames *frames, size_t v, size_t k,
                           double scale, predicted_way *p)
{
    const double *now = frames->now, *was = frames->was[0], *was2 = frames->was[1];
    size_t at = 3 * v + k;
    double x = was[at], before = 0.0, before2 = 0.0, joined = 0.0, stem = 0.0, waits = 0.0;
    if (vertex->before >= 0) {
        size_t u = 3 * (size_t)vertex->before + k;
        before = now[u] - was[u];
        before2 = was[u] - was2[u];
        joined = now[u] - x;
    }
    if (vertex->base >= 0) {
        size_t u = 3 * (size_t)vertex->base + k;
        stem = (now[u] - x) + scale * (frames->rest[at] - frames->rest[u]);
        waits = frames->rest[u] - x;
    }
    double guesses[FRONT_GUESS] = {0.0, before, (x - was2[at]) + (before - before2), joined, stem, waits};
    for (int32_t i = 0; i < FRONT_GUESS; i++) p->guess[i][k] = guesses[i];
}

static void predict_vertex(const predicted_model *model, double step, const predicted_vertex *vertices,
                           const predicted_frames *frames, int32_t v, predicted_way *p)
{
    const predicted_vertex *vertex = vertices + v, *near = vertex->near >= 0 ? vertices + vertex->near : 0;
    double best = 0.0, scale = stem_scale(frames, vertex, v, step);
    int32_t chosen = 0;
    for (size_t k = 0; k < 3; k++) guess_axis(vertex, frames, (size_t)v, k, scale, p);
    guess_front(model, vertices, frames, v, p);
    for (int32_t i = 0; i < GUESSES; i++) {
        double error = vertex->error[i];
        if (near) error = error + 2.0 * near->error[i];
        if (i == 0 || error < best) {
            best = error;
            chosen = i;
        }
    }
    for (size_t k = 0; k < 3; k++) p->way[k] = is_number(p->guess[chosen][k]) ? p->guess[chosen][k] : 0.0;
}

static void learn_vertex(predicted_model *model, predicted_vertex *vertices, const predicted_frames *frames, int32_t v,
                         const predicted_way *p)
{
    predicted_vertex *vertex = vertices + v;
    const double *x = frames->now + 3 * (size_t)v, *was = frames->was[0] + 3 * (size_t)v;
    double way[3];
    for (size_t k = 0; k < 3; k++) way[k] = x[k] - was[k];
    for (int32_t i = 0; i < GUESSES; i++) {
        double error =
            absolute(way[0] - p->guess[i][0]) + absolute(way[1] - p->guess[i][1]) + absolute(way[2] - p->guess[i][2]);
        vertex->error[i] = 0.5 * vertex->error[i] + error;
    }
    if (vertex->tip < 0) learn_front(model, vertices, frames, v);
}

ATH_INLINE int32_t size_class(uint32_t size) { return size == 0 ? 0 : size < 2 ? 1 : size < 6 ? 2 : 3; }

/* Returns the expected magnitude of a vertex's integers in 1/16. near, beside: sizes of other vertices. */
ATH_INLINE uint32_t expected_size(const predicted_vertex *vertices, int32_t v, uint32_t *near, uint32_t *beside)
{
    const predicted_vertex *vertex = vertices + v;
    *near = vertex->near >= 0 ? vertices[vertex->near].size[0] : 0;
    *beside = vertex->earlier >= 0 ? vertices[vertex->earlier].size[0] : 0;
    if (vertex->before >= 0 && vertices[vertex->before].size[0] > *beside) *beside = vertices[vertex->before].size[0];
    return (2 * vertex->size[0] + vertex->size[1] + 2 * *near + *beside) * 8 / 9;
}

ATH_INLINE int32_t sign_class(int32_t steps) { return steps < 0 ? 0 : steps > 0 ? 2 : 1; }

ATH_INLINE void code_steps(ath_coder *coder, predicted_model *model, predicted_vertex *vertices, int32_t v,
                           int32_t steps[3])
{
    static const int32_t none[3] = {0, 0, 0};
    predicted_vertex *vertex = vertices + v;
    const int32_t *signs = vertex->near >= 0 ? vertices[vertex->near].steps : none;
    uint32_t near, beside, sum = 0, expected = expected_size(vertices, v, &near, &beside);
    int32_t own = size_class(vertex->size[0] + vertex->size[1] / 2), louder = (beside > 0) + (beside > 3);
    ath_context *moved = &model->moved[own][size_class(near)][louder];
    if (coder_bit(coder, moved, steps[0] || steps[1] || steps[2])) {
        for (int32_t k = 0; k < 3; k++) {
            uint32_t about = k == 0 ? expected : (2 * expected + sum * 16 / (uint32_t)k) / 3;
            ath_context *sign = &model->sign[sign_class(signs[k])][sign_class(vertex->steps[k])];
            steps[k] = code_signed_in_class(coder, &model->numbers, number_class(about), sign, steps[k]);
            sum += clipped(steps[k]);
        }
        memcpy(vertex->steps, steps, sizeof vertex->steps);
    } else {
        steps[0] = steps[1] = steps[2] = 0;
    }
    vertex->size[1] = vertex->size[0];
    vertex->size[0] = sum;
}

/* Codes how the vertices between the ends of a stem follow these. */
ATH_INLINE void code_followed(ath_coder *coder, predicted_model *model, predicted_vertex *tip, int followed)
{
    int32_t old = tip->followed, last = model->last_followed, value = 0;
    while (value < FOLLOW_CODES - 1 && coder_bit(coder, &model->followed[value][old][last], followed > value)) value++;
    tip->followed = value;
    model->last_followed = tip->followed;
}

/* Returns the size of the table of vertices by rest position, a power of two. */
ATH_INLINE uint32_t twin_places(int32_t vertex_count)
{
    uint32_t places = 16;
    while (places < 2 * (uint32_t)vertex_count) places *= 2;
    return places;
}

/* Puts a vertex into the table. Returns the vertex that was in its cell before; -1: none. */
static int32_t take_place(const double *rest, int32_t *last, uint32_t places, double width, int32_t v)
{
    int32_t cell[3], same = 1;
    for (size_t k = 0; k < 3; k++) cell[k] = steps_in(rest[3 * (size_t)v + k], width, 0.5);
    uint32_t hash = (uint32_t)cell[0] * 73856093u + (uint32_t)cell[1] * 19349663u + (uint32_t)cell[2] * 83492791u;
    int32_t *place = last + ((hash ^ hash >> 15) & (places - 1)), before = *place;
    *place = v;
    if (before < 0) return -1;
    for (size_t k = 0; k < 3; k++) same = same && steps_in(rest[3 * (size_t)before + k], width, 0.5) == cell[k];
    return same ? before : -1;
}

enum { AROUND = 3 };

/* The state of a segment. positions: the output, frames x vertex_count x 3, float or (is_float64) double. */
typedef struct {
    predicted_model model;
    double step;
    predicted_vertex *vertices;
    double *memory[AROUND];
    int32_t *last; /* vertices by cell */
    const double *rest, *origin;
    void *positions;
    int32_t is_float64, vertex_count, coded_count, first, frame; /* first of coded_count vertices that are coded */
    int32_t about[ATH_SEGMENT_FRAMES]; /* the frame that each frame was coded about; -1: the rest pose */
    predicted_frames around;
} prediction;

static uint64_t carve_prediction(prediction *p, int32_t vertex_count, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t vertices = (uint64_t)vertex_count;
    ath_take(&arena, sizeof *p);
    p->vertices = (predicted_vertex *)ath_take(&arena, vertices * sizeof(predicted_vertex));
    for (int32_t i = 0; i < AROUND; i++) p->memory[i] = (double *)ath_take(&arena, vertices * 3 * sizeof(double));
    p->last = (int32_t *)ath_take(&arena, twin_places(vertex_count) * sizeof(int32_t));
    return arena.used;
}

/* Measures the lengths along a stem at rest. */
static void measure_stem(prediction *p, int32_t base, int32_t tip)
{
    double along = 0.0;
    for (int32_t from = base, to = stem_start(p->vertices, tip); to <= tip; from = to++) {
        double length2 = 0.0;
        for (size_t k = 0; k < 3; k++) {
            double edge = p->rest[3 * (size_t)to + k] - p->rest[3 * (size_t)from + k];
            length2 = length2 + edge * edge;
        }
        along = along + ath_sqrt(length2);
        p->vertices[to].along = along;
    }
}

/* Sets the order of coding: stems in file order, and of each stem first its ends, which are the last vertex and, on a
 * root, the first. A vertex follows the one before it; the first and the last vertex follow the attach vertex. */
/* Puts the vertices in the order of coding: those of all trees, or of loose ones alone. */
static void follow_stems(prediction *p, const ath_branch *branches, int32_t branch_count, int loose_alone)
{
    int32_t tip_before = -1, first_before = -1, earlier = -1, is_coded = 1;
    p->first = -1;
    p->coded_count = 0;
    for (int32_t b = 0; b < branch_count; b++) {
        const ath_branch *branch = branches + b;
        if (branch->parent < 0) is_coded = !loose_alone || branch->flags & ATH_LOOSE;
        if (!is_coded) continue;
        if (p->first < 0) p->first = branch->first;
        p->coded_count += branch->count;
        int32_t first = branch->first, tip = first + branch->count - 1;
        int32_t ends = branch->attach < 0 && tip > first ? 2 : 1, base = ends == 2 ? first : branch->attach;
        for (int32_t i = 0; i < branch->count; i++) {
            int32_t v = i == ends - 1 ? tip : i < ends ? first : first + i - 1;
            predicted_vertex *vertex = p->vertices + v;
            vertex->before = v == first ? branch->attach : i < ends ? base : v - 1;
            vertex->near = i < ends ? tip_before : v == first ? first_before : v - 1;
            vertex->tip = i < ends ? -1 : tip;
            vertex->base = v == base ? -1 : base;
            vertex->earlier = earlier;
            vertex->next = -1;
            if (earlier >= 0) p->vertices[earlier].next = v;
            earlier = v;
        }
        p->vertices[tip].leads = branch->count > ends;
        if (base >= 0) measure_stem(p, base, tip);
        tip_before = tip;
        if (branch->count > 1) first_before = first;
    }
}

/* A vertex at the rest position of an earlier one follows that, unless the vertex that it follows lies there, too. */
static void follow_twins(prediction *p)
{
    double width = p->step * 0.00390625;
    uint32_t places = twin_places(p->coded_count);
    for (uint32_t i = 0; i < places; i++) p->last[i] = -1;
    for (int32_t v = p->first; v >= 0; v = p->vertices[v].next) {
        predicted_vertex *vertex = p->vertices + v;
        int32_t twin = take_place(p->rest, p->last, places, width, v), joined = vertex->before >= 0;
        for (size_t k = 0; k < 3 && joined; k++)
            joined = steps_in(p->rest[3 * (size_t)vertex->before + k], width, 0.5)
                     == steps_in(p->rest[3 * (size_t)v + k], width, 0.5);
        if (twin >= 0 && !joined) vertex->before = vertex->near = twin;
    }
}

/* loose_alone: whether the trees of loose roots alone are predicted; others stay as they are in `positions`. */
static void start_prediction(prediction *p, const ath_plan *plan, int loose_alone, const double *origin, int is_float64,
                             void *positions)
{
    p->rest = plan->rest;
    p->origin = origin;
    p->positions = positions;
    p->is_float64 = is_float64;
    p->vertex_count = plan->vertex_count;
    predicted_model_init(&p->model);
    p->frame = 0;
    memset(p->vertices, 0, (size_t)p->vertex_count * sizeof *p->vertices);
    follow_stems(p, plan->branches, plan->branch_count, loose_alone);
    follow_twins(p);
}

/* Returns the positions of a frame; the rest pose for negative ones. */
static const double *known_frame(const prediction *p, int32_t frame, double *memory)
{
    size_t numbers = 3 * (size_t)p->vertex_count, at = numbers * (size_t)ath_max(frame, 0);
    if (frame < 0) return p->rest;
    for (size_t i = 0; i < numbers; i++)
        memory[i] = ath_number_at(p->positions, at + i, p->is_float64) - p->origin[i % 3];
    return memory;
}

static void put_out(const prediction *p, size_t at, size_t k, double x)
{
    ath_put_number(p->positions, at + k, p->is_float64, x + p->origin[k]);
}

ATH_INLINE double put_back(const prediction *p, size_t at, size_t k)
{
    return ath_number_at(p->positions, at + k, p->is_float64) - p->origin[k];
}

static void copy_frame(prediction *p, int32_t from)
{
    size_t numbers = 3 * (size_t)p->vertex_count, at = numbers * (size_t)p->frame;
    size_t number = ath_number_size(p->is_float64);
    uint8_t *positions = (uint8_t *)p->positions;
    if (from >= 0) {
        memcpy(positions + at * number, positions + numbers * (size_t)from * number, numbers * number);
        return;
    }
    for (size_t i = 0; i < numbers; i++) put_out(p, at + i - i % 3, i % 3, p->rest[i]);
}

static int32_t about(const prediction *p, int32_t frame) { return frame < 0 ? -1 : p->about[frame]; }

/* Codes what a frame is coded about; 0: it is not valid. A copied frame has no coded vertices. */
static int start_frame(ath_coder *coder, prediction *p, int *copied, int32_t distance)
{
    if (!code_reference(coder, &p->model, p->frame, copied, &distance)) return 0;
    int32_t from = p->frame - distance;
    p->about[p->frame] = *copied ? about(p, from) : from;
    if (*copied) {
        copy_frame(p, from);
        return 1;
    }
    for (int32_t i = 0; i < 2; i++, from = about(p, from)) p->around.was[i] = known_frame(p, from, p->memory[i]);
    p->around.rest = p->rest;
    p->around.now = p->memory[2];
    return 1;
}

/* Puts a vertex, moved by its steps, into the output and into `now`. */
static void place_vertex(prediction *p, int32_t v, const predicted_way *way, const int32_t steps[3])
{
    size_t from = 3 * (size_t)v, at = 3 * (size_t)p->vertex_count * (size_t)p->frame + from;
    for (size_t k = 0; k < 3; k++) {
        put_out(p, at, k, p->around.was[0][from + k] + way->way[k] + (double)steps[k] * p->step);
        p->around.now[from + k] = put_back(p, at, k);
    }
}

ATH_INLINE int follows(const prediction *p, int32_t v)
{
    int32_t tip = p->vertices[v].tip;
    if (tip < 0 || p->vertices[tip].followed == FOLLOW_NONE) return 0;
    return p->vertices[tip].followed != FOLLOW_TIP || v >= p->vertices[tip].front[0];
}

/* Places a vertex between the ends of its stem as it is at rest or, if the front has not passed it, at the tip. */
static void follow_ends(prediction *p, int32_t v, double scale, int32_t followed)
{
    int32_t tip = p->vertices[v].tip;
    size_t from = 3 * (size_t)v, u = 3 * (size_t)p->vertices[v].base, t = 3 * (size_t)tip;
    size_t at = 3 * (size_t)p->vertex_count * (size_t)p->frame + from;
    int waits = followed != FOLLOW_ENDS && v >= p->vertices[tip].front[0];
    for (size_t k = 0; k < 3; k++) {
        double x = p->around.now[u + k] + scale * (p->rest[from + k] - p->rest[u + k]);
        if (waits) x = p->around.now[t + k];
        put_out(p, at, k, is_number(x) ? x : p->around.was[0][from + k]);
        p->around.now[from + k] = put_back(p, at, k);
    }
}

/* Returns the scale of a stem whose other vertices follow its ends. */
static double scale_of(const prediction *p, int32_t tip, int32_t followed)
{
    if (followed != FOLLOW_ENDS) return 1.0;
    return grown(p->rest, p->around.now, p->vertices[tip].base, tip, p->step);
}

static void follow(prediction *p, int32_t v)
{
    predicted_vertex *vertex = p->vertices + v;
    int32_t followed = p->vertices[vertex->tip].followed;
    follow_ends(p, v, scale_of(p, vertex->tip, followed), followed);
    vertex->size[1] = vertex->size[0];
    vertex->size[0] = 0;
}

#endif
