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
    FACE_PLACES = 5,   /* first, second, third, later corners, and those where two open sides agree */
    FACE_MEMBERS = 16, /* vertices of a place that a guess of it may mean */
    FACE_MEMBER_CONTEXTS = 4,
    FACE_COUNTS_BITS = 6,
    FACE_FAR_MEAN = 1024,
    FACE_COST = 8 /* vertex-frames */
};

/* The vertices of each place: those that were corners, the last one first, then the others by number. */
typedef struct {
    int32_t *first, *next, *last; /* of each place; behind, and in front of, each vertex (-1: none) */
    uint8_t *used;                /* whether a vertex was a corner */
} face_members;

/* The polygons that are coded. Vertices are 0 to bound - 1. before, after: the places at the ends of each place's open
 * sides; -1: none. The next face is `face`; it begins at corner `first`, that before it, of `count` corners, at
 * `previous`. */
typedef struct {
    const ath_polygons *shape;
    uint32_t *counts; /* null if all faces have as many corners */
    int32_t *corners;
    const int32_t *places; /* of each vertex; null: each is its own */
    int32_t (*before)[FACE_SIDES], (*after)[FACE_SIDES];
    face_members members; /* where there are places */
    int32_t bound;
    uint32_t most; /* most corners of a face */
    uint32_t face, first, previous, count;
    int32_t has_no_sides; /* whether an encoder codes vertices as if guesses of places did not hold */
    int32_t is_in_turn;   /* whether each number but the next one has been there before, as in PLACES */
} faces_list;

typedef struct {
    ath_coder coder;
    faces_list list;
    ath_context repeats[FACE_RUNS];                            /* by how long the repetition has held */
    ath_context guessed[FACE_GUESSES][FACE_PLACES][FACE_WAYS]; /* by how the corner before was coded */
    ath_context is_recent[FACE_PLACES], recent[FACE_PLACES][1 << FACE_RECENT_BITS];
    ath_context is_member[2][2]
                         [FACE_MEMBER_CONTEXTS]; /* by whether the last corner's vertex, and this one, were used */
    ath_context same_count[1 << FACE_COUNTS_BITS];
    number_model count, far[3];
    uint32_t far_mean[3], count_mean, counts_seen;
    uint32_t last[2][1 << FACE_TABLE_BITS]; /* by the hash of the last ways: the corner that followed them */
    uint32_t followed, run; /* long repetition: the corner that it repeats next, and for how long it has held */
    int32_t next, way;      /* highest vertex so far + 1; how the last corner was coded */
    int32_t was_used;       /* whether the vertex of the last corner had been one before */
} faces_model;

ATH_INLINE int32_t face_place(const faces_list *faces, int32_t vertex)
{
    return faces->places ? faces->places[vertex] : vertex;
}

/* Places what stands behind the model, or only counts it if `model` is null. Returns the bytes of all. */
static uint64_t carve_faces(faces_model *model, uint64_t vertex_count, uint64_t place_count, faces_list *list)
{
    ath_arena arena = {(uint8_t *)model, 0};
    ath_take(&arena, sizeof *model);
    list->before = (int32_t (*)[FACE_SIDES])ath_take(&arena, place_count * FACE_SIDES * sizeof(int32_t));
    list->after = (int32_t (*)[FACE_SIDES])ath_take(&arena, place_count * FACE_SIDES * sizeof(int32_t));
    if (vertex_count == place_count) return arena.used;
    list->members.first = (int32_t *)ath_take(&arena, place_count * sizeof(int32_t));
    list->members.next = (int32_t *)ath_take(&arena, vertex_count * sizeof(int32_t));
    list->members.last = (int32_t *)ath_take(&arena, vertex_count * sizeof(int32_t));
    list->members.used = (uint8_t *)ath_take(&arena, vertex_count);
    return arena.used;
}

static void put_first(face_members *members, int32_t place, int32_t vertex)
{
    int32_t before = members->first[place];
    members->first[place] = vertex;
    members->next[vertex] = before;
    members->last[vertex] = -1;
    if (before >= 0) members->last[before] = vertex;
}

