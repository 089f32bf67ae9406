/* The last phase: pieces and nodes, one after the other. A piece is placed as soon as its integers are decoded, so that
 * only attach caches are kept. */
#include "play/pieces.h"
#include "model/foresee.h"
#include "model/maps.h"
#include "play/correct.h"
#include "play/store.h"

static void clear_row(int32_t *row, int32_t frames, int32_t *count)
{
    for (int32_t axis = 0; axis < 3 && *count > 0; axis++) memset(row + axis * frames, 0, (size_t)*count * sizeof *row);
    *count = 0;
}

/* code_row needs rows of zeros. */
static void clear_piece(layer_work *layer, const ath_piece *piece)
{
    int32_t T = layer->motion.frames;
    for (int32_t m = 0; m < piece->count; m++) {
        int32_t reach = layer->rows.reach;
        clear_row(ath_row(layer->rows.modes, m, T), T, layer->counts + m);
        if (m < layer->rows.reached_modes) clear_row(ath_row(layer->rows.predicted_modes, m, T), T, &reach);
    }
    memset(layer->shape_integers, 0, (size_t)layer->rows.shape_count * ATH_SHAPE_NUMBERS * sizeof(int32_t));
    layer->rows.shape_count = 0;
    clear_row(layer->rows.shift, T, layer->counts + SHIFT_SLOT);
    clear_row(layer->rows.rotation, T, layer->counts + ROTATION_SLOT);
}

/* Reads the shapes that a stage adds to the piece. */
static int read_shapes(ath_work *work, const ath_piece *piece, int32_t stage)
{
    shapes_reader *reader = work->shapes + stage;
    layer_work *layer = work->layers;
    int32_t known = layer->rows.shape_count;
    int32_t count = code_shapes(&reader->coder, reader->model, piece, stage, known, layer->shape_integers);
    if (count < 0) return ath_blame(work, reader->chunk, ATH_BAD_CHUNK);
    size_t from = (size_t)known * ATH_SHAPE_NUMBERS;
    if (!ath_unit_shapes(count - known, layer->shape_integers + from, layer->unit_shapes + from))
        return ath_blame(work, reader->chunk, ATH_BAD_CHUNK);
    layer->rows.shape_count = count;
    return ATH_OK;
}

static int read_piece(ath_work *work, int32_t p, int32_t stage)
{
    stems_reader *reader = work->stems + stage;
    ath_coder coder = reader->coder;
    layer_work *layer = work->layers;
    if (work->shapes[stage].chunk && read_shapes(work, layer->plan->pieces + p, stage) != ATH_OK) return ATH_BAD_CHUNK;
    code_piece(&coder, reader->model, layer->plan, work->streams + stage, layer->motion.frames, p, stage, &layer->rows);
    reader->coder = coder;
    return ath_blame(work, reader->chunk, reader->model->invalid ? ATH_BAD_CHUNK : ATH_OK);
}

static int read_first_layer(ath_work *work, int32_t p)
{
    const ath_piece *piece = work->file->plan.pieces + p;
    int result = ATH_OK;
    if (piece->low_stage >= 0 && piece->low_stage <= work->stage) result = read_piece(work, p, piece->low_stage);
    if (piece->stage <= work->stage && result == ATH_OK) result = read_piece(work, p, piece->stage);
    return result;
}

/* ---- refinements ---- */

static int refine_shapes(ath_work *work, int32_t q, const ath_piece *piece)
{
    shapes_reader *reader = work->shapes + piece->stage;
    layer_work *layer = work->layers + q, *before = layer - 1;
    if (!reader->chunk) return ATH_OK;
    int32_t count = code_refined_shapes(&reader->coder, reader->refined, piece, before->rows.shape_count,
                                        before->shape_integers, reader->shift, 0, layer->shape_integers);
    if (count < 0 || !ath_unit_shapes(count, layer->shape_integers, layer->unit_shapes))
        return ath_blame(work, reader->chunk, ATH_BAD_CHUNK);
    layer->rows.shape_count = count;
    return ATH_OK;
}

