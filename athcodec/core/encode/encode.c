/* All streams, compiled for encoding. */
#define ATH_ENCODING
#include "encode/encode.h"
#include "streams/polygons.inl"
#include "container/front.inl"
#include "streams/motion_streams.inl"
#include "streams/predicted.inl"
#include "streams/hierarchy.inl"
#include "streams/rest_exact.inl"
#include "streams/series.inl"
#include "streams/source_rest.inl"

static void copy_pose(const ath_branch *branches, int32_t branch_count, const double *pose, double *copy)
{
    const ath_branch *last = branches + branch_count - 1;
    memcpy(copy, pose, 3 * (size_t)(last->first + last->count) * sizeof *copy);
}

/* Returns the size written; -1: there is no space; -2: the stream cannot hold the input. */
static int64_t written(ath_coder *coder, int valid) { return valid ? coder_finish(coder) : -2; }

int64_t ath_encode_front(uint8_t *bytes, size_t capacity, const ath_header *header, const ath_chunk *chunks,
                         const int32_t *errors, const uint8_t *joins, const uint8_t *repeats)
{
    ath_coder coder;
    chunk_model keys;
    join_model widths;
    repeat_model shown;
    error_model table;
    ath_header counts = *header;
    int32_t first[ATH_MEASURES];
    const int32_t *last = first;
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    code_counts(&coder, &counts);
    code_stages(&coder, &counts);
    chunk_model_init(&keys);
    for (uint32_t i = 0; i < header->chunk_count; i++) {
        ath_chunk chunk = chunks[i];
        code_chunk(&coder, &keys, header->segment_count, &chunk);
    }
    error_model_init(&table);
    for (int32_t i = 0; i < ATH_MEASURES; i++) first[i] = first_error(header->max_error);
    for (int32_t level = 0; level < header->level_count; level++) {
        const int32_t *before = last;
        last = errors;
        for (uint32_t segment = 0; segment < header->segment_count; segment++) {
            int32_t entry[ATH_MEASURES];
            memcpy(entry, errors, sizeof entry);
            valid = valid && code_errors(&coder, &table, segment == 0, before, entry);
            before = errors;
            errors += ATH_MEASURES;
        }
    }
    join_model_init(&widths);
    for (int32_t level = 0; header->segment_count > 1 && level < header->level_count; level++)
        for (uint32_t segment = 0; segment < header->segment_count; segment++, joins++)
            valid = valid && code_join(&coder, &widths, segment > 0 ? joins[-1] : -1, *joins) >= 0;
    code_has_repeats(&coder, &shown, repeats != 0);
    for (uint32_t i = 1; repeats && i < header->frame_count; i++) code_repeat(&coder, &shown, repeats[i]);
    return written(&coder, valid);
}

int64_t ath_encode_hierarchy(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                             int32_t branch_count, int32_t vertex_count, const int32_t *branch_source,
                             const int32_t *vertex_source)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    int valid = code_hierarchy(&coder, (hierarchy_model *)model, branch_count, vertex_count, (ath_branch *)branches,
                               (int32_t *)branch_source, (int32_t *)vertex_source);
    ath_count_pieces((ath_branch *)branches, branch_count,
                     vertex_count); /* restores `subtree`, which served as scratch memory */
    return written(&coder, valid);
}

int64_t ath_encode_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches, int32_t branch_count,
                        double step, double slack, ath_mesh *mesh, const int32_t *coarse, const double *before,
                        const int32_t *shape_of, int32_t *steps, const double *source, double *moved, double *rest)
{
    ath_coder coder;
    rest_layer layer = {branches, branch_count, step, rest, coarse, before, steps, mesh, slack, moved, shape_of};
    copy_pose(branches, branch_count, source, moved);
    coder_start(&coder, bytes, capacity);
    ((rest_model *)model)->layer = layer;
    start_rest(&coder, (rest_model *)model);
    return written(&coder, code_rest(&coder, (rest_model *)model, source, 0));
}

