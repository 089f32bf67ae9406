/* The corners of polygons, or the ends of edges (FORMAT.md, "Polygon stream"). Compiled once for each direction. A way
 * is the difference between the vertices of two successive corners. */
#ifndef ATH_STREAMS_POLYGONS_INL
#define ATH_STREAMS_POLYGONS_INL

#include "container/container.h"
#include "model/mesh.h"
#include "bits/numbers.inl"

enum {
    FACE_LONG = 12, /* equal ways before a long, or a short, repetition is expected to go on */
    FACE_SHORT = 3,
    FACE_TABLE_BITS = 14,
    FACE_RECENT_BITS = 5,
    FACE_SIDES = 3, /* open sides that are kept per vertex and direction */
    FACE_GUESSES = 2 + 4 * FACE_SIDES,
    FACE_REPEATED = 0, /* how a corner was coded: by the long repetition, by guess k (1 + k), or otherwise */
    FACE_RECENT = FACE_GUESSES + 1,
    FACE_FAR,
    FACE_WAYS,
    FACE_RUNS = 16,
    FACE_PLACES = 5, /* first, second, third, later corners, and those where two open sides agree */
    FACE_COUNTS_BITS = 6,
    FACE_FAR_MEAN = 1024,
    FACE_COST = 8 /* vertex-frames */
};

/* The polygons that are coded. Vertices are 0 to bound - 1. before, after: the ends of each vertex's open sides; -1:
 * none. The next face is `face`; it begins at corner `first`, that before it, of `count` corners, at `previous`. */
typedef struct {
    const ath_polygons *shape;
    uint32_t *counts; /* null if all faces have as many corners */
    int32_t *corners;
    int32_t (*before)[FACE_SIDES], (*after)[FACE_SIDES];
    int32_t bound;
    uint32_t most; /* most corners of a face */
    uint32_t face, first, previous, count;
} faces_list;

typedef struct {
    ath_coder coder;
    faces_list list;
    ath_context repeats[FACE_RUNS];                            /* by how long the repetition has held */
    ath_context guessed[FACE_GUESSES][FACE_PLACES][FACE_WAYS]; /* by how the corner before was coded */
    ath_context is_recent[FACE_PLACES], recent[FACE_PLACES][1 << FACE_RECENT_BITS];
    ath_context same_count[1 << FACE_COUNTS_BITS];
    number_model count, far[3];
    uint32_t far_mean[3], count_mean, counts_seen;
    uint32_t last[2][1 << FACE_TABLE_BITS]; /* by the hash of the last ways: the corner that followed them */
    uint32_t followed, run; /* long repetition: the corner that it repeats next, and for how long it has held */
    int32_t next, way;      /* highest vertex so far + 1; how the last corner was coded */
} faces_model;

/* The open sides of each vertex stand behind the model. The types of vertices and counts bound their values. */
static void start_faces(faces_model *model, const ath_polygons *shape, int32_t vertex_count, uint32_t *counts,
                        int32_t *corners)
{
    int32_t (*before)[FACE_SIDES] = (int32_t (*)[FACE_SIDES])(void *)(model + 1), (*after)[FACE_SIDES];
    int32_t bits = ath_bits_of_type(shape->count_type), bound = ath_vertices_of_type(shape->index_type, vertex_count);
    uint32_t most = shape->is_mixed && bits < 31 ? (1u << bits) - 1 : UINT32_MAX, count = counts ? 3 : shape->columns;
    faces_list list = {shape, counts, corners, before, after = before + vertex_count, bound, most, 0, 0, 0, count};
    memset(model, 0, sizeof *model);
    model->list = list;
    for (size_t v = 0; v < (size_t)bound; v++)
        for (int32_t s = 0; s < FACE_SIDES; s++) before[v][s] = after[v][s] = -1;
    for (int32_t i = 0; i < FACE_RUNS; i++) context_init(&model->repeats[i], 60000);
    for (int32_t g = 0; g < FACE_GUESSES; g++)
        for (int32_t j = 0; j < FACE_PLACES; j++)
            for (int32_t w = 0; w < FACE_WAYS; w++) context_init(&model->guessed[g][j][w], 16384);
    for (int32_t j = 0; j < FACE_PLACES; j++) {
        context_init(&model->is_recent[j], 32768);
        for (int32_t i = 0; i < 1 << FACE_RECENT_BITS; i++) context_init(&model->recent[j][i], 32768);
    }
    for (int32_t i = 0; i < 1 << FACE_COUNTS_BITS; i++) context_init(&model->same_count[i], 49152);
    number_model_init(&model->count);
    for (int32_t j = 0; j < 3; j++) {
        number_model_init(&model->far[j]);
        model->far_mean[j] = FACE_FAR_MEAN;
    }
    model->count_mean = 64;
}

