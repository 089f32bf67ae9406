/* An opened file, as opening, preparing and playing see it. */
#ifndef ATH_FILE_FILE_H
#define ATH_FILE_FILE_H

#include "container/container.h"
#include "model/basis.h"
#include "model/mesh.h"

/* The plant about a finer rest pose: the first layer, from stage 1 on, or a refinement, whose pieces are all of its
 * stage. A refinement without a rest pose of its own has the rest pose and the bases of the layer before. */
typedef struct {
    ath_plan plan; /* plan.bases null: not built yet */
    ath_piece *pieces;
    ath_node *nodes; /* first layer only */
    double *rest;    /* null: it has the rest pose of the layer before */
    int32_t *rest_steps;
    double *bases;        /* plan.bases once they are filled */
    uint64_t bases_count; /* 0: it has the bases of the layer before, or they are not known yet */
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
    uint8_t *coded;   /* frame_count: the coded frame of its segment that each frame shows */
    ath_clip *clips;
    char *names;  /* clip_count x NAME_BYTES */
    float *seams; /* clip_count x full_level_count */
    ath_branch *branches;
    int32_t *branch_source, *vertex_source, *vertex_places; /* see ath.h */
    double *times;
    double *rest;        /* the reference pose, relative to the origin */
    double *source_rest; /* the rest pose; null where it is the reference pose, not exact */
    ath_piece *pieces;
    ath_node *nodes;
    uint8_t *gaps;
    void *model;                  /* ath_prelude_model_size bytes */
    void *scratch;                /* for opening and building */
    double *bases;                /* null until ath_build */
    void *places_work;            /* for reading PLACES, or null */
    ath_mesh mesh;                /* only where the file has FACES */
    ath_mesh *connected;          /* &mesh where the rest pose is connected, else null */
    int32_t *rest_steps;          /* null where no layer refines the rest pose */
    ath_layer layers[ATH_LAYERS]; /* first_layer to layer_count - 1 */
    double
        *waves[ATH_WAVE_KINDS][ATH_SEGMENT_FRAMES + 1]; /* by kind and number of frames; null: no segment needs them */
    uint64_t bases_count;
    /* What a part of opening hands on to the next ones; `opened` of them are done. */
    int32_t opened, *corners; /* corners, counts: of the polygons of `shape` */
    uint32_t *counts;
    ath_polygons shape;
    ath_limits limits;
    ath_fault_info fault;
    ath_rest_head rest_head;
    ath_bytes rest_body;
    int32_t built_stage;       /* stage up to which `bases` are filled; -1: none */
    int32_t planned_stage;     /* the same of `nodes` */
    int32_t is_reading;        /* 1: a layer's rest pose is read in part */
    int32_t next_piece;        /* where filling the bases that come next goes on */
    int32_t next_waves;        /* where filling the waves goes on, by number of frames and kind */
    int32_t rest_known;        /* 0 until the host gives it */
    int32_t source_rest_known; /* 0 until SOURCE_REST has been read */
    int32_t first_layer;       /* 0 where stage 1 has a rest pose of its own, else 1 */
    int32_t rest_is_exact;     /* the reference pose is in the very numbers of source_rest */
    int32_t longest;           /* frames of the longest segment */
    int32_t has_joins;
    int32_t predicted_trees;            /* 1: some trees, and not the file, have predicted motion */
    uint32_t stems_stages;              /* bit d: stage d has STEMS */
    uint32_t affine_stages[ATH_LEVELS]; /* bit d of entry L: AFFINES of stage d serve to show stage L */
    uint32_t shown_affines;             /* bit d: AFFINES of stage d serve to show a stored level */
};

enum { ATH_END_FRAMES = 2 }; /* frames at the end of a segment that the next one is joined to */

/* ---- clips and segments ---- */

/* Returns the first of `count` clips with a name; -1: none has it. */
int32_t ath_clip_among(const ath_file *file, int32_t count, const char *name);
const ath_clip *ath_file_clip(const ath_file *file, int32_t frame);
const ath_clip *ath_segment_clip(const ath_file *file, int32_t segment);
/* Returns how many frames of a segment are coded: all that do not repeat the frame before. */
int32_t ath_file_frames(const ath_file *file, int32_t segment);
/* Returns the segment before one in its clip. For the first segment of a loop of several it is the last; -1: none. */
int32_t ath_segment_before(const ath_file *file, int32_t segment);
/* Returns how the positions that the level of a stage shows are joined: an entry of ath_joins. */
int32_t ath_join_at(const ath_file *file, int32_t segment, int32_t stage);