static void list_members(face_members *members, const int32_t *places, int32_t vertex_count, int32_t place_count)
{
    memset(members->used, 0, (size_t)vertex_count);
    for (int32_t p = 0; p < place_count; p++) members->first[p] = -1;
    for (int32_t v = vertex_count - 1; v >= 0; v--) put_first(members, places[v], v);
}

/* places: of each vertex, below place_count; null if each is its own. The types of vertices and counts bound their
 * values. */
static void start_faces(faces_model *model, const ath_polygons *shape, int32_t vertex_count, const int32_t *places,
                        int32_t place_count, uint32_t *counts, int32_t *corners)
{
    int32_t bits = ath_bits_of_type(shape->count_type);
    faces_list list;
    memset(model, 0, sizeof *model);
    memset(&list, 0, sizeof list);
    carve_faces(model, (uint64_t)vertex_count, (uint64_t)place_count, &list);
    list.shape = shape;
    list.counts = counts;
    list.corners = corners;
    list.places = vertex_count > place_count ? places : 0;
    list.bound = ath_vertices_of_type(shape->index_type, vertex_count);
    list.most = shape->is_mixed && bits < 31 ? (1u << bits) - 1 : UINT32_MAX;
    list.count = counts ? 3 : shape->columns;
    if (list.places) list_members(&list.members, places, vertex_count, place_count);
    for (size_t p = 0; p < (size_t)place_count; p++)
        for (int32_t s = 0; s < FACE_SIDES; s++) list.before[p][s] = list.after[p][s] = -1;
    model->list = list;
    for (int32_t w = 0; w < 2; w++)
        for (int32_t u = 0; u < 2; u++)
            for (int32_t i = 0; i < FACE_MEMBER_CONTEXTS; i++) context_init(&model->is_member[w][u][i], 32768);
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

/* Fills guesses for corner j of the face that begins at corner `first`: two vertices, then places. The face before begins
 * at `previous`. */
static void face_guesses(const faces_model *model, const faces_list *faces, uint32_t first, uint32_t j,
                         uint32_t previous, int32_t repeated, int32_t guesses[FACE_GUESSES])
{
    const int32_t *corners = faces->corners;
    int32_t k = 2;
    guesses[0] = repeated;
    guesses[1] = model->next < faces->bound ? model->next : -1;
    if (j > 0) {
        int32_t from = face_place(faces, corners[first + j - 1]), start = face_place(faces, corners[first]);
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->before[from][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->after[start][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->after[from][s];
        for (int32_t s = 0; s < FACE_SIDES; s++) guesses[k++] = faces->before[start][s];
    } else if (first > 0) {
        int32_t start = face_place(faces, corners[previous]), end = face_place(faces, corners[first - 1]);
        guesses[k++] = start;
        guesses[k++] = end;
        guesses[k++] = face_place(faces, corners[previous + (first - previous > 1)]);
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

/* Returns whether a vertex is one of those that a guess of its place may mean. */
static int is_near(const face_members *members, int32_t place, int32_t vertex)
{
    int32_t member = members->first[place];
    for (int32_t i = 1; i < FACE_MEMBERS && member >= 0 && member != vertex; i++) member = members->next[member];
    return member == vertex;
}

/* Codes which of the vertices of a place it is. */
static int32_t code_member(ath_coder *coder, faces_model *model, const face_members *members, int32_t place,
                           int32_t vertex)
{
    int32_t member = members->first[place];
    for (int32_t i = 0; i < FACE_MEMBERS - 1 && members->next[member] >= 0; i++) {
        ath_context *context =
            &model->is_member[model->was_used][members->used[member]][ath_min(i, FACE_MEMBER_CONTEXTS - 1)];
        if (coder_bit(coder, context, vertex == member)) break;
        member = members->next[member];
    }
    return member;
}

/* Codes whether the vertex is one of those at a place that is guess g, and which. Returns it; -1: it is not. */
static int32_t code_at_place(ath_coder *coder, faces_model *model, const faces_list *faces, ath_context *is_there,
                             int32_t place, int32_t vertex)
{
    if (!faces->places) return coder_bit(coder, is_there, vertex == place && !faces->has_no_sides) ? place : -1;
    int is_met =
        ENCODING && !faces->has_no_sides && faces->places[vertex] == place && is_near(&faces->members, place, vertex);
    return coder_bit(coder, is_there, is_met) ? code_member(coder, model, &faces->members, place, vertex) : -1;
}

/* Returns whether an earlier guess was all that guess g of a place can mean. expected: a vertex that was guessed, or
 * -1. */
static int is_guessed(const faces_list *faces, const int32_t guesses[FACE_GUESSES], int32_t g, int32_t expected)
{
    int32_t place = guesses[g], only = faces->places ? faces->members.first[place] : place;
    for (int32_t k = 2; k < g; k++)
        if (guesses[k] == place) return 1;
    if (faces->places && faces->members.next[only] >= 0) return 0;
    return only == expected || only == guesses[0] || only == guesses[1];
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
        ath_context *is_there = &model->guessed[g][place][model->way];
        int32_t guess = guesses[g], met;
        if (guess < 0
            || (g < 2 ? guess == expected || (g == 1 && guess == guesses[0]) : is_guessed(faces, guesses, g, expected)))
            continue;
        met = g < 2 ? (coder_bit(coder, is_there, vertex == guess) ? guess : -1)
                    : code_at_place(coder, model, faces, is_there, guess, vertex);
        if (met < 0) continue;
        model->way = 1 + g;
        return met < faces->bound ? met : -1;
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

/* Puts a vertex in front of those of its place. */
static void note_member(faces_model *model, int32_t vertex)
{
    face_members *members = &model->list.members;
    int32_t place = model->list.places[vertex], before = members->last[vertex], behind = members->next[vertex];
    model->was_used = members->used[vertex];
    members->used[vertex] = 1;
    if (before < 0) return;
    members->next[before] = behind;
    if (behind >= 0) members->last[behind] = before;
    put_first(members, place, vertex);
}

/* Notes corner i, which the long repetition expected to be `expected`. */
static void face_note(faces_model *model, const faces_list *faces, uint32_t i, int32_t expected)
{
    int32_t vertex = faces->corners[i];
    if (vertex >= model->next) model->next = vertex + 1;
    if (faces->places) note_member(model, vertex);
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

/* Closes the side between two vertices if it is open in the opposite direction, or in the same one; else opens it. */
static void faces_side(const faces_list *faces, int32_t start, int32_t end)
{
    int32_t from = face_place(faces, start), to = face_place(faces, end);
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
        if (faces->corners[i] < 0 || (faces->is_in_turn && faces->corners[i] > model->next)) return 0;
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
        if (faces->is_in_turn && faces->count > faces->shape->corner_count - first)
            faces->count = faces->shape->corner_count - first;
        if (faces->count > faces->shape->corner_count - first || faces->count > faces->most
            || !code_face(coder, model, faces, first, faces->count, faces->previous))
            return 0;
        if (faces->count > 0) faces->previous = first;
        faces->first += faces->count;
    }
    return faces->first == faces->shape->corner_count && (!faces->is_in_turn || model->next == faces->bound);
}

/* Begins PLACES (FORMAT.md, "PLACES"). Fills the shape, which has to stay. */
static void start_places(faces_model *model, ath_polygons *shape, uint32_t columns, int32_t vertex_count,
                         int32_t place_count, int32_t *places)
{
    memset(shape, 0, sizeof *shape);
    shape->index_type = 2; /* holds all */
    shape->columns = columns;
    shape->corner_count = (uint32_t)vertex_count;
    shape->face_count = ((uint32_t)vertex_count + columns - 1) / columns;
    start_faces(model, shape, place_count, 0, place_count, 0, places);
    model->list.is_in_turn = 1;
}

#endif
