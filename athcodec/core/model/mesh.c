#include "model/mesh.h"

enum { MESH_STACKS = 4, UNTOUCHED = 255 };

uint64_t ath_mesh_work(uint64_t vertex_count, uint64_t corner_count)
{
    uint64_t sides = 2 * corner_count + vertex_count + 1, stacks = MESH_STACKS * vertex_count + vertex_count / 4 + 1;
    return sides > stacks ? sides : stacks;
}

void ath_carve_mesh(ath_mesh *mesh, ath_arena *arena, uint64_t vertex_count, uint64_t corner_count, uint64_t work_bytes)
{
    mesh->vertex_count = (int32_t)vertex_count;
    mesh->corner_count = 0;
    mesh->corners = (int32_t *)ath_take(arena, corner_count * sizeof(int32_t));
    mesh->opposite = (int32_t *)ath_take(arena, corner_count * sizeof(int32_t));
    mesh->at = (int32_t *)ath_take(arena, corner_count * sizeof(int32_t));
    mesh->place = (uint8_t *)ath_take(arena, corner_count);
    mesh->first = (int32_t *)ath_take(arena, (vertex_count + 1) * sizeof(int32_t));
    mesh->order = (int32_t *)ath_take(arena, vertex_count * sizeof(int32_t));
    mesh->rank = (int32_t *)ath_take(arena, vertex_count * sizeof(int32_t));
    mesh->from = (int32_t *)ath_take(arena, vertex_count * sizeof(int32_t));
    mesh->work = (int32_t *)ath_take(arena, work_bytes);
}

static void place_face(ath_mesh *mesh, uint32_t first, uint32_t count)
{
    uint8_t *place = mesh->place + first;
    if (count == 0) return;
    for (uint32_t j = 0; j < count; j++) place[j] = 1 | 1 << 2;
    int closed = count == 3 || count == 4;
    place[0] = (uint8_t)(1 | (closed ? count - 1 : 0) << 2);
    place[count - 1] = (uint8_t)((closed ? count - 1 : 0) | 1 << 2);
    if (count == 1) place[0] = 0;
    for (uint32_t j = 0; j < count; j++) mesh->opposite[first + j] = count == 4 ? (int32_t)(first + (j + 2) % 4) : -1;
}

static void list_corners(ath_mesh *mesh)
{
    int32_t n = mesh->vertex_count;
    memset(mesh->first, 0, ((size_t)n + 1) * sizeof *mesh->first);
    for (int32_t k = 0; k < mesh->corner_count; k++) mesh->first[mesh->corners[k] + 1]++;
    for (int32_t v = 0; v < n; v++) mesh->first[v + 1] += mesh->first[v];
    for (int32_t k = mesh->corner_count - 1; k >= 0; k--) {
        int32_t *left = mesh->order + mesh->corners[k]; /* not in use yet: serves to count placed corners */
        if (k == mesh->corner_count - 1) memset(mesh->order, 0, (size_t)n * sizeof *mesh->order);
        mesh->at[mesh->first[mesh->corners[k] + 1] - ++*left] = k;
    }
}

/* Fills the lower and the higher vertex of the side from a corner to the next. */
static void ends_of_side(const ath_mesh *mesh, int32_t corner, int32_t ends[2])
{
    int32_t a = mesh->corners[corner], b = mesh->corners[ath_next_corner(mesh, corner)];
    ends[0] = ath_min(a, b);
    ends[1] = ath_max(a, b);
}

/* Sorts sides by one end; the sort is stable. */
static void sort_sides(const ath_mesh *mesh, int32_t end, const int32_t *sides, int32_t count, int32_t *sorted,
                       int32_t *places)
{
    int32_t ends[2];
    memset(places, 0, ((size_t)mesh->vertex_count + 1) * sizeof *places);
    for (int32_t i = 0; i < count; i++) {
        ends_of_side(mesh, sides[i], ends);
        places[ends[end] + 1]++;
    }
    for (int32_t v = 0; v < mesh->vertex_count; v++) places[v + 1] += places[v];
    for (int32_t i = 0; i < count; i++) {
        ends_of_side(mesh, sides[i], ends);
        sorted[places[ends[end]]++] = sides[i];
    }
}

/* Two triangles that share a side are halves of a parallelogram. If more share it, they are paired in order. */
static void join_triangles(ath_mesh *mesh)
{
    int32_t *sides = mesh->work, *sorted = sides + mesh->corner_count, *places = sorted + mesh->corner_count;
    int32_t count = 0, here[2], there[2];
    for (int32_t k = 0; k < mesh->corner_count; k++)
        if (mesh->opposite[k] < 0 && ath_next_corner(mesh, k) >= 0 && ath_corner_before(mesh, k) >= 0
            && ath_next_corner(mesh, ath_next_corner(mesh, k)) == ath_corner_before(mesh, k))
            sides[count++] = k;
    sort_sides(mesh, 1, sides, count, sorted, places);
    sort_sides(mesh, 0, sorted, count, sides, places);
    for (int32_t i = 0; i + 1 < count; i++) {
        ends_of_side(mesh, sides[i], here);
        ends_of_side(mesh, sides[i + 1], there);
        if (here[0] != there[0] || here[1] != there[1]) continue;
        int32_t a = ath_corner_before(mesh, sides[i]), b = ath_corner_before(mesh, sides[i + 1]);
        mesh->opposite[a] = b;
        mesh->opposite[b] = a;
        i++;
    }
}