/* ---- places ---- */

ATH_INLINE int ath_is_split(const ath_file *file) { return file->header.vertex_count > file->header.place_count; }
/* Copies positions, `bytes` each, from the first vertex of each place to the others there. */
void ath_fill_places(const ath_file *file, void *xyz, size_t stride, size_t bytes);

/* ---- chunks ---- */

const ath_chunk *ath_file_chunk(const ath_file *file, int32_t kind, int32_t stage, int32_t segment);
/* Returns whether decoding a segment at `stage` takes the chunk of this kind and stage d. */
int ath_file_needs(const ath_file *file, int32_t kind, int32_t d, int32_t stage);
int ath_refuse_missing(ath_fault_info *fault, int32_t kind, int32_t level, uint32_t segment);
/* Checks a chunk of the prelude and gives its bytes. Until the next chunk is loaded, the fault is that the content of
 * this one is not valid. */
int ath_load(const ath_file *file, int32_t kind, ath_bytes *content, ath_fault_info *fault);

/* Returns whether the one chunk of a level stands with segment 0 and serves all segments. */
ATH_INLINE int ath_is_shared(int32_t kind) { return kind == ATH_SHAPES || kind == ATH_REFINED_REST; }

/* Returns whether a segment's end, as the segment joined to it takes it, depends on chunks of this kind. */
ATH_INLINE int ath_shapes_end(int32_t kind)
{
    return kind != ATH_CORRECTIONS && kind != ATH_EXACT && kind != ATH_PREDICTED;
}

/* Returns whether all trees of the file have predicted motion, or some. */
ATH_INLINE int ath_predicts(const ath_file *file) { return file->header.is_predicted || file->predicted_trees; }

/* ---- rest poses and waves ---- */

/* Does one of ATH_REST_PARTS parts of reading REST: the reference pose, or which mesh of the host's it is. Returns ATH_OK
 * when it is done, or ATH_MORE. */
enum { ATH_REST_PARTS = 4 + MESH_PARTS };
int ath_read_reference(ath_file *file, int32_t part, int32_t *cost, ath_fault_info *fault);
/* Completes what follows from the reference pose. */
void ath_know_rest(ath_file *file);
/* Return the waves of a segment's stems, and those of the maps of its nodes. */
const double *ath_file_waves(const ath_file *file, int32_t segment);
const double *ath_file_node_waves(const ath_file *file, int32_t segment);

/* ---- stages and layers ---- */

ATH_INLINE int32_t ath_file_stage(const ath_file *file, int32_t level) { return ath_stage_of(&file->header, level); }

ATH_INLINE int ath_has_stream(const ath_file *file, int32_t stage) { return file->stems_stages >> stage & 1; }

/* Returns the number of stages that are not exact. */
ATH_INLINE int32_t ath_lossy_stages(const ath_file *file) { return file->plan.height + 1 + file->header.layer_count; }

/* Returns whether the file stores the stage behind the last lossy one. */
ATH_INLINE int ath_file_is_lossless(const ath_file *file) { return file->header.stage_count > ath_lossy_stages(file); }

/* Returns the layer of precision of a stage: 0 for the stages of the branch hierarchy. */
ATH_INLINE int32_t ath_layer_of(const ath_file *file, int32_t stage)
{
    return ath_max(0, ath_min(stage, ath_lossy_stages(file) - 1) - file->plan.height - 1);
}

ATH_INLINE int32_t ath_stage_of_layer(const ath_file *file, int32_t layer) { return file->plan.height + 1 + layer; }

/* Returns the plan of a layer as it serves to show `stage`. */
ATH_INLINE const ath_plan *ath_layer_plan(const ath_file *file, int32_t layer, int32_t stage)
{
    return stage > 0 && layer >= file->first_layer ? &file->layers[layer].plan : &file->plan;
}

ATH_INLINE const ath_plan *ath_stage_plan(const ath_file *file, int32_t stage)
{
    return ath_layer_plan(file, ath_layer_of(file, stage), stage);
}

#endif