int32_t ath_find_copies(const ath_branch *branches, int32_t branch_count, const double *pose, double step, double slack,
                        int32_t *uses, int32_t *shape_of)
{
    int32_t recent[REST_SHAPES], count = 0, copies = 0;
    memset(uses, 0, (size_t)branch_count * sizeof *uses);
    for (int32_t b = 0; b < branch_count; b++) {
        const ath_branch *branch = branches + b;
        double unit = LATTICE_UNIT * rest_step(branch, step), tolerance = copy_tolerance(branch, unit, slack);
        int32_t found = -1;
        shape_of[b] = -1;
        if (branch->count < 2) continue;
        for (int32_t i = 0; i < count && found < 0; i++) {
            const ath_branch *shape = branches + recent[i];
            if (shape->count == branch->count && looks_like_copy(shape, branch, pose, tolerance)) found = i;
        }
        if (found < 0) {
            if (count < REST_SHAPES) count++;
            found = count - 1;
            recent[found] = b;
        }
        int32_t shape = recent[found];
        memmove(recent + 1, recent, (size_t)found * sizeof *recent);
        recent[0] = shape;
        shape_of[b] = shape;
        uses[shape] += shape != b;
    }
    for (int32_t b = 0; b < branch_count; b++) {
        if (shape_of[b] >= 0 && uses[shape_of[b]] < LEAST_COPIES) shape_of[b] = -1;
        copies += shape_of[b] >= 0 && shape_of[b] != b;
    }
    return copies;
}

int64_t ath_encode_source_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                               int32_t branch_count, double step, const double *reference, const double *source,
                               double *moved, double *turns, double *rest)
{
    ath_coder coder;
    bent_pose pose = {reference, source, moved, rest, turns, step};
    copy_pose(branches, branch_count, source, moved);
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_source_rest(&coder, (rest_model *)model, &pose, branches, branch_count));
}

int64_t ath_encode_exact_rest(void *model, uint8_t *bytes, size_t capacity, const ath_branch *branches,
                              int32_t branch_count, const ath_mesh *mesh, int is_float64, const double *rest)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_exact_rest(&coder, (exact_model *)model, branches, branch_count, mesh, is_float64,
                                           (double *)rest));
}

int64_t ath_encode_faces(void *memory, uint8_t *bytes, size_t capacity, const ath_polygons *shape, int32_t vertex_count,
                         const int32_t *places, int32_t place_count, const uint32_t *counts, const int32_t *corners,
                         int has_sides)
{
    faces_model *model = (faces_model *)memory;
    start_faces(model, shape, vertex_count, places, place_count, (uint32_t *)counts, (int32_t *)corners);
    model->list.has_no_sides = !has_sides;
    coder_start(&model->coder, bytes, capacity);
    return written(&model->coder, code_faces(model, 0));
}

int64_t ath_encode_places(void *memory, uint8_t *bytes, size_t capacity, uint32_t columns, int32_t vertex_count,
                          int32_t place_count, const int32_t *places)
{
    faces_model *model = (faces_model *)memory;
    ath_polygons shape;
    start_places(model, &shape, columns, vertex_count, place_count, (int32_t *)places);
    coder_start(&model->coder, bytes, capacity);
    return written(&model->coder, code_faces(model, 0));
}

int64_t ath_encode_times(void *model, uint8_t *bytes, size_t capacity, int32_t frame_count, const double *times)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_times(&coder, (exact_model *)model, frame_count, (double *)times));
}

int64_t ath_encode_temporal(void *model, uint8_t *bytes, size_t capacity, int32_t rank, int32_t frames,
                            const int32_t *basis)
{
    ath_coder coder;
    coder_start(&coder, bytes, capacity);
    return written(&coder, code_temporal(&coder, (number_model *)model, rank, frames, (int32_t *)basis));
}

