/* Fuzz target: the streams of the prelude, each from bytes of its own, and the plan that follows from them. The counts
 * come from the first bytes, so that no header stands between the fuzzer and the streams. */
#include "harness.h"
#include "streams/decode.h"

enum { HEAD = 16, MOST_VERTICES = 512, MOST_FRAMES = 1024 };

typedef struct {
    const uint8_t *at;
    size_t left;
} input;

static ath_bytes take(input *from, size_t size)
{
    ath_bytes taken = {from->at, size < from->left ? size : from->left};
    from->at += taken.size;
    from->left -= taken.size;
    return taken;
}

static size_t u16_at(const uint8_t *at) { return (size_t)at[0] | (size_t)at[1] << 8; }

/* A stream in memory of its own, so that reading beyond it is seen. */
static ath_bytes own(ath_bytes stream)
{
    stream.bytes = fuzz_copy(stream.bytes, stream.size);
    return stream;
}

static void drop(ath_bytes stream) { free((void *)(uintptr_t)stream.bytes); }

static void check_branches(const ath_branch *branches, int32_t count, int32_t vertices)
{
    for (int32_t b = 0; b < count; b++) {
        const ath_branch *branch = branches + b;
        REQUIRE(branch->parent < b && branch->count > 0, "parents come before their children");
        REQUIRE(branch->first + branch->count <= vertices, "stems are in range");
        REQUIRE(branch->subtree >= 1 && b + branch->subtree <= count, "subtrees are in range");
        REQUIRE((branch->parent < 0) == (branch->attach < 0), "what hangs, hangs on a vertex");
    }
}

/* Pieces and nodes of a hierarchy over a rest pose that may be anything finite. */
static void build_plan(ath_branch *branches, int32_t branch_count, int32_t vertices, const double *rest)
{
    ath_plan plan;
    memset(&plan, 0, sizeof plan);
    plan.vertex_count = vertices;
    plan.branch_count = branch_count;
    plan.branches = branches;
    plan.rest = rest;
    plan.piece_count = ath_count_pieces(branches, branch_count, vertices);
    plan.node_count = ath_count_nodes(branches, branch_count);
    size_t table_size = ath_basis_table_size(plan.piece_count);
    ath_piece *pieces = fuzz_memory((size_t)plan.piece_count * sizeof *pieces, 0xa5);
    ath_node *nodes = fuzz_memory((size_t)plan.node_count * sizeof *nodes, 0xa5);
    int32_t *memory = fuzz_memory((size_t)vertices * sizeof *memory, 0xa5);
    int32_t *table = fuzz_memory(table_size * sizeof *table, 0xa5);
    uint8_t *gaps = fuzz_memory((size_t)vertices, 0xa5);
    plan.pieces = pieces;
    plan.nodes = nodes;
    ath_build_plan(&plan, pieces, nodes, memory, 0);
    if (plan.height + 2 <= ATH_LEVELS) {
        int64_t count = ath_basis_layout(pieces, plan.piece_count, rest, gaps, table);
        REQUIRE(count <= 2 * (int64_t)ATH_PIECE_VERTICES * vertices, "bases are bounded by the vertices");
        double *bases = fuzz_memory((size_t)count * sizeof *bases, 0xa5);
        double *work = fuzz_memory(ATH_BASIS_WORK * sizeof *work, 0xa5);
        int32_t next = 0;
        ath_basis_fill(pieces, &next, plan.piece_count, 0, INT32_MAX, rest, 0, work, bases, 0);
        ath_plan_nodes(&plan, nodes, 0, INT32_MAX);
        free(work);
        free(bases);
    }
    free(gaps);
    free(table);
    free(memory);
    free(nodes);
    free(pieces);
}

/* Integers that overflow whatever is done with them: nothing may be, before they are written. */
static int32_t *integers(size_t count)
{
    int32_t *values = fuzz_memory(count * sizeof *values, 0);
    for (size_t i = 0; i < count; i++) values[i] = INT32_MIN;
    return values;
}

