/* Polygons as the coding of a connected rest pose needs them (FORMAT.md, "Connected rest poses"). */
#ifndef ATH_MODEL_MESH_H
#define ATH_MODEL_MESH_H

#include "bits/platform.h"

/* Largest numbers of corners and faces per vertex for a connected rest pose, which keep the time of opening linear. */
enum { MESH_CORNERS = 8, MESH_FACES = 4 };

/* `corners` holds the vertex of each corner in file order, `opposite` the corner that completes its parallelogram (-1:
 * none). The corners of vertex v are at[first[v]] to at[first[v + 1] - 1]. */
typedef struct ath_mesh {
    int32_t vertex_count, corner_count;
    int32_t *corners, *opposite, *first, *at;
    uint8_t *place;        /* place of each corner in its face, for ath_next_corner and ath_corner_before */
    int32_t *order, *rank; /* the vertices in the order of coding, and its inverse */
    int32_t *from;         /* the neighbour that each vertex was coded from */
    int32_t *work;         /* scratch of decoding and building */
} ath_mesh;

/* Return the corner after, and before, one in its face; -1: none. Faces of more than four corners are open lines. */
ATH_INLINE int32_t ath_next_corner(const ath_mesh *mesh, int32_t corner)
{
    static const int8_t jumps[4] = {0, 1, -2, -3};
    int32_t jump = jumps[mesh->place[corner] & 3];
    return jump ? corner + jump : -1;
}

ATH_INLINE int32_t ath_corner_before(const ath_mesh *mesh, int32_t corner)
{
    static const int8_t jumps[4] = {0, -1, 2, 3};
    int32_t jump = jumps[mesh->place[corner] >> 2 & 3];
    return jump ? corner + jump : -1;
}

ATH_INLINE int ath_serves_rest(const ath_polygons *shape, int32_t vertex_count)
{
    return shape->corner_count <= MESH_CORNERS * (uint64_t)vertex_count
           && shape->face_count <= MESH_FACES * (uint64_t)vertex_count;
}

/* Returns the int32_t that building needs as `work`. */
uint64_t ath_mesh_work(uint64_t vertex_count, uint64_t corner_count);
/* Places the arrays of a mesh of at most `corner_count` corners. */
void ath_carve_mesh(ath_mesh *mesh, ath_arena *arena, uint64_t vertex_count, uint64_t corner_count,
                    uint64_t work_bytes);
/* Does one of MESH_PARTS parts of building the mesh of faces in source order. counts: null if all have shape->columns
 * corners. vertex_of: of each vertex of the source, the one in file order. `corners` and `counts` must not be in the
 * mesh's memory. */
enum { MESH_PARTS = 3 };
ATH_ENCODER_API void ath_build_mesh(ath_mesh *mesh, int32_t part, const ath_polygons *shape, const uint32_t *counts,
                                    const int32_t *corners, const int32_t *vertex_of);
#ifdef ATH_ENCODER
/* Returns the bytes of a mesh's memory, which ath_place_mesh begins with the struct itself. */
ATH_API size_t ath_mesh_size(int32_t vertex_count, int32_t corner_count);
ATH_API void ath_place_mesh(void *memory, int32_t vertex_count, int32_t corner_count);
#endif

#endif
