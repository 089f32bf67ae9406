/* The GPU form of levels and segments (ath_gpu.h). An observer records pieces and nodes as words. */
#include "ath_gpu.h"
#include "model/maps.h"
#include "model/refine.h"
#include "play/prepare.h"

enum { SMALL_MAP = 24, STEM_WAVES = 0, NODE_WAVES = 1, LEARNED_WAVES = 2, INT16_MOST = 32767 };

static uint32_t to_words(size_t bytes) { return (uint32_t)(bytes / sizeof(uint32_t)); }

/* Exact levels and predicted motion have no rows. */
static int is_baked(const ath_file *file, int32_t level)
{
    int32_t stage = ath_file_stage(file, level);
    if (file->predicted_trees && stage >= ath_lossy_stages(file) - 1) return 1;
    return stage >= ath_lossy_stages(file) || (file->header.is_predicted && stage > 0);
}

/* ---- bodies of a level ---- */

/* A walk over the bodies of a level, its nodes and pieces, in file order. */
typedef struct {
    const ath_file *file;
    const ath_plan *plan;
    int32_t level, stage, p, n; /* the next piece and node */
    const ath_piece *piece;
    const ath_node *node; /* null: the body is the piece */
} body_walk;

static body_walk walk_bodies(const ath_file *file, int32_t level)
{
    int32_t stage = ath_file_stage(file, level);
    body_walk walk = {file, ath_stage_plan(file, stage), level, stage, 0, 0, 0, 0};
    return walk;
}

static int next_body(body_walk *walk)
{
    const ath_plan *plan = walk->plan;
    const ath_node *nodes = walk->file->plan.nodes;
    for (; !is_baked(walk->file, walk->level) && walk->p < plan->piece_count; walk->p++) {
        walk->piece = plan->pieces + walk->p;
        if (walk->n < plan->node_count && nodes[walk->n].piece == walk->p) {
            walk->node = plan->nodes + walk->n++;
            if (ath_is_shown(walk->node, walk->stage)) return 1;
        }
        walk->node = 0;
        if (walk->piece->stage > walk->stage) continue;
        walk->p++;
        return 1;
    }
    return 0;
}

/* Returns the most modes that rows of the body may hold. */
static int32_t modes_of(const body_walk *walk)
{
    if (!walk->node) return ath_rank(walk->piece);
    if (walk->node->coded) return walk->node->rank;
    return ath_max(ath_min(walk->piece->low_modes, ath_rank(walk->piece)), ath_shape_modes(walk->piece));
}

static int32_t body_count(const ath_file *file, int32_t level)
{
    body_walk walk = walk_bodies(file, level);
    int32_t count = 0;
    walk.plan = &file->plan; /* has as many bodies as layers, whose pieces are planned when they are refined */
    while (next_body(&walk)) count++;
    return count;
}

/* ---- the block of a level ---- */

/* The place of a basis among those of the file, and in the block. */
typedef struct {
    int64_t from;
    uint32_t to;
} known_basis;

typedef struct {
    ath_gpu_level *head;
    ath_gpu_vertex *vertices;
    ath_gpu_body *bodies;
    uint32_t *order, *depths;
    float *bases;
    int32_t *body_of; /* body of each piece; -1: none */
    int32_t *depth;   /* depth of each body */
    known_basis *known;
    int32_t known_count;
    uint32_t bases_used;
} level_writer;

static uint64_t most_basis_numbers(const ath_file *file, int32_t level)
{
    body_walk walk = walk_bodies(file, level);
    uint64_t count = 0;
    while (next_body(&walk))
        count += (uint64_t)modes_of(&walk) * (uint64_t)(walk.node ? 3 : walk.piece->count) + ATH_PIECE_VERTICES;
    return count;
}