static int all_finite(const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!ath_is_finite(values[i])) return 0;
    return 1;
}

static double step_from(const uint8_t *at)
{
    double step;
    memcpy(&step, at, sizeof step);
    return ath_is_finite(step) && step > 0.0 ? step : 0.01;
}

static void decode_time(void *model, ath_bytes stream, int32_t frames)
{
    double *times = fuzz_memory((size_t)frames * sizeof *times, 0xa5);
    if (ath_decode_times(model, stream.bytes, stream.size, frames, times) == ATH_OK)
        REQUIRE(all_finite(times, (size_t)frames), "times that were accepted are finite");
    free(times);
}

static void decode_basis(void *model, ath_bytes stream, int32_t frames, int32_t rank)
{
    size_t count = (size_t)rank * (size_t)frames;
    int32_t *basis = integers(count);
    if (ath_decode_temporal(model, stream.bytes, stream.size, rank, frames, basis) == ATH_OK)
        for (size_t i = 0; i < count; i++) REQUIRE(abs(basis[i]) <= ATH_MOST_SAMPLE, "a basis keeps to its limit");
    free(basis);
}

/* A rest pose that is not exact, and one of a refinement about it: the same bytes at a smaller step. */
static int decode_coarse_pose(void *model, ath_bytes body, const ath_branch *branches, int32_t count, double step,
                              ath_mesh *mesh, int32_t vertices, double *rest)
{
    size_t numbers = 3 * (size_t)vertices;
    int32_t *steps = integers(numbers), *finer_steps = integers(numbers);
    double *finer = fuzz_memory(numbers * sizeof *finer, 0xa5);
    ath_start_rest(model, body, branches, count, step, mesh, NULL, NULL, steps, rest);
    int result = ath_decode_rest(model, NULL);
    if (result == ATH_OK && all_finite(rest, numbers)) {
        ath_start_rest(model, body, branches, count, step / 8.0, mesh, steps, rest, finer_steps, finer);
        ath_decode_rest(model, NULL);
    }
    free(finer);
    free(finer_steps);
    free(steps);
    return result;
}

/* Places of twice as many vertices from the bytes of a pose, whatever these are. */
static void decode_places(ath_bytes body, int32_t place_count)
{
    int32_t vertices = 2 * place_count, *places = integers((size_t)vertices), found = 0;
    void *memory = fuzz_memory(ath_faces_memory(place_count, place_count), 0xa5);
    ath_polygons shape;
    int result = ath_start_places(memory, body, &shape, vertices, place_count, places);
    if (result == ATH_OK) result = ath_decode_faces(memory, NULL);
    for (int32_t v = 0; result == ATH_OK && v < vertices; v++) {
        REQUIRE(places[v] >= 0 && places[v] <= found, "places are numbered in the order of their first vertices");
        found += places[v] == found;
    }
    REQUIRE(result != ATH_OK || found <= place_count, "there are no more places than are counted");
    free(memory);
    free(places);
}

