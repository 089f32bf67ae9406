/* Decodes the streams of the prelude and of a learned time basis. All functions return ATH_OK or ATH_BAD_CHUNK. */
#ifndef ATH_STREAMS_DECODE_H
#define ATH_STREAMS_DECODE_H

#include "container/container.h"
#include "model/mesh.h"
#include "model/plan.h"

/* Returns the bytes of scratch memory that any of these needs as `model`. */
size_t ath_prelude_model_size(void);

/* branches: zero on entry. */
int ath_decode_hierarchy(void *model, const uint8_t *bytes, size_t size, int32_t branch_count, int32_t vertex_count,
                         ath_branch *branches, int32_t *branch_source, int32_t *vertex_source);
/* Begins to decode a rest pose, which ath_decode_rest goes on with for a budget (null: none) while it returns ATH_MORE.
 * mesh: null unless the pose is connected. coarse, before: integers and positions of the layer before; null for the
 * first layer. steps: filled with the integers; may be null. */
void ath_start_rest(void *model, ath_bytes stream, const ath_branch *branches, int32_t branch_count, double step,
                    ath_mesh *mesh, const int32_t *coarse, const double *before, int32_t *steps, double *rest);
int ath_decode_rest(void *model, int32_t *cost);
/* Decodes the source's rest pose about the reference pose, both less the origin. turns: scratch, branch_count x 9. */
int ath_decode_source_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                           int32_t branch_count, double step, const double *reference, double *turns, double *rest);
/* Decodes positions as stored, floats or (is_float64) doubles, with the origin. All are finite. */
int ath_decode_exact_rest(void *model, const uint8_t *bytes, size_t size, const ath_branch *branches,
                          int32_t branch_count, const ath_mesh *mesh, int is_float64, double *rest);
/* Begins to decode corners in source order, or the place of each vertex, which ath_decode_faces goes on with for a
 * budget while it returns ATH_MORE. memory: ath_faces_memory bytes. places: of each vertex, below place_count; not read
 * if there are as many. counts: null unless shape->is_mixed is 1. ath_start_places fills the shape; both need it until
 * they are done. */
ATH_ENCODER_API uint64_t ath_faces_memory(int32_t vertex_count, int32_t place_count);
void ath_start_faces(void *memory, ath_bytes stream, const ath_polygons *shape, int32_t vertex_count,
                     const int32_t *places, int32_t place_count, uint32_t *counts, int32_t *corners);
int ath_start_places(void *memory, ath_bytes chunk, ath_polygons *shape, int32_t vertex_count, int32_t place_count,
                     int32_t *places);
int ath_decode_faces(void *memory, int32_t *cost);
/* Times are finite. The caller checks that they increase. */
int ath_decode_times(void *model, const uint8_t *bytes, size_t size, int32_t frame_count, double *times);
/* rank x frames integers; ATH_MOST_SAMPLE stands for 1. */
int ath_decode_temporal(void *model, const uint8_t *bytes, size_t size, int32_t rank, int32_t frames, int32_t *basis);

#endif