/* Collects what this layer predicts piece p from: the piece's rows in the layer before. */
static void look_before(ath_work *work, int32_t q, int32_t p)
{
    layer_work *layer = work->layers + q;
    const layer_work *coarse = layer - 1;
    const ath_piece *piece = coarse->plan->pieces + p;
    ath_piece_before *before = &layer->before;
    int32_t T = layer->motion.frames, root = work->streams[layer->plan->pieces[p].stage].root;
    int same = ath_base_stream(&coarse->motion, piece)->root == root;
    before->rotation = coarse->counts[ROTATION_SLOT] > 0 ? coarse->scratch.rotation : 0;
    before->shift = coarse->counts[SHIFT_SLOT] > 0 ? coarse->scratch.shift : 0;
    before->frames = 0;
    layer->rows.coarse_turn_steps = 0;
    if (piece->flags & ATH_RIGID) {
        ath_turning turning = ath_turning_of(coarse->plan, piece, ath_base_stream(&coarse->motion, piece));
        memcpy(layer->turn_steps, turning.steps, sizeof turning.steps);
        before->frames = coarse->scratch.at.point;
        layer->rows.coarse_turn_steps = layer->turn_steps;
    }
    before->modes = 0;
    before->frequencies = ath_max(ath_row_extent(coarse->rows.shift, T, coarse->counts[SHIFT_SLOT]),
                                  ath_row_extent(coarse->rows.rotation, T, coarse->counts[ROTATION_SLOT]));
    for (int32_t r = 0; r < ath_rank(piece); r++) {
        int32_t count = ath_row_extent(ath_row(coarse->rows.modes, r, T), T, coarse->counts[r]);
        before->frequencies = ath_max(before->frequencies, count);
        same = same && ath_mode_stream(&coarse->motion, piece, r)->root == root;
        if (count > 0) before->modes = coarse->rows.shape_count > 0 ? ath_max(ath_shape_modes(piece), r + 1) : r + 1;
    }
    if (!same && before->frequencies > 0) before->frequencies = T;
    int alike = (coarse->rows.shape_count > 0) == (layer->rows.shape_count > 0);
    layer->rows.reach = before->frequencies;
    layer->rows.reached_modes = ath_predicted_modes(layer->plan->pieces + p, before, &layer->rows);
    layer->rows.coarse_modes = same && alike ? coarse->rows.modes : 0;
    layer->rows.coarse_rotation = same ? coarse->rows.rotation : 0;
    layer->rows.coarse_shift = same ? coarse->rows.shift : 0;
}

static const double *placed_piece(layer_work *layer, int32_t p, const ath_float_frames *to)
{
    if (!layer->placed)
        layer->placed = ath_pose_used(layer->plan, &layer->motion, layer->plan->pieces + p, &layer->rows, layer->used,
                                      ATH_ALL_VERTICES, &layer->scratch, to);
    return layer->placed;
}

/* Places the piece after ath_turned_attach, in a layer before the last only what other pieces hang on. */
static void pose_piece(const ath_work *work, layer_work *layer, int32_t p)
{
    const ath_piece *piece = layer->plan->pieces + p;
    ath_segment *segment = work->segment;
    ath_float_frames to = {(float *)ath_vertex_at(segment, segment->positions, 0, ath_position_of_piece(work)),
                           3 * (size_t)segment->exact_vertices, work->file->info.origin};
    ath_pose_tracks(&layer->motion, piece, &layer->rows, &layer->scratch, layer->used);
    layer->placed = 0;
    if (layer == work->layers + work->layer)
        placed_piece(layer, p, segment->is_float64 || work->is_predicted ? 0 : &to);
    else if (piece->attach_cache >= 0)
        ath_pose_used(layer->plan, &layer->motion, piece, &layer->rows, layer->used, piece->attached, &layer->scratch,
                      0);
}

static void predict_modes(layer_work *layer, int32_t p)
{
    layer_work *coarse = layer - 1;
    ath_placing placing = {coarse->plan, &coarse->rows, &coarse->scratch, coarse->used};
    if (ath_foresee_modes(layer->plan, &layer->motion, p, &layer->before, &placing, &layer->scratch, &layer->rows))
        return;
    layer->before.placed = placed_piece(coarse, p, 0);
    ath_predict_modes(layer->plan, &layer->motion, layer->plan->pieces + p, &layer->before, &layer->scratch,
                      &layer->rows);
}

static int refine_piece(ath_work *work, int32_t q, int32_t p)
{
    layer_work *layer = work->layers + q;
    const ath_piece *piece = layer->plan->pieces + p;
    const ath_stream *stream = work->streams + piece->stage;
    stems_reader *reader = work->stems + piece->stage;
    ath_coder coder = reader->coder;
    if (refine_shapes(work, q, piece) != ATH_OK) return ATH_BAD_CHUNK;
    look_before(work, q, p);
    ath_attach(layer->plan, &layer->motion, piece, layer->scratch.at);
    ath_predict_tracks(layer->plan, &layer->motion, piece, &layer->before, &layer->scratch, &layer->rows);
    code_refined_tracks(&coder, reader->refined, layer->plan, stream, &layer->motion, piece, &layer->rows);
    ath_turn_attached(layer->plan, &layer->motion, piece, &layer->rows, &layer->scratch);
    predict_modes(layer, p);
    code_refined_modes(&coder, reader->refined, stream, &layer->motion, piece, &layer->rows);
    reader->coder = coder;
    if (reader->refined->rows.invalid) return ath_blame(work, reader->chunk, ATH_BAD_CHUNK);
    pose_piece(work, layer, p);
    return ATH_OK;
}

static void watch_piece(const ath_work *work, int32_t p)
{
    ath_watcher *watcher = ath_watcher_of(work);
    const layer_work *layer = work->layers + work->layer;
    watcher->piece(watcher, layer->plan, &layer->motion, p, &layer->rows);
}

/* Returns whether nothing depends on where a layer before the last has a piece. */
static int is_idle(const layer_work *layer, const ath_piece *piece)
{
    int32_t any = layer->counts[SHIFT_SLOT] | layer->counts[ROTATION_SLOT];
    for (int32_t m = 0; m < ath_rank(piece); m++) any |= layer->counts[m];
    return any == 0 && piece->attach_cache < 0;
}