/* Faces from the bytes of a pose, whatever these are, and the mesh of those that are accepted; null: none. */
static ath_mesh *decode_mesh(ath_mesh *mesh, ath_bytes body, int32_t vertices, const uint8_t *head, ath_arena *arena)
{
    ath_polygons shape = {0, 0, 0, head[7] & 1, 0, 2, 2};
    uint32_t size = (uint32_t)(head[8] % 6), faces = (uint32_t)(4 * vertices < 200 ? 4 * vertices : 200);
    shape.face_count = size > 0 && faces * size > 8 * (uint32_t)vertices ? 8 * (uint32_t)vertices / size : faces;
    shape.columns = size;
    shape.corner_count = shape.face_count * size;
    int32_t *corners = integers(shape.corner_count + 1);
    uint32_t *counts = shape.is_mixed ? (uint32_t *)integers(shape.face_count + 1) : NULL;
    void *memory = fuzz_memory(ath_faces_memory(vertices, vertices), 0xa5);
    int32_t *order = integers((size_t)vertices);
    for (int32_t v = 0; v < vertices; v++) order[v] = vertices - 1 - v;
    ath_start_faces(memory, body, &shape, vertices, NULL, vertices, counts, corners);
    int result = ath_decode_faces(memory, NULL);
    for (uint32_t i = 0; result == ATH_OK && i < shape.corner_count; i++)
        REQUIRE(corners[i] >= 0 && corners[i] < vertices, "corners are vertices");
    if (result == ATH_OK) {
        uint64_t work = ath_mesh_work((uint64_t)vertices, shape.corner_count) * sizeof(int32_t);
        ath_carve_mesh(mesh, arena, (uint64_t)vertices, shape.corner_count, work);
        arena->base = fuzz_memory((size_t)arena->used, 0xa5);
        arena->used = 0;
        ath_carve_mesh(mesh, arena, (uint64_t)vertices, shape.corner_count, work);
        for (int32_t i = 0; i < MESH_PARTS; i++) ath_build_mesh(mesh, i, &shape, counts, corners, order);
    }
    free(order);
    free(memory);
    free(counts);
    free(corners);
    return result == ATH_OK ? mesh : NULL;
}

static int decode_pose(void *model, ath_bytes body, const ath_branch *branches, int32_t count, const uint8_t *head,
                       int32_t vertices, double *rest)
{
    ath_mesh mesh;
    ath_arena arena = {NULL, 0};
    ath_mesh *connected = decode_mesh(&mesh, body, vertices, head, &arena);
    int exact = head[6] & 1, is_float64 = head[6] & 2, result;
    if (exact)
        result = ath_decode_exact_rest(model, body.bytes, body.size, branches, count, connected, is_float64, rest);
    else
        result = decode_coarse_pose(model, body, branches, count, step_from(head + 6), connected, vertices, rest);
    free(arena.base);
    return result;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < HEAD) return 0;
    input rest_of_input = {data + HEAD, size - HEAD};
    int32_t vertices = 1 + (int32_t)(u16_at(data) % MOST_VERTICES);
    int32_t branch_count = 1 + (int32_t)(u16_at(data + 2) % (size_t)vertices);
    int32_t frames = 1 + (int32_t)(u16_at(data + 4) % MOST_FRAMES), method = data[6];
    ath_bytes hierarchy = own(take(&rest_of_input, u16_at(data + 14)));
    ath_bytes body = own(take(&rest_of_input, rest_of_input.left));
    void *model = fuzz_memory(ath_prelude_model_size(), 0x7f);
    if (method & 16) decode_places(body, vertices);
    if (method & 4) decode_time(model, body, frames);
    int32_t shorter = ath_min(frames, ATH_SEGMENT_FRAMES);
    if (method & 8) decode_basis(model, body, shorter, 1 + data[7] % shorter);
    ath_branch *branches = fuzz_memory((size_t)branch_count * sizeof *branches, 0);
    int32_t *branch_source = integers((size_t)branch_count), *vertex_source = integers((size_t)vertices);
    double *rest = fuzz_memory(3 * (size_t)vertices * sizeof *rest, 0xa5);
    if (ath_decode_hierarchy(model, hierarchy.bytes, hierarchy.size, branch_count, vertices, branches, branch_source,
                             vertex_source)
        == ATH_OK) {
        check_branches(branches, branch_count, vertices);
        int result = decode_pose(model, body, branches, branch_count, data, vertices, rest);
        int finite = result == ATH_OK && all_finite(rest, 3 * (size_t)vertices);
        REQUIRE(finite || result != ATH_OK || !(method & 1), "exact numbers are finite");
        if (finite) build_plan(branches, branch_count, vertices, rest);
    }
    free(rest);
    free(vertex_source);
    free(branch_source);
    free(branches);
    free(model);
    drop(hierarchy);
    drop(body);
    return 0;
}