/* Hashes the `length` ways before corner i. */
static uint32_t face_hash(const int32_t *corners, uint32_t i, uint32_t length)
{
    uint32_t hash = 0;
    for (uint32_t k = i - length; k < i; k++)
        hash = (hash + (uint32_t)(corners[k] - corners[k - 1]) + 1u) * 0x9E3779B1u;
    return hash >> (32 - FACE_TABLE_BITS);
}

/* Repeats the way to corner `from`. Returns the vertex; -1: none. */
static int32_t face_repeated(const faces_list *faces, uint32_t i, uint32_t from)
{
    if (from == 0) return -1;
    int64_t vertex = (int64_t)faces->corners[i - 1] + faces->corners[from] - faces->corners[from - 1];
    return vertex >= 0 && vertex < faces->bound ? (int32_t)vertex : -1;
}

/* Fills guesses for corner j of the face that begins at corner `first`. The face before begins at `previous`. */
static void face_guesses(const faces_model *model, const faces_list *faces, uint32_t first, uint32_t j,
                         uint32_t previous, int32_t repeated, int32_t guesses[FACE_GUESSES])
{
    const int32_t *corners = faces->corners;
    int32_t k = 2;
    guesses[0] = repeated;
    guesses[1] = model->next < faces->bound ? model->next : -1;
    if (j > 0) {
        int32_t from = corners[first + j - 1], start = corners[first];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->before[from][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->after[start][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->after[from][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->before[start][s];
    } else if (first > 0) {
        int32_t start = corners[previous], end = corners[first - 1];
        guesses[k++] = start;
        guesses[k++] = end;
        guesses[k++] = corners[previous + (first - previous > 1)];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->after[start][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->before[start][s];
    }
    while (k < FACE_GUESSES) guesses[k++] = -1;
}

/* Codes a vertex by its difference from another. */
static int32_t code_far(ath_coder *coder, faces_model *model, const faces_list *faces, int32_t j, int32_t about,
                        int32_t vertex)
{
    int32_t difference = code_signed(coder, &model->far[j], model->far_mean[j], ENCODING ? vertex - about : 0);
    model->far_mean[j] = averaged(model->far_mean[j], difference);
    return difference < -about || difference >= faces->bound - about ? -1 : about + difference;
}

/* Codes the vertex of corner j of a face; -1: it is not valid. */
static int32_t code_corner(ath_coder *coder, faces_model *model, const faces_list *faces, uint32_t first, uint32_t j,
                           uint32_t previous, uint32_t last)
{
    uint32_t i = first + j;
    int32_t guesses[FACE_GUESSES], vertex = ENCODING ? faces->corners[i] : 0;
    int32_t expected = face_repeated(faces, i, model->followed);
    int32_t place = (int32_t)(j < 3 ? j : 3);
    if (expected >= 0) {
        ath_context *repeats = &model->repeats[model->run < FACE_RUNS ? model->run : FACE_RUNS - 1];
        if (coder_bit(coder, repeats, vertex == expected)) {
            model->way = FACE_REPEATED;
            return expected;
        }
    }
    face_guesses(model, faces, first, j, previous, face_repeated(faces, i, last), guesses);
    if (j > 1 && guesses[2] >= 0 && guesses[2] == guesses[2 + FACE_SIDES]) place = FACE_PLACES - 1;
    for (int32_t g = 0; g < FACE_GUESSES; g++) {
        int32_t guess = guesses[g], known = guess < 0 || guess == expected;
        for (int32_t k = 0; k < g; k++) known = known || guesses[k] == guess;
        if (!known && coder_bit(coder, &model->guessed[g][place][model->way], vertex == guess)) {
            model->way = 1 + g;
            return guess;
        }
    }
    uint32_t most = i < 1u << FACE_RECENT_BITS ? i : 1u << FACE_RECENT_BITS, back = 0;
    if (ENCODING)
        while (back < most && faces->corners[i - 1 - back] != vertex) back++;
    if (coder_bit(coder, &model->is_recent[place], back < most)) {
        uint32_t built = 1;
        for (int32_t bit = FACE_RECENT_BITS - 1; bit >= 0; bit--)
            built = built << 1 | (uint32_t)coder_bit(coder, &model->recent[place][built], (int)(back >> bit & 1));
        back = built - (1u << FACE_RECENT_BITS);
        model->way = FACE_RECENT;
        return back < i ? faces->corners[i - 1 - back] : -1;
    }
    model->way = FACE_FAR;
    uint32_t about = j > 0 ? i - 1 : previous;
    return code_far(coder, model, faces, ath_min(place, 2), i > 0 ? faces->corners[about] : 0, vertex);
}

/* Notes corner i, which the long repetition expected to be `expected`. */
static void face_note(faces_model *model, const faces_list *faces, uint32_t i, int32_t expected)
{
    int32_t vertex = faces->corners[i];
    if (vertex >= model->next) model->next = vertex + 1;
    if (model->followed > 0 && vertex == expected) {
        model->followed++;
        model->run++;
    } else {
        model->followed = model->run = 0;
    }
}

/* Returns the last corner that followed the same ways as corner i, which takes its place. */
static uint32_t face_seen(faces_model *model, const faces_list *faces, uint32_t i, int32_t table, uint32_t length)
{
    if (i <= length) return 0;
    uint32_t *entry = &model->last[table][face_hash(faces->corners, i, length)], before = *entry;
    *entry = i;
    return before;
}

static int close_side(int32_t ends[FACE_SIDES], int32_t end)
{
    int32_t at = 0;
    while (at < FACE_SIDES && ends[at] != end) at++;
    if (at == FACE_SIDES) return 0;
    for (; at + 1 < FACE_SIDES; at++) ends[at] = ends[at + 1];
    ends[FACE_SIDES - 1] = -1;
    return 1;
}

static void open_side(int32_t ends[FACE_SIDES], int32_t end)
{
    for (int32_t at = FACE_SIDES - 1; at > 0; at--) ends[at] = ends[at - 1];
    ends[0] = end;
}

/* Closes a side that is open in the opposite direction, or in the same one; else opens it. */
static void faces_side(const faces_list *faces, int32_t from, int32_t to)
{
    int closed = close_side(faces->after[to], from) | close_side(faces->before[from], to);
    if (!closed) closed = close_side(faces->after[from], to) | close_side(faces->before[to], from);
    if (closed) return;
    open_side(faces->after[from], to);
    open_side(faces->before[to], from);
}

static int code_face(ath_coder *coder, faces_model *model, const faces_list *faces, uint32_t first, uint32_t count,
                     uint32_t previous)
{
    for (uint32_t j = 0; j < count; j++) {
        uint32_t i = first + j, of_long = face_seen(model, faces, i, 0, FACE_LONG);
        uint32_t of_short = face_seen(model, faces, i, 1, FACE_SHORT);
        if (model->followed == 0) model->followed = of_long;
        int32_t expected = face_repeated(faces, i, model->followed);
        faces->corners[i] = code_corner(coder, model, faces, first, j, previous, of_short);
        if (faces->corners[i] < 0) return 0;
        face_note(model, faces, i, expected);
    }
    for (uint32_t j = 0; j + 1 < count; j++)
        faces_side(faces, faces->corners[first + j], faces->corners[first + j + 1]);
    if (count > 2) faces_side(faces, faces->corners[first + count - 1], faces->corners[first]);
    return 1;
}

static uint32_t code_face_count(ath_coder *coder, faces_model *model, uint32_t before, uint32_t count)
{
    int same = coder_bit(coder, &model->same_count[model->counts_seen], count == before);
    model->counts_seen = (model->counts_seen << 1 | (uint32_t)same) & ((1u << FACE_COUNTS_BITS) - 1);
    if (same) return before;
    count = code_unsigned(coder, &model->count, model->count_mean, count);
    model->count_mean = averaged(model->count_mean, (int32_t)count);
    return count;
}

/* Returns 1; 0: the stream is not valid; ATH_MORE: the budget is spent. */
static int code_faces(faces_model *model, int32_t *cost)
{
    ath_coder *coder = &model->coder;
    faces_list *faces = &model->list;
    for (; faces->face < faces->shape->face_count; faces->face++) {
        uint32_t *own = faces->counts ? faces->counts + faces->face : 0, first = faces->first;
        if (!ath_spend(cost, FACE_COST)) return ATH_MORE;
        if (own) faces->count = *own = code_face_count(coder, model, faces->count, ENCODING ? *own : 0);
        if (faces->count > faces->shape->corner_count - first || faces->count > faces->most
            || !code_face(coder, model, faces, first, faces->count, faces->previous))
            return 0;
        if (faces->count > 0) faces->previous = first;
        faces->first += faces->count;
    }
    return faces->first == faces->shape->corner_count;
}

#endif