/* Places the piece at the first layer, then refines it layer by layer. */
static int place_piece(ath_work *work, int32_t p)
{
    const ath_piece *piece = work->file->plan.pieces + p;
    layer_work *layer = work->layers + work->first_layer;
    size_t vertex = (size_t)work->exact, position = ath_position_of_piece(work);
    if (work->first_layer == work->layer || !is_idle(layer, layer->plan->pieces + p)) {
        ath_turned_attach(layer->plan, &layer->motion, p, &layer->rows, &layer->scratch);
        pose_piece(work, layer, p);
    }
    for (int32_t q = work->first_layer + 1; q <= work->layer; q++)
        if (refine_piece(work, q, p) != ATH_OK) return ATH_BAD_CHUNK;
    layer = work->layers + work->layer;
    if (work->keeping.at)
        ath_keep_piece(&work->keeping, piece, &layer->rows, layer->shape_integers, layer->motion.frames);
    if (ath_watcher_of(work)) watch_piece(work, p);
    if (work->segment->is_float64 && !work->is_predicted)
        ath_store_doubles(work->segment, work->file->info.origin, position, piece->count, layer->placed);
    ath_keep_end(work->segment, position, vertex, (size_t)piece->count);
    if (work->join.width > 0 && !work->is_predicted)
        ath_join_vertices(&work->join, work->segment, position, vertex, (size_t)piece->count, ath_watcher_of(work));
    if (work->corrections.chunk) ath_correct_piece(work, piece);
    return ATH_OK;
}

static int show_piece(ath_work *work, int32_t p)
{
    const ath_piece *piece = work->file->plan.pieces + p;
    if (work->shown_before)
        ath_copy_vertices(work->file, work->segment, work->shown_before, (size_t)work->exact, (size_t)piece->count);
    else if (!(work->predicted && work->file->header.is_predicted) && place_piece(work, p) != ATH_OK)
        return ATH_BAD_CHUNK;
    int result = work->exact_level.chunk ? ath_make_exact(work, piece) : ATH_OK;
    work->exact += piece->count;
    return result;
}

static void show_node(ath_work *work, int32_t n)
{
    ath_segment *segment = work->segment;
    size_t T = (size_t)segment->frames, nodes = (size_t)segment->node_count;
    double *maps = segment->maps + ATH_MAP * (size_t)work->shown++;
    layer_work *layer = work->layers;
    ath_watcher *watcher = ath_watcher_of(work);
    if (watcher) watcher->node(watcher, layer->plan, &layer->motion, n, &layer->rows, &work->node);
    ath_node_map(layer->plan, &layer->motion, n, &layer->rows, &work->node, &layer->scratch);
    for (size_t t = 0; t < T; t++) {
        double *map = maps + t * nodes * ATH_MAP;
        for (size_t k = 0; k < 9; k++) map[k] = layer->scratch.at.rotation[k * T + t];
        for (size_t k = 0; k < 3; k++) map[9 + k] = layer->scratch.at.point[k * T + t];
    }
    if (work->join.width > 0) ath_join_map(&work->join, segment, (size_t)(work->shown - 1), watcher);
}

static int read_node(ath_work *work, int32_t n)
{
    const ath_node *node = work->file->plan.nodes + n;
    affines_reader *reader = work->affines + node->stage;
    if (!node->coded || node->stage > work->stage || !reader->chunk) return ATH_OK;
    memset(work->node.rows, 0, 4 * 3 * (size_t)work->segment->frames * sizeof *work->node.rows);
    int valid = code_node(&reader->coder, reader->model, work->layers->plan, work->segment->frames, n, &work->node);
    return ath_blame(work, reader->chunk, valid ? ATH_OK : ATH_BAD_CHUNK);
}

/* Prepares one piece, and the node that begins with it. */
int ath_do_piece(ath_work *work)
{
    const ath_plan *plan = &work->file->plan;
    int32_t p = work->next++, result = ATH_OK;
    const ath_piece *piece = plan->pieces + p;
    layer_work *first = work->layers + work->first_layer;
    if (piece->attach < 0) work->is_predicted = work->predicted && piece->flags & ATH_LOOSE;
    if (work->first_stage == 0 && !work->file->header.is_predicted) result = read_first_layer(work, p);
    if (work->kept)
        work->kept = ath_kept_piece(work->kept, piece, &first->rows, first->shape_integers, first->unit_shapes,
                                    first->motion.frames);
    if (result == ATH_OK && work->next_node < plan->node_count && plan->nodes[work->next_node].piece == p) {
        int32_t n = work->next_node++;
        result = read_node(work, n);
        if (result == ATH_OK && ath_is_shown(plan->nodes + n, work->stage)) show_node(work, n);
    }
    if (result == ATH_OK && piece->stage <= work->stage) result = show_piece(work, p);
    for (int32_t q = work->first_layer; q <= work->layer; q++) clear_piece(work->layers + q, piece);
    return result;
}