/* The bases are the last part that stays, since their size is known only once they are written. */
static uint64_t carve_level(level_writer *writer, const ath_file *file, int32_t level, uint8_t *base)
{
    ath_arena arena = {base, 0};
    uint64_t bodies = (uint64_t)body_count(file, level), vertices = (uint64_t)file->plan.vertex_count;
    writer->head = (ath_gpu_level *)ath_take(&arena, sizeof *writer->head);
    writer->vertices = (ath_gpu_vertex *)ath_take(&arena, vertices * sizeof *writer->vertices);
    writer->bodies = (ath_gpu_body *)ath_take(&arena, bodies * sizeof *writer->bodies);
    writer->order = (uint32_t *)ath_take(&arena, bodies * sizeof *writer->order);
    writer->depths = (uint32_t *)ath_take(&arena, (bodies + 1) * sizeof *writer->depths);
    writer->bases = (float *)ath_take(&arena, most_basis_numbers(file, level) * sizeof *writer->bases);
    writer->body_of = (int32_t *)ath_take(&arena, (uint64_t)file->plan.piece_count * sizeof *writer->body_of);
    writer->depth = (int32_t *)ath_take(&arena, bodies * sizeof *writer->depth);
    writer->known = (known_basis *)ath_take(&arena, bodies * sizeof *writer->known);
    return arena.used;
}

size_t ath_gpu_level_size(const ath_file *file, int32_t level)
{
    level_writer counted;
    return ath_size_or_most(carve_level(&counted, file, level, 0));
}