int64_t ath_encode_basis(void *memory, uint8_t *bytes, size_t capacity, int32_t rank, int32_t frames,
                         int32_t *exponents, int32_t *integers)
{
    ath_coder coder;
    coefficient_model *rows = (coefficient_model *)memory;
    number_model steps;
    basis_model model = basis_model_of(rows, &steps, frames, (uint32_t *)(rows + 1));
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    for (int32_t r = 0; r < rank && valid; r += BASIS_AXES)
        valid = code_basis_rows(&coder, &model, frames, ath_min(rank - r, BASIS_AXES), exponents + r,
                                integers + (size_t)r * (size_t)frames);
    return written(&coder, valid);
}

int64_t ath_encode_shapes(void *memory, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                          const int32_t *shape_counts, const int64_t *shape_first, int32_t *integers, int32_t stage)
{
    ath_coder coder;
    shape_model *model = (shape_model *)memory;
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    shape_model_init(model);
    for (int32_t p = 0; p < plan->piece_count && valid; p++)
        valid = code_shapes(&coder, model, plan->pieces + p, stage, shape_counts[p],
                            integers + shape_first[p] * ATH_SHAPE_NUMBERS)
                >= 0;
    return written(&coder, valid);
}

int64_t ath_encode_refined_shapes(void *memory, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                                  const int32_t *shape_counts, const int64_t *shape_first, int32_t *integers,
                                  const int32_t *coarse_counts, const int64_t *coarse_first, const int32_t *coarse,
                                  int32_t shift)
{
    ath_coder coder;
    refined_shape_model *model = (refined_shape_model *)memory;
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    refined_shape_model_init(model);
    for (int32_t p = 0; p < plan->piece_count && valid; p++)
        valid = code_refined_shapes(&coder, model, plan->pieces + p, coarse_counts ? coarse_counts[p] : 0,
                                    coarse_counts ? coarse + coarse_first[p] * ATH_SHAPE_NUMBERS : 0, shift,
                                    shape_counts[p], integers + shape_first[p] * ATH_SHAPE_NUMBERS)
                >= 0;
    return written(&coder, valid);
}

int64_t ath_encode_exact(void *memory, uint8_t *bytes, size_t capacity, int32_t vertex_count, int32_t frames,
                         int is_float64, const void *positions, const void *source)
{
    ath_coder coder;
    exact_model *model = (exact_model *)memory;
    int32_t length[3] = {0, 0, 0};
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    exact_model_init(model);
    for (size_t v = 0; v < (size_t)vertex_count; v++)
        for (size_t t = 0; t < (size_t)frames && valid; t++) {
            double known[3], number[3];
            for (size_t k = 0; k < 3; k++) {
                size_t at = (v * 3 + k) * (size_t)frames + t;
                known[k] = ath_number_at(positions, at, is_float64);
                number[k] = ath_number_at(source, at, is_float64);
            }
            valid = code_exact_point(&coder, model, is_float64, known, length, number);
        }
    return written(&coder, valid);
}

int64_t ath_encode_stems(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan, const ath_motion *motion,
                         const ath_integers *integers, int32_t stage)
{
    ath_coder coder;
    coefficient_model *rows = (coefficient_model *)model;
    coder_start(&coder, bytes, capacity);
    coefficient_model_init(rows, motion->frames, (uint32_t *)(rows + 1));
    for (int32_t p = 0; p < plan->piece_count; p++) {
        ath_piece_rows piece = ath_rows_of_piece(integers, motion->frames, p);
        code_piece(&coder, rows, plan, motion->streams + stage, motion->frames, p, stage, &piece);
    }
    return written(&coder, !rows->invalid);
}

int64_t ath_encode_refinement(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan,
                              const ath_motion *motion, const ath_integers *integers, int32_t stage)
{
    ath_coder coder;
    refinement_model *rows = (refinement_model *)model;
    coder_start(&coder, bytes, capacity);
    refinement_model_init(rows, motion->frames, (uint32_t *)(rows + 1));
    for (int32_t p = 0; p < plan->piece_count; p++) {
        ath_piece_rows piece = ath_rows_of_piece(integers, motion->frames, p);
        ath_coarse_rows(motion, p, &piece);
        code_refined_tracks(&coder, rows, plan, motion->streams + stage, motion, plan->pieces + p, &piece);
        code_refined_modes(&coder, rows, motion->streams + stage, motion, plan->pieces + p, &piece);
    }
    return written(&coder, !rows->rows.invalid);
}

