/* An opened file, as opening, preparing and playing see it. */
#ifndef ATH_FILE_H
#define ATH_FILE_H

#include "container.h"
#include "plan.h"

struct ath_file {
    ath_header header;
    ath_info info;
    ath_plan plan;
    ath_chunk *chunks;
    float *errors; /* level_count x segment_count x (max, rms) */
    ath_clip *clips;
    char *names;  /* of the clips, NAME_BYTES each */
    float *seams; /* clip_count x full_level_count */
    ath_branch *branches;
    int32_t *branch_source, *vertex_source;
    double *times;
    double *rest;        /* relative to the origin */
    double *stored_rest; /* as stored, where the file holds it exactly, else null */
    ath_piece *pieces;
    ath_node *nodes;
    uint8_t *gaps;
    void *scratch;                           /* of opening and building */
    double *bases;                           /* null until ath_build */
    double *cosines[ATH_SEGMENT_FRAMES + 1]; /* of segments of so many frames; null where there are none */
    uint64_t bases_count;
    int32_t longest;                    /* frames of the longest segment */
    uint32_t stems_levels;              /* bit d: level d has STEMS */
    uint32_t affine_levels[ATH_LEVELS]; /* bit d of entry L: AFFINES of level d serve to show level L */
};

int32_t ath_file_frames(const ath_file *file, int32_t segment);
const ath_clip *ath_file_clip(const ath_file *file, int32_t frame);
const ath_chunk *ath_file_chunk(const ath_file *file, int32_t kind, int32_t level, int32_t segment);
/* Whether it stores the lossless level, which follows the last lossy one. */
ATH_INLINE int ath_file_is_lossless(const ath_file *file) { return file->header.level_count > file->plan.height + 2; }
/* Whether decoding a segment at `level` takes the chunk of this kind and level d. */
int ath_file_needs(const ath_file *file, int32_t kind, int32_t d, int32_t level);

#endif