/* Vertices beside placed ones, by the parallelograms that they complete: none, one, two, more. */
typedef struct {
    int32_t *stack[MESH_STACKS], height[MESH_STACKS];
    uint8_t *state; /* UNTOUCHED, or the last stack that a vertex was put on */
} mesh_front;

static int is_placed(const ath_mesh *mesh, int32_t corner)
{
    return corner >= 0 && mesh->rank[mesh->corners[corner]] >= 0;
}

static void put_on(mesh_front *front, int32_t v, int32_t stack)
{
    front->state[v] = (uint8_t)stack;
    front->stack[stack][front->height[stack]++] = v;
}

/* Notes that a vertex of this corner's parallelogram has been placed. */
static void touch(const ath_mesh *mesh, mesh_front *front, int32_t corner, int is_beside)
{
    if (corner < 0 || is_placed(mesh, corner)) return;
    int32_t v = mesh->corners[corner];
    if (front->state[v] == UNTOUCHED && !is_beside) return;
    if (front->state[v] == UNTOUCHED) put_on(front, v, 0);
    if (front->state[v] < MESH_STACKS - 1 && is_placed(mesh, ath_corner_before(mesh, corner))
        && is_placed(mesh, ath_next_corner(mesh, corner)) && is_placed(mesh, mesh->opposite[corner]))
        put_on(front, v, front->state[v] + 1);
}

/* Returns the newest of the vertices that complete the most parallelograms; -1: none is left. */
static int32_t take_next(const ath_mesh *mesh, mesh_front *front)
{
    for (int32_t s = MESH_STACKS - 1; s >= 0; s--)
        while (front->height[s] > 0) {
            int32_t v = front->stack[s][--front->height[s]];
            if (mesh->rank[v] < 0) return v;
        }
    return -1;
}

static void order_vertices(ath_mesh *mesh)
{
    int32_t n = mesh->vertex_count, seed = 0;
    mesh_front front;
    memset(&front, 0, sizeof front);
    for (int32_t s = 0; s < MESH_STACKS; s++) front.stack[s] = mesh->work + (size_t)s * (size_t)n;
    front.state = (uint8_t *)(mesh->work + MESH_STACKS * (size_t)n);
    memset(front.state, UNTOUCHED, (size_t)n);
    for (int32_t v = 0; v < n; v++) mesh->rank[v] = -1;
    for (int32_t placed = 0; placed < n; placed++) {
        int32_t v = take_next(mesh, &front);
        if (v < 0) {
            while (mesh->rank[seed] >= 0) seed++;
            v = seed;
        }
        mesh->rank[v] = placed;
        mesh->order[placed] = v;
        for (int32_t i = mesh->first[v]; i < mesh->first[v + 1]; i++) {
            int32_t corner = mesh->at[i];
            touch(mesh, &front, ath_next_corner(mesh, corner), 1);
            touch(mesh, &front, ath_corner_before(mesh, corner), 1);
            touch(mesh, &front, mesh->opposite[corner], 0);
        }
    }
}

void ath_build_mesh(ath_mesh *mesh, int32_t part, const ath_polygons *shape, const uint32_t *counts,
                    const int32_t *corners, const int32_t *vertex_of)
{
    if (part == 1) join_triangles(mesh);
    if (part == 2) order_vertices(mesh);
    if (part > 0) return;
    uint32_t first = 0;
    mesh->corner_count = (int32_t)shape->corner_count;
    for (int32_t k = 0; k < mesh->corner_count; k++) mesh->corners[k] = vertex_of[corners[k]];
    for (uint32_t f = 0; f < shape->face_count; f++) {
        uint32_t count = counts ? counts[f] : shape->columns;
        place_face(mesh, first, count);
        first += count;
    }
    list_corners(mesh);
}

#ifdef ATH_ENCODER

static uint8_t *after_struct(void *memory) { return (uint8_t *)memory + ((sizeof(ath_mesh) + 15) & ~(size_t)15); }

size_t ath_mesh_size(int32_t vertex_count, int32_t corner_count)
{
    ath_mesh mesh;
    ath_arena arena = {0, 0};
    uint64_t vertices = (uint64_t)vertex_count, corners = (uint64_t)corner_count;
    ath_carve_mesh(&mesh, &arena, vertices, corners, ath_mesh_work(vertices, corners) * sizeof(int32_t));
    return ath_size_or_most(arena.used + (uint64_t)(after_struct(0) - (uint8_t *)0));
}

void ath_place_mesh(void *memory, int32_t vertex_count, int32_t corner_count)
{
    ath_arena arena = {after_struct(memory), 0};
    uint64_t vertices = (uint64_t)vertex_count, corners = (uint64_t)corner_count;
    ath_carve_mesh((ath_mesh *)memory, &arena, vertices, corners, ath_mesh_work(vertices, corners) * sizeof(int32_t));
}

#endif