int64_t ath_encode_affines(void *model, uint8_t *bytes, size_t capacity, const ath_plan *plan, const ath_motion *motion,
                           const ath_integers *integers, int32_t stage)
{
    ath_coder coder;
    affine_model *maps = (affine_model *)model;
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    affine_model_init(maps, motion->frames, (uint32_t *)(maps + 1));
    for (int32_t n = 0; n < plan->node_count && valid; n++) {
        ath_node_rows node = ath_rows_of_node(integers, motion->frames, n);
        if (plan->nodes[n].coded && plan->nodes[n].stage == stage)
            valid = code_node(&coder, maps, plan, motion->frames, n, &node);
    }
    return written(&coder, valid);
}

int64_t ath_encode_corrections(void *memory, uint8_t *bytes, size_t capacity, int32_t vertex_count, int32_t frames,
                               const int32_t *corrections, int64_t count)
{
    ath_coder coder;
    correction_model *model = (correction_model *)memory;
    int64_t next = 0;
    coder_start(&coder, bytes, capacity);
    correction_model_init(model);
    for (int32_t v = 0; v < vertex_count; v++) {
        int64_t first = next;
        correction_row *row = next_row(model);
        for (; next < count && corrections[ATH_CORRECTION_ROW * next] == v; next++) {
            const int32_t *given = corrections + ATH_CORRECTION_ROW * next;
            memcpy(row->of + given[1], given + 2, sizeof row->of[0]);
            set_correction(row, given[1]);
        }
        code_vertex(&coder, model, frames, next > first);
    }
    return coder_finish(&coder);
}

/* The input: source positions less the origin, vertex-major with `stride` numbers from row to row, and the limit of each
 * vertex. A few frames at a time are put side by side in `block`. */
typedef struct {
    const double *source, *limits;
    int64_t stride;
    int32_t frames, block_frames;
    double *block;       /* block_frames x vertex_count x 3 */
    const double *frame; /* the one that is coded */
} predicted_source;

enum { LOOKED_AT = 32 }; /* sampled vertices that tell which frames are similar */

static void open_frame(const prediction *p, predicted_source *source)
{
    size_t rows = 3 * (size_t)p->vertex_count;
    int32_t number = p->frame % source->block_frames, count = ath_min(source->block_frames, source->frames - p->frame);
    source->frame = source->block + (size_t)number * rows;
    if (number > 0) return;
    for (size_t row = 0; row < rows; row++)
        for (int32_t t = 0; t < count; t++)
            source->block[(size_t)t * rows + row] =
                source->source[row * (size_t)source->stride + (size_t)(p->frame + t)];
}

/* Returns a coordinate of the rest pose as a copied frame gets it, less the origin. */
static double put_back_rest(const prediction *p, size_t at, size_t k)
{
    double x = p->rest[at] + p->origin[k];
    return (p->is_float64 ? x : (double)(float)x) - p->origin[k];
}

/* Returns the squared distance of a vertex from its position in an earlier frame. */
static double way2_from(const prediction *p, const predicted_source *source, int32_t frame, int32_t v)
{
    const double *wanted = source->frame + 3 * (size_t)v;
    size_t from = 3 * (size_t)v, at = 3 * (size_t)p->vertex_count * (size_t)ath_max(frame, 0) + from;
    double way2 = 0.0;
    for (size_t k = 0; k < 3; k++) {
        double off = (frame < 0 ? put_back_rest(p, from + k, k) : put_back(p, at, k)) - wanted[k];
        way2 = way2 + off * off;
    }
    return way2;
}

static int is_within(const prediction *p, const predicted_source *source, int32_t frame, int32_t v)
{
    return way2_from(p, source, frame, v) <= source->limits[v] * source->limits[v];
}

