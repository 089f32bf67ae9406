/* An opened file, as opening, preparing and playing see it. */
#ifndef ATH_FILE_H
#define ATH_FILE_H

#include "file/container.h"
#include "model/mesh.h"
#include "model/plan.h"

/* The plant about a finer rest pose: the first layer, from level 1 on, or a refinement, whose pieces are all of its level. A
 * refinement without a rest pose of its own has that of the layer before, and its bases. */
typedef struct {
    ath_plan plan; /* plan.bases null: not built yet */
    ath_piece *pieces;
    ath_node *nodes; /* of the first layer */
    double *rest;    /* null: that of the layer before */
    int32_t *rest_steps;
    uint64_t bases_count; /* 0: those of the layer before, or not known yet */
    int32_t rest_known;
} ath_layer;

struct ath_file {
    ath_header header;
    ath_info info;
    ath_plan plan;
    ath_chunk *chunks;
    double *errors;   /* level_count x segment_count x ATH_MEASURES */
    uint8_t *joins;   /* level_count x segment_count, see ath_joins */
    uint8_t *repeats; /* frame_count, see ath_repeats */
    uint8_t *coded;   /* of each frame, which of the coded frames of its segment it shows */
    ath_clip *clips;
    char *names;  /* of the clips, NAME_BYTES each */
    float *seams; /* clip_count x full_level_count */
    ath_branch *branches;
    int32_t *branch_source, *vertex_source;
    double *times;
    double *rest;        /* the reference pose, relative to the origin */
    double *source_rest; /* the rest pose, where it is another or exact numbers, the file's or the host's, else null */
    ath_piece *pieces;
    ath_node *nodes;
    uint8_t *gaps;
    void *scratch;                                         /* of opening and building */
    double *bases;                                         /* null until ath_build */
    ath_mesh mesh;                                         /* where there are FACES */
    ath_mesh *connected;                                   /* it, where the rest pose is connected, else null */
    int32_t *rest_steps;                                   /* null where no layer refines the rest pose */
    ath_layer layers[ATH_LAYERS];                          /* first_layer to layer_count - 1 */
    double *waves[ATH_WAVE_KINDS][ATH_SEGMENT_FRAMES + 1]; /* of so many frames; null: no segment has any */
    uint64_t bases_count;
    int32_t rest_known;        /* 0 until the host gives it */
    int32_t source_rest_known; /* 0 until SOURCE_REST has been read */
    int32_t first_layer;       /* 0 where level 1 has a rest pose of its own, else 1 */
    int32_t rest_is_exact;     /* the reference pose is in the very numbers of source_rest */
    int32_t longest;           /* frames of the longest segment */
    int32_t has_joins;
    uint32_t stems_levels;              /* bit d: level d has STEMS */
    uint32_t affine_levels[ATH_LEVELS]; /* bit d of entry L: AFFINES of level d serve to show level L */
};

enum { ATH_END_FRAMES = 2 }; /* of a segment, that the next one is joined to */

/* Frames of a segment that are coded: that do not repeat the one before. */
int32_t ath_file_frames(const ath_file *file, int32_t segment);
/* The one before a segment in its clip; before the first of a loop of several its last; -1: none. */
int32_t ath_segment_before(const ath_file *file, int32_t segment);
/* How the positions that a level shows are joined: an entry of ath_joins. */
int32_t ath_join_at(const ath_file *file, int32_t segment, int32_t level);
const ath_clip *ath_file_clip(const ath_file *file, int32_t frame);
/* Of the stems of a segment, and of the maps of its nodes. */
const double *ath_file_waves(const ath_file *file, int32_t segment);
const double *ath_file_node_waves(const ath_file *file, int32_t segment);
const ath_chunk *ath_file_chunk(const ath_file *file, int32_t kind, int32_t level, int32_t segment);
/* Kinds whose one chunk of a level stands with segment 0 and serves all segments. */
ATH_INLINE int ath_is_shared(int32_t kind) { return kind == ATH_SHAPES || kind == ATH_REFINED_REST; }

/* Kinds that the end of a segment depends on, as what is joined to it takes it. */
ATH_INLINE int ath_shapes_end(int32_t kind) { return kind != ATH_CORRECTIONS && kind != ATH_EXACT; }

/* Levels that are not the source's very numbers. */
ATH_INLINE int32_t ath_lossy_levels(const ath_file *file) { return file->plan.height + 1 + file->header.layer_count; }

/* Whether it stores the level behind the last lossy one. */
ATH_INLINE int ath_file_is_lossless(const ath_file *file) { return file->header.level_count > ath_lossy_levels(file); }

/* The layer of precision of a level: 0 for those of the branch hierarchy. */
ATH_INLINE int32_t ath_layer_of(const ath_file *file, int32_t level)
{
    return ath_max(0, ath_min(level, ath_lossy_levels(file) - 1) - file->plan.height - 1);
}

ATH_INLINE int32_t ath_level_of_layer(const ath_file *file, int32_t layer) { return file->plan.height + 1 + layer; }

/* Of a layer, as it serves to show `level`. */
ATH_INLINE const ath_plan *ath_layer_plan(const ath_file *file, int32_t layer, int32_t level)
{
    return level > 0 && layer >= file->first_layer ? &file->layers[layer].plan : &file->plan;
}

ATH_INLINE const ath_plan *ath_level_plan(const ath_file *file, int32_t level)
{
    return ath_layer_plan(file, ath_layer_of(file, level), level);
}
/* Whether decoding a segment at `level` takes the chunk of this kind and level d. */
int ath_file_needs(const ath_file *file, int32_t kind, int32_t d, int32_t level);

#endif