/* Finds a known basis, or its place, by bisection: most pieces come in the order of their bases. */
static int32_t place_of_basis(const level_writer *writer, int64_t from)
{
    int32_t low = 0, high = writer->known_count;
    while (low < high) {
        int32_t middle = low + (high - low) / 2;
        if (writer->known[middle].from < from)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void put_numbers(level_writer *writer, const double *numbers, int32_t count)
{
    for (int32_t i = 0; i < count; i++) writer->bases[writer->bases_used++] = (float)numbers[i];
}

static uint32_t basis_of_piece(level_writer *writer, const body_walk *walk)
{
    const ath_piece *piece = walk->piece;
    int32_t at = place_of_basis(writer, piece->basis);
    if (at < writer->known_count && writer->known[at].from == piece->basis) return writer->known[at].to;
    known_basis own = {piece->basis, writer->bases_used};
    put_numbers(writer, walk->plan->bases + piece->basis, modes_of(walk) * piece->count);
    if (at == writer->known_count && modes_of(walk) > 0) writer->known[writer->known_count++] = own;
    return own.to;
}

/* A mode moves the columns of a node's map by its affine part. */
static uint32_t basis_of_node(level_writer *writer, const body_walk *walk)
{
    uint32_t at = writer->bases_used;
    const ath_piece *piece = walk->piece;
    for (int32_t m = 0; m < modes_of(walk); m++) {
        double affine[3];
        if (!walk->node->coded)
            ath_affine_part(walk->plan, walk->node, walk->plan->bases + piece->basis + (size_t)m * (size_t)piece->count,
                            affine);
        put_numbers(writer, walk->node->coded ? walk->node->whitening + 3 * m : affine, 3);
    }
    return at;
}

static void set_floats(float out[3], const double x[3])
{
    for (int32_t k = 0; k < 3; k++) out[k] = (float)x[k];
}

/* The shader adds differences of modes, since differences of positions would lose precision as floats. */
static void set_tangent(level_writer *writer, const ath_plan *plan, const ath_piece *piece, ath_gpu_body *body)
{
    const ath_piece *parent = plan->pieces + piece->parent;
    int32_t before = piece->attach - 1, after = ath_min(piece->attach + 1, parent->first + parent->count - 1);
    const double *from = before < parent->first ? ath_rest_attach(plan, parent) : ath_rest_of(plan, before);
    const double *to = ath_rest_of(plan, after);
    double tangent[3], length2 = 0.0;
    for (int32_t k = 0; k < 3; k++) {
        tangent[k] = to[k] - from[k];
        length2 = length2 + tangent[k] * tangent[k];
    }
    if (parent->flags & (ATH_SHEET | ATH_RIGID | ATH_STILL) || !(length2 > 1e-200)) return;
    set_floats(body->tangent, tangent);
    body->flags |= ATH_GPU_FOLLOWS;
    body->way = writer->bases_used;
    for (int32_t m = 0; m < ath_rank(parent); m++) {
        const double *mode = plan->bases + parent->basis + (size_t)m * (size_t)parent->count;
        double way = mode[after - parent->first] - (before < parent->first ? 0.0 : mode[before - parent->first]);
        put_numbers(writer, &way, 1);
    }
}

static void put_body(level_writer *writer, const body_walk *walk, int32_t b)
{
    ath_gpu_level *head = writer->head;
    ath_gpu_body *body = writer->bodies + b;
    const ath_piece *piece = walk->piece;
    int32_t first = piece->first;
    memset(body, 0, sizeof *body);
    body->parent = body->attach = -1;
    writer->depth[b] = 0;
    if (piece->parent >= 0) {
        const ath_gpu_body *base = writer->bodies + writer->body_of[piece->parent];
        body->parent = writer->body_of[piece->parent];
        body->attach = base->first + (piece->attach - walk->plan->pieces[piece->parent].first);
        writer->depth[b] = writer->depth[body->parent] + 1;
        set_tangent(writer, walk->plan, piece, body);
    }
    set_floats(body->rest_point, ath_rest_attach(walk->plan, piece));
    body->modes = (uint32_t)modes_of(walk);
    body->shape_modes = (uint32_t)ath_shape_modes(piece);
    body->vertex = first;
    if (walk->node) {
        body->flags |= ATH_GPU_NODE;
        body->first = (int32_t)head->matrix_count++;
        body->count = 3;
        body->basis = basis_of_node(writer, walk);
        return;
    }
    if ((piece->flags & (ATH_SHEET | ATH_RIGID | ATH_STILL)) == ATH_SHEET && piece->last_attached >= 0)
        body->flags |= ATH_GPU_FITTED;
    body->first = (int32_t)head->position_count;
    body->count = piece->count;
    body->basis = basis_of_piece(writer, walk);
    head->position_count += (uint32_t)piece->count;
    writer->body_of[walk->p - 1] = b;
}

/* Sorts bodies by depth, and within a depth in file order. */
static void put_order(level_writer *writer, int32_t count)
{
    uint32_t depths = 0;
    for (int32_t b = 0; b < count; b++)
        if ((uint32_t)writer->depth[b] >= depths) depths = (uint32_t)writer->depth[b] + 1;
    writer->head->depth_count = depths;
    memset(writer->depths, 0, ((size_t)depths + 1) * sizeof *writer->depths);
    for (int32_t b = 0; b < count; b++) writer->depths[writer->depth[b] + 1]++;
    for (uint32_t d = 0; d < depths; d++) writer->depths[d + 1] += writer->depths[d];
    for (int32_t b = 0; b < count; b++) writer->order[writer->depths[writer->depth[b]]++] = (uint32_t)b;
    for (uint32_t d = depths; d > 0; d--) writer->depths[d] = writer->depths[d - 1];
    writer->depths[0] = 0;
}

static void bind_vertices(level_writer *writer, const ath_file *file, int32_t level)
{
    int32_t stage = ath_file_stage(file, level);
    const ath_plan *plan = ath_stage_plan(file, stage);
    const ath_node *node = plan->nodes, *end = node + plan->node_count;
    uint32_t position = 0, matrix = 0;
    for (int32_t v = 0; v < plan->vertex_count;) {
        while (node < end && (node->first < v || !ath_is_shown(node, stage))) node++;
        int moved = node < end && node->first == v;
        int32_t stop = moved ? v + node->count : node < end ? node->first : plan->vertex_count;
        for (; v < stop; v++) {
            set_floats(writer->vertices[v].rest, ath_rest_of(plan, v));
            writer->vertices[v].binding = moved ? matrix | ATH_GPU_MOVED : position++;
        }
        matrix += (uint32_t)moved;
    }
    writer->head->position_count = position;
}

static uint32_t words_from(const level_writer *writer, const void *at)
{
    return to_words((size_t)((const uint8_t *)at - (const uint8_t *)writer->head));
}

int ath_gpu_build_level(const ath_file *file, int32_t level, void *memory, size_t memory_bytes)
{
    level_writer writer;
    if (level < 0 || level >= file->info.level_count) return ATH_BAD_ARGUMENT;
    if (!file->rest_known) return ATH_NEEDS_HOST_MESH;
    if (!file->bases || !ath_stage_plan(file, ath_file_stage(file, level))->bases
        || !ath_fits(memory, memory_bytes, ath_gpu_level_size(file, level)))
        return ATH_NO_MEMORY;
    memset(&writer, 0, sizeof writer);
    carve_level(&writer, file, level, (uint8_t *)memory);
    /* Also what lies between the sections, so that the same file gives the same block. */
    memset(writer.head, 0, (size_t)((uint8_t *)writer.bases - (uint8_t *)writer.head));
    for (int32_t p = 0; p < file->plan.piece_count; p++) writer.body_of[p] = -1;
    body_walk walk = walk_bodies(file, level);
    int32_t count = 0;
    while (next_body(&walk)) put_body(&writer, &walk, count++);
    put_order(&writer, count);
    bind_vertices(&writer, file, level);
    ath_gpu_level *head = writer.head;
    head->level = (uint32_t)level;
    head->vertex_count = (uint32_t)file->plan.vertex_count;
    head->body_count = (uint32_t)count;
    head->vertices = words_from(&writer, writer.vertices);
    head->bodies = words_from(&writer, writer.bodies);
    head->order = words_from(&writer, writer.order);
    head->depths = words_from(&writer, writer.depths);
    head->bases = words_from(&writer, writer.bases);
    head->words = head->bases + writer.bases_used;
    set_floats(head->origin, file->info.origin);
    return ATH_OK;
}

/* ---- recording a segment ---- */

/* A section while it is written. Without room, only its size is counted. */
typedef struct {
    uint32_t *at;
    uint64_t used, room; /* words */
} section;

enum {
    MOVES,
    ROWS,
    VALUES,
    SHAPES,
    TURNS,
    JOIN_CURVE,
    JOIN_STEPS,
    JOINS,
    MATRIX_JOINS,
    CORRECTED,
    CORRECTIONS,
    BAKED,
    WAVES,
    SECTIONS
};

typedef struct {
    ath_watcher watcher;
    const ath_file *file;
    ath_gpu_segment *head;
    section sections[SECTIONS];
    const double *waves[ATH_GPU_WAVE_SETS];
    int32_t waves_used[ATH_GPU_WAVE_SETS];
    ath_gpu_move move; /* the last body's */
    int32_t level, frames, bodies, matrices, corrected_before, is_node;
    int32_t fits;
} recorder;

static uint64_t carve_record(recorder *record, const ath_file *file, int32_t level, const ath_gpu_room *room,
                             uint8_t *base)
{
    ath_arena arena = {base, 0};
    int32_t nodes, positions;
    ath_cut_size(file, level, 0, &nodes, &positions);
    uint64_t bodies = (uint64_t)body_count(file, level), joined = file->has_joins ? 1 : 0;
    uint64_t sizes[SECTIONS] = {4 * bodies,
                                room->rows,
                                room->values,
                                room->shapes,
                                room->turns,
                                joined * 2 * ATH_JOIN_SLOPED,
                                joined * 2 * bodies,
                                joined * 3 * (uint64_t)positions,
                                joined * SMALL_MAP * (uint64_t)nodes,
                                room->corrected,
                                room->corrections,
                                is_baked(file, level) ? 3 * (uint64_t)positions * (uint64_t)file->longest : 0,
                                room->waves};
    ath_take(&arena, sizeof *record);
    record->head = (ath_gpu_segment *)ath_take(&arena, sizeof *record->head);
    for (int32_t i = 0; i < SECTIONS; i++) {
        record->sections[i].room = sizes[i];
        record->sections[i].at = (uint32_t *)ath_take(&arena, sizes[i] * sizeof(uint32_t));
    }
    return arena.used;
}

size_t ath_gpu_record_size(const ath_file *file, int32_t level, const ath_gpu_room *room)
{
    recorder counted;
    return ath_size_or_most(carve_record(&counted, file, level, room, 0));
}

/* Returns room for `words` words; null: there is none. */
static uint32_t *push(recorder *record, int32_t index, uint32_t words)
{
    section *own = record->sections + index;
    uint64_t at = own->used;
    own->used += words;
    return own->used <= own->room ? own->at + at : 0;
}

static void push_float(recorder *record, int32_t index, double x)
{
    float number = (float)x;
    uint32_t *at = push(record, index, 1);
    if (at) memcpy(at, &number, sizeof number);
}

static void put_row(recorder *record, int32_t slot, int32_t set, const double *waves, double step,
                    const int32_t *integers, int32_t most)
{
    int32_t T = record->frames, count = ath_row_extent(integers, T, most), wide = 0;
    if (count == 0) return;
    for (int32_t axis = 0; axis < 3; axis++)
        for (int32_t k = 0; k < count; k++) {
            int32_t value = integers[axis * T + k];
            wide |= value > INT16_MOST || value < -INT16_MOST;
        }
    ath_gpu_row row = {(uint32_t)record->sections[VALUES].used, (uint16_t)count, (uint8_t)slot,
                       (uint8_t)(set | (wide ? ATH_GPU_WIDE : 0)), (float)step};
    uint32_t *at = push(record, ROWS, to_words(sizeof row));
    if (at) memcpy(at, &row, sizeof row);
    uint32_t *values = push(record, VALUES, wide ? 3 * (uint32_t)count : (3 * (uint32_t)count + 1) / 2);
    for (int32_t i = 0; values && i < 3 * count; i++) {
        uint32_t value = (uint32_t)integers[i / count * T + i % count];
        if (wide)
            values[i] = value;
        else
            values[i / 2] = i % 2 ? values[i / 2] | value << 16 : value & 0xffffu;
    }
    record->move.counts++;
    record->waves[set] = waves;
    record->waves_used[set] = ath_max(record->waves_used[set], count);
}

static void put_stream_row(recorder *record, const ath_motion *motion, const ath_stream *stream, int32_t slot,
                           double step, const int32_t *integers, const int32_t *counts)
{
    int32_t set = stream->root < 0 ? STEM_WAVES : LEARNED_WAVES + (int32_t)(stream - motion->streams);
    put_row(record, slot, set, stream->temporal, step, integers, counts ? counts[slot] : stream->temporal_rank);
}

static void put_shapes(recorder *record, const ath_piece *piece, const ath_piece_rows *rows, int32_t count)
{
    record->move.shapes = (uint32_t)record->sections[SHAPES].used;
    record->move.counts |= (uint32_t)count << 16;
    for (int32_t s = 0; s < count; s++)
        for (int32_t i = 0; i < 3 * ath_shape_modes(piece); i++)
            push_float(record, SHAPES, rows->shapes[s * ATH_SHAPE_NUMBERS + i]);
}

static void put_turn(recorder *record, const ath_turning *turning)
{
    record->move.turn = (uint32_t)record->sections[TURNS].used;
    for (int32_t k = 0; k < 3; k++)
        for (int32_t axis = 0; axis < 3; axis++)
            push_float(record, TURNS,
                       turning->steps[axis]
                           * (turning->own_axes ? turning->axes[3 * axis + k]
                              : k == axis       ? 1.0
                                                : 0.0));
}

static void begin_body(recorder *record, int is_node)
{
    memset(&record->move, 0, sizeof record->move);
    record->move.row = (uint32_t)(record->sections[ROWS].used / to_words(sizeof(ath_gpu_row)));
    record->bodies++;
    record->is_node = is_node;
}

static void end_body(recorder *record)
{
    uint32_t *at = push(record, MOVES, to_words(sizeof record->move));
    if (at) memcpy(at, &record->move, sizeof record->move);
}

static void put_tracks(recorder *record, const ath_plan *plan, const ath_motion *motion, const ath_piece *piece,
                       const ath_piece_rows *rows)
{
    const ath_stream *base = ath_base_stream(motion, piece);
    if (ath_has_shift(piece))
        put_stream_row(record, motion, base, ATH_GPU_SHIFT, ath_shift_step(piece, base), rows->shift, rows->counts);
    if (!ath_has_rotation(plan, piece, base)) return;
    uint32_t before = record->move.counts;
    put_stream_row(record, motion, base, ATH_GPU_ROTATION, 1.0, rows->rotation, rows->counts);
    if (record->move.counts == before) return;
    ath_turning turning = ath_turning_of(plan, piece, base);
    put_turn(record, &turning);
}

static void put_modes(recorder *record, const ath_motion *motion, const ath_piece *piece, const ath_piece_rows *rows,
                      int32_t modes, int32_t shapes)
{
    for (int32_t m = 0; m < modes; m++) {
        if (ath_is_shape_row(piece, rows, m) && 3 * m >= shapes) continue;
        put_stream_row(record, motion, ath_mode_stream(motion, piece, m), m, ath_row_step(motion, piece, rows, m),
                       ath_row(rows->modes, m, motion->frames), rows->counts);
    }
    if (shapes > 0) put_shapes(record, piece, rows, shapes);
}

static void record_piece(ath_watcher *watcher, const ath_plan *plan, const ath_motion *motion, int32_t p,
                         const ath_piece_rows *rows)
{
    recorder *record = (recorder *)watcher;
    const ath_piece *piece = plan->pieces + p;
    if (is_baked(record->file, record->level)) return;
    record->frames = motion->frames;
    begin_body(record, 0);
    put_tracks(record, plan, motion, piece, rows);
    put_modes(record, motion, piece, rows, ath_rank(piece), rows->shape_count);
    end_body(record);
}

static void put_coded_map(recorder *record, const ath_motion *motion, const ath_node *node, int has_shift,
                          const ath_node_rows *rows)
{
    double step = ath_node_step(*rows->step);
    int32_t T = motion->frames;
    if (has_shift) put_row(record, ATH_GPU_SHIFT, NODE_WAVES, motion->waves, step, ath_row(rows->rows, 3, T), T);
    for (int32_t r = 0; r < node->rank; r++)
        put_row(record, r, NODE_WAVES, motion->waves, step, ath_row(rows->rows, r, T), T);
}

static void record_node(ath_watcher *watcher, const ath_plan *plan, const ath_motion *motion, int32_t n,
                        const ath_piece_rows *rows, const ath_node_rows *node_rows)
{
    recorder *record = (recorder *)watcher;
    const ath_node *node = plan->nodes + n;
    const ath_piece *piece = plan->pieces + node->piece;
    record->frames = motion->frames;
    begin_body(record, 1);
    if (node->coded) {
        put_coded_map(record, motion, node, ath_has_shift(piece), node_rows);
    } else {
        int32_t shapes = ath_min(rows->shape_count, ath_base_shapes(piece));
        put_tracks(record, plan, motion, piece, rows);
        put_modes(record, motion, piece, rows,
                  rows->shape_count > 0 ? ath_shape_modes(piece) : ath_min(piece->low_modes, ath_rank(piece)), shapes);
    }
    end_body(record);
}

/* ---- joins and corrections ---- */

static void record_curve(recorder *record, int32_t width, const double *jumps, const double *slopes)
{
    if (record->sections[JOIN_CURVE].used > 0) return;
    for (int32_t t = 0; t < width; t++) {
        push_float(record, JOIN_CURVE, jumps[t]);
        push_float(record, JOIN_CURVE, slopes[t]);
    }
}

static int32_t nearest(double x)
{
    if (!(x > -INT16_MOST)) return -INT16_MOST; /* also for NaN */
    if (x > (double)INT16_MOST) return INT16_MOST;
    return x < 0.0 ? -(int32_t)(0.5 - x) : (int32_t)(x + 0.5);
}

static void record_join(ath_watcher *watcher, int32_t width, const double *jumps, const double *slopes, int32_t count,
                        double off[][2])
{
    recorder *record = (recorder *)watcher;
    double step[2] = {0.0, 0.0};
    if (is_baked(record->file, record->level)) return;
    record_curve(record, width, jumps, slopes);
    for (int32_t i = 0; i < count; i++)
        for (int32_t k = 0; k < 2; k++) {
            double size = (off[i][k] < 0.0 ? -off[i][k] : off[i][k]) / (double)INT16_MOST;
            if (size > step[k]) step[k] = size;
        }
    push_float(record, JOIN_STEPS, step[0]);
    push_float(record, JOIN_STEPS, step[1]);
    for (int32_t i = 0; i < count; i++) {
        if (record->is_node) {
            push_float(record, MATRIX_JOINS, off[i][0]);
            push_float(record, MATRIX_JOINS, off[i][1]);
            continue;
        }
        uint32_t integers[2], *at = push(record, JOINS, 1);
        for (int32_t k = 0; k < 2; k++) integers[k] = step[k] > 0.0 ? (uint32_t)nearest(off[i][k] / step[k]) : 0;
        if (at) *at = (integers[0] & 0xffffu) | integers[1] << 16;
    }
}

static void push_correction(recorder *record, int32_t frame, const int32_t q[3], int32_t width)
{
    ath_gpu_correction own = {{(int16_t)q[0], (int16_t)q[1], (int16_t)q[2]}, (uint8_t)frame, (uint8_t)width};
    uint32_t *at = push(record, CORRECTIONS, to_words(sizeof own));
    if (at) memcpy(at, &own, sizeof own);
}

/* A correction that does not fit 16 bits becomes two. */
static void record_correction(ath_watcher *watcher, int32_t position, int32_t frame, const ath_correction *own,
                              double step)
{
    recorder *record = (recorder *)watcher;
    int32_t low[3], high[3];
    if (is_baked(record->file, record->level)) return;
    if (position != record->corrected_before) {
        uint32_t *at = push(record, CORRECTED, 2);
        if (at) {
            at[0] = (uint32_t)position;
            at[1] = (uint32_t)(record->sections[CORRECTIONS].used / to_words(sizeof(ath_gpu_correction)));
        }
        record->corrected_before = position;
        record->head->correction_part = (float)(step / (double)ATH_FOOTPRINT_PARTS);
    }
    for (int32_t k = 0; k < 3; k++) {
        high[k] = own->q[k] / (INT16_MOST + 1);
        low[k] = own->q[k] % (INT16_MOST + 1);
    }
    push_correction(record, frame, low, own->width);
    if (high[0] || high[1] || high[2]) push_correction(record, frame, high, own->width | 15 << 4);
}

/* ---- the end ---- */

static void record_baked(recorder *record, const ath_segment *segment)
{
    const ath_file *file = record->file;
    for (size_t t = 0; t < (size_t)segment->frames; t++)
        for (size_t v = 0; v < (size_t)segment->exact_vertices; v++) {
            const void *x = ath_vertex_at(segment, segment->positions, t, ath_position_of(file, segment, v));
            for (size_t k = 0; k < 3; k++)
                push_float(record, BAKED, ath_number_at(x, k, segment->is_float64) - file->info.origin[k]);
        }
}

static void record_waves(recorder *record, uint32_t first[ATH_GPU_WAVE_SETS])
{
    for (int32_t set = 0; set < ATH_GPU_WAVE_SETS; set++) {
        first[set] = (uint32_t)record->sections[WAVES].used;
        for (int32_t i = 0; i < record->waves_used[set] * record->frames; i++)
            push_float(record, WAVES, record->waves[set][i]);
    }
}

/* Moves the sections together and fills where each begins. */
static void close_gaps(recorder *record, uint32_t begins[SECTIONS])
{
    uint32_t *to = (uint32_t *)(void *)(record->head + 1), *start = (uint32_t *)(void *)record->head;
    for (int32_t i = 0; i < SECTIONS; i++) {
        const section *own = record->sections + i;
        begins[i] = (uint32_t)(to - start);
        for (uint64_t k = 0; k < own->used; k++) *to++ = own->at[k];
    }
    record->head->words = (uint32_t)(to - start);
}

static int all_fit(const recorder *record)
{
    for (int32_t i = 0; i < SECTIONS; i++)
        if (record->sections[i].used > record->sections[i].room) return 0;
    return 1;
}

static void record_done(ath_watcher *watcher, const ath_motion *motion, const ath_segment *segment)
{
    recorder *record = (recorder *)watcher;
    ath_gpu_segment *head = record->head;
    uint32_t begins[SECTIONS], waves[ATH_GPU_WAVE_SETS];
    record->frames = motion->frames;
    if (record->sections[CORRECTED].used > 0) {
        uint32_t *end = push(record, CORRECTED, 2);
        if (end) {
            end[0] = 0;
            end[1] = (uint32_t)(record->sections[CORRECTIONS].used / to_words(sizeof(ath_gpu_correction)));
        }
        head->corrected_count = (uint32_t)(record->sections[CORRECTED].used / 2) - 1;
    }
    int baked = is_baked(record->file, record->level);
    if (baked) record_baked(record, segment);
    record_waves(record, waves);
    record->fits = all_fit(record);
    if (!record->fits) return;
    close_gaps(record, begins);
    head->level = (uint32_t)segment->level;
    head->segment = (uint32_t)segment->index;
    head->frames = (uint32_t)segment->frames;
    head->join_frames = (uint32_t)(record->sections[JOIN_CURVE].used / 2);
    head->row_count = (uint32_t)(record->sections[ROWS].used / to_words(sizeof(ath_gpu_row)));
    head->moves = begins[MOVES];
    head->rows = begins[ROWS];
    head->values = begins[VALUES];
    head->shapes = begins[SHAPES];
    head->turns = begins[TURNS];
    head->join_curve = begins[JOIN_CURVE];
    head->join_steps = begins[JOIN_STEPS];
    head->joins = begins[JOINS];
    head->matrix_joins = begins[MATRIX_JOINS];
    head->corrected = begins[CORRECTED];
    head->corrections = begins[CORRECTIONS];
    head->baked = baked ? begins[BAKED] : 0;
    for (int32_t set = 0; set < ATH_GPU_WAVE_SETS; set++)
        head->wave_sets[set] = record->waves_used[set] > 0 ? begins[WAVES] + waves[set] : 0;
}

int ath_gpu_record(ath_work *work, const ath_gpu_room *room, void *memory, size_t memory_bytes)
{
    int32_t level = ath_watched_level(work);
    const ath_file *file = ath_watched_file(work);
    recorder *record = (recorder *)memory;
    if (!ath_fits(memory, memory_bytes, ath_gpu_record_size(file, level, room))) return ATH_NO_MEMORY;
    memset(record, 0, sizeof *record);
    carve_record(record, file, level, room, (uint8_t *)memory);
    memset(record->head, 0, sizeof *record->head);
    record->file = file;
    record->level = level;
    record->corrected_before = -1;
    record->watcher.piece = record_piece;
    record->watcher.node = record_node;
    record->watcher.join = record_join;
    record->watcher.correction = record_correction;
    record->watcher.done = record_done;
    ath_watch(work, &record->watcher);
    return ATH_OK;
}

const ath_gpu_segment *ath_gpu_recorded(const void *memory, ath_gpu_room *needed)
{
    const recorder *record = (const recorder *)memory;
    const section *sections = record->sections;
    if (needed) {
        needed->rows = (uint32_t)sections[ROWS].used;
        needed->values = (uint32_t)sections[VALUES].used;
        needed->shapes = (uint32_t)sections[SHAPES].used;
        needed->turns = (uint32_t)sections[TURNS].used;
        needed->corrected = (uint32_t)sections[CORRECTED].used;
        needed->corrections = (uint32_t)sections[CORRECTIONS].used;
        needed->waves = (uint32_t)sections[WAVES].used;
    }
    return record->fits ? record->head : 0;
}

/* ---- bounds and frames ---- */

static void widen(double box[6], const double x[3])
{
    for (int32_t k = 0; k < 3; k++) {
        if (!(x[k] >= box[k])) box[k] = x[k];
        if (!(x[k] <= box[3 + k])) box[3 + k] = x[k];
    }
}

static void widen_node(const ath_file *file, const ath_segment *segment, const ath_part *part, double box[6])
{
    const ath_plan *plan = ath_stage_plan(file, segment->stage);
    const ath_branch *branch = plan->branches + part->branch;
    const double *a = ath_rest_of(plan, branch->attach >= 0 ? branch->attach : branch->first);
    for (size_t t = 0; t < (size_t)segment->frames; t++) {
        const double *m = segment->maps + (t * (size_t)segment->node_count + (size_t)part->index) * ATH_MAP;
        for (int32_t v = part->first; v < part->first + part->count; v++) {
            const double *x0 = ath_rest_of(plan, v);
            double x[3], d[3] = {x0[0] - a[0], x0[1] - a[1], x0[2] - a[2]};
            for (int32_t i = 0; i < 3; i++)
                x[i] = m[9 + i] + (m[3 * i] * d[0] + m[3 * i + 1] * d[1] + m[3 * i + 2] * d[2]);
            widen(box, x);
        }
    }
}

static void widen_positions(const ath_file *file, const ath_segment *segment, double box[6])
{
    const double *origin = file->info.origin;
    for (size_t i = 0; i < (size_t)segment->frames * (size_t)segment->exact_vertices; i++) {
        double x[3];
        for (size_t k = 0; k < 3; k++)
            x[k] = ath_number_at(segment->positions, 3 * i + k, segment->is_float64) - origin[k];
        widen(box, x);
    }
}

/* Share of the box's size, for rounding here and on the GPU. */
static const double BOX_MARGIN = 1e-6;

void ath_gpu_bounds(const ath_file *file, const ath_segment *segment, float box[6])
{
    double most = 1.7976931348623157e308, wide[6] = {most, most, most, -most, -most, -most};
    widen_positions(file, segment, wide);
    for (int32_t i = 0; i < segment->part_count; i++)
        if (segment->parts[i].branch >= 0) widen_node(file, segment, segment->parts + i, wide);
    double margin = BOX_MARGIN * (wide[3] - wide[0] + wide[4] - wide[1] + wide[5] - wide[2]);
    for (int32_t k = 0; k < 6; k++) box[k] = (float)(wide[k] + (k < 3 ? -margin : margin));
}

int32_t ath_gpu_frame(const ath_file *file, int32_t frame) { return file->coded[frame]; }