static int is_copy(const prediction *p, const predicted_source *source, int32_t frame)
{
    int32_t stride = p->vertex_count / LOOKED_AT + 1;
    for (int32_t v = 0; v < p->vertex_count; v += stride)
        if (!is_within(p, source, frame, v)) return 0;
    for (int32_t v = 0; v < p->vertex_count; v++)
        if (!is_within(p, source, frame, v)) return 0;
    return 1;
}

static double unlike(const prediction *p, const predicted_source *source, int32_t frame)
{
    double sum = 0.0;
    int32_t stride = p->vertex_count / LOOKED_AT + 1;
    for (int32_t v = 0; v < p->vertex_count; v += stride) sum = sum + ath_sqrt(way2_from(p, source, frame, v));
    return sum;
}

/* Returns how many frames ago the frame was that this one copies or, if much more similar than the last, resembles. */
static int32_t find_reference(const prediction *p, const predicted_source *source, int *copied)
{
    int32_t last = p->model.last_distance, best = 1;
    *copied = 1;
    if (last <= p->frame + 1 && is_copy(p, source, p->frame - last)) return last;
    double least = 0.0;
    for (int32_t distance = 1; distance <= p->frame + 1; distance++) {
        if (is_copy(p, source, p->frame - distance)) return distance;
        double now = unlike(p, source, p->frame - distance);
        if (distance == 1) least = 0.25 * now;
        if (now < least) {
            least = now;
            best = distance;
        }
    }
    *copied = 0;
    return best;
}

/* Moves steps towards 0 while the vertex stays within its limit, those that move it least first. */
static void shorten(const double left[3], double limit2, int32_t steps[3])
{
    for (;;) {
        double best = limit2;
        int32_t axis = -1;
        for (int32_t k = 0; k < 3; k++) {
            double off2 = 0.0;
            if (steps[k] == 0) continue;
            for (int32_t i = 0; i < 3; i++) {
                double off = left[i] - (double)(steps[i] - (i != k ? 0 : steps[k] > 0 ? 1 : -1));
                off2 = off2 + off * off;
            }
            if (off2 < best) {
                best = off2;
                axis = k;
            }
        }
        if (axis < 0) return;
        steps[axis] -= steps[axis] > 0 ? 1 : -1;
    }
}

static void nearest_point(const double left[3], int32_t steps[3])
{
    for (size_t k = 0; k < 3; k++) steps[k] = steps_in(left[k], 1.0, 0.5);
}

/* Finds the smallest integers that keep a vertex within its limit. left: distance from the prediction, in steps. */
static void cheapest_point(const double left[3], double limit, int32_t steps[3])
{
    steps[0] = steps[1] = steps[2] = 0;
    if (left[0] * left[0] + left[1] * left[1] + left[2] * left[2] < limit * limit) return;
    nearest_point(left, steps);
    shorten(left, limit * limit, steps);
}

/* Returns 0 if no integers keep the vertex within its limit. */
static int choose_steps(prediction *p, const predicted_source *source, int32_t v, const predicted_way *way,
                        int32_t steps[3])
{
    const double *wanted = source->frame + 3 * (size_t)v, *was = p->around.was[0] + 3 * (size_t)v;
    double left[3];
    for (size_t k = 0; k < 3; k++) {
        left[k] = (wanted[k] - (was[k] + way->way[k])) / p->step;
        if (!(absolute(left[k]) < 1073741820.0)) return 0;
    }
    cheapest_point(left, source->limits[v] / p->step, steps);
    place_vertex(p, v, way, steps);
    if (is_within(p, source, p->frame, v)) return 1;
    nearest_point(left, steps);
    place_vertex(p, v, way, steps);
    return is_within(p, source, p->frame, v);
}

/* Returns whether the vertices that would follow the ends of a stem keep their limits. */
static int may_follow(prediction *p, const predicted_source *source, int32_t tip, int32_t followed)
{
    double scale = scale_of(p, tip, followed);
    for (int32_t v = p->vertices[tip].next; v >= 0 && p->vertices[v].tip == tip; v = p->vertices[v].next) {
        if (followed == FOLLOW_TIP && v < p->vertices[tip].front[0]) continue;
        follow_ends(p, v, scale, followed);
        if (!is_within(p, source, p->frame, v)) return 0;
    }
    return 1;
}

/* Returns how the other vertices of a stem can follow its ends, preferably as before. */
static int32_t choose_following(prediction *p, const predicted_source *source, int32_t tip)
{
    const predicted_vertex *vertex = p->vertices + tip;
    int32_t before = vertex->followed != FOLLOW_NONE ? vertex->followed : p->model.last_followed;
    int32_t first = before == FOLLOW_FRONT ? FOLLOW_FRONT : FOLLOW_ENDS, second = FOLLOW_ENDS + FOLLOW_FRONT - first;
    if (may_follow(p, source, tip, first)) return first;
    if (may_follow(p, source, tip, second)) return second;
    return vertex->front[0] < tip && may_follow(p, source, tip, FOLLOW_TIP) ? FOLLOW_TIP : FOLLOW_NONE;
}

/* Returns 0 if no integers keep the vertex within its limit. */
static int encode_vertex(ath_coder *coder, prediction *p, const predicted_source *source, int32_t v)
{
    predicted_vertex *vertex = p->vertices + v;
    predicted_way way;
    int32_t steps[3];
    if (follows(p, v)) {
        follow(p, v);
        return 1;
    }
    predict_vertex(&p->model, p->step, p->vertices, &p->around, v, &way);
    if (!choose_steps(p, source, v, &way, steps)) return 0;
    code_steps(coder, &p->model, p->vertices, v, steps);
    learn_vertex(&p->model, p->vertices, &p->around, v, &way);
    if (vertex->leads) code_followed(coder, &p->model, vertex, choose_following(p, source, v));
    return 1;
}

static int encode_frame(ath_coder *coder, prediction *p, predicted_source *source)
{
    int copied, valid = 1;
    open_frame(p, source);
    int32_t distance = find_reference(p, source, &copied);
    if (!start_frame(coder, p, &copied, distance)) return 0;
    for (int32_t v = 0; !copied && valid && v >= 0; v = p->vertices[v].next) valid = encode_vertex(coder, p, source, v);
    p->frame++;
    return valid;
}

size_t ath_predicted_memory(int32_t vertex_count)
{
    prediction counted;
    return ath_size_or_most(carve_prediction(&counted, vertex_count, 0));
}

int64_t ath_encode_predicted(void *memory, uint8_t *bytes, size_t capacity, const ath_plan *plan, const double *origin,
                             int32_t frames, int is_float64, double step, const double *source, int64_t stride,
                             const double *limits, int32_t block_frames, double *block, void *positions)
{
    ath_coder coder;
    prediction *p = (prediction *)memory;
    predicted_source wanted = {source, limits, stride, frames, block_frames, block, 0};
    int valid = 1;
    coder_start(&coder, bytes, capacity);
    carve_prediction(p, plan->vertex_count, (uint8_t *)memory);
    p->step = step;
    start_prediction(p, plan, 0, origin, is_float64, positions);
    for (int32_t t = 0; t < frames && valid; t++) valid = encode_frame(&coder, p, &wanted);
    return written(&coder, valid);
}

size_t ath_model_size(void)
{
    size_t size = sizeof(refinement_model) + history_size(ATH_SEGMENT_FRAMES); /* larger than the model of maps */
    if (size < sizeof(correction_model)) size = sizeof(correction_model);
    if (size < sizeof(refined_shape_model)) size = sizeof(refined_shape_model); /* larger than the model of shapes */
    if (size < sizeof(exact_model)) size = sizeof(exact_model);
    return size < sizeof(rest_model) ? sizeof(rest_model) : size; /* the other models are smaller */
}
