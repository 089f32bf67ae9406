/* A preparation at work: what its phases share. Levels are stages here (CONTRIBUTING.md). */
#ifndef ATH_PLAY_WORK_H
#define ATH_PLAY_WORK_H

#include "model/refine.h"
#include "play/join.h"
#include "play/keep.h"
#include "streams/decode.h"
#include "streams/predict.h"

/* A phase uses some of the functions of streams. */
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#elif defined(_MSC_VER)
#pragma warning(push)
#pragma warning(disable : 4505)
#endif
#include "bits/exact.inl"
#include "streams/motion_streams.inl"
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#elif defined(_MSC_VER)
#pragma warning(pop)
#endif

typedef enum { BEFORE, CHECKSUMS, HEADS, FRAMES, PIECES, DONE, FAILED } prepare_phase;

typedef struct {
    ath_coder coder;
    shape_model *model;
    refined_shape_model *refined; /* replaces `model` in a refinement */
    int32_t shift;                /* see ath_parse_refined_shapes */
    const ath_chunk *chunk;       /* null: no piece of the stage has shapes */
} shapes_reader;

typedef struct {
    ath_coder coder;
    coefficient_model *model;
    refinement_model *refined; /* replaces `model` in a refinement */
    uint32_t *history;
    double *temporal;
    const ath_chunk *chunk; /* null: the stage has none, or this preparation does not need it */
} stems_reader;

typedef struct {
    ath_coder coder;
    affine_model *model;
    uint32_t *history;
    const ath_chunk *chunk;
} affines_reader;

typedef struct {
    ath_coder coder;
    correction_model *model;
    double step;
    const ath_chunk *chunk;
} corrections_reader;

typedef struct {
    ath_coder coder;
    exact_model *model;
    int32_t length[3];
    const ath_chunk *chunk;
} exact_reader;

/* A layer of precision, which one piece after the other passes through. */
typedef struct {
    const ath_plan *plan;
    ath_motion motion;
    ath_scratch scratch;
    ath_piece_rows rows;
    int32_t counts[ATH_SLOTS];
    int32_t *shape_integers; /* all 0 between pieces */
    double *unit_shapes;
    ath_piece_before before; /* the piece in the layer before */
    double turn_steps[3];    /* rotation steps in the layer before */
    const double *placed;    /* null: the piece is not placed in this layer */
    uint8_t used[ATH_PIECE_VERTICES];
} layer_work;

/* The segment that is asked for, and what its preparation starts from. */
typedef struct {
    const ath_file *file;
    void *memory;    /* memory of the segment */
    int32_t is_full; /* 1: that memory has room for positions */
    void *positions; /* destination of the positions; null: that memory */
    int32_t index, stage;
    const ath_segment *from; /* this segment at an earlier level; null: none */
    const void *kept;        /* integers of `from`; null: none */
    kept_head *keeps;        /* memory of what is kept, written by `keeping`; null: none */
    kept_writer keeping;
    ath_watcher *watcher; /* null: none */
} preparation;

struct ath_work {
    const ath_file *file;
    ath_segment *segment;
    preparation asked;
    ath_join join;
    int32_t only_end; /* 1: the segment before the one asked for is in preparation */
    shapes_reader shapes[ATH_LEVELS];
    stems_reader stems[ATH_LEVELS];
    affines_reader affines[ATH_LEVELS];
    corrections_reader corrections;
    exact_reader exact_level;
    ath_prediction *prediction;
    const ath_chunk *predicted; /* null: there is none, or this preparation does not need it */
    ath_stream streams[ATH_LEVELS];
    layer_work layers[ATH_LAYERS];
    ath_node_rows node;
    void *prelude_model;
    prepare_phase phase;
    const ath_segment *shown_before; /* the level whose positions make_exact starts from; null: none */
    const uint8_t *kept;             /* the next piece to restore; null: pieces are decoded */
    kept_head *keeps;                /* asked.keeps while the segment asked for is in preparation */
    kept_writer keeping;
    int32_t index, stage;       /* the segment in preparation */
    int32_t first_stage;        /* first stage whose chunks are read */
    int32_t first_layer, layer; /* first and last layer that pieces pass through */
    int32_t next;               /* next stage of CHECKSUMS and HEADS, next piece of PIECES */
    int32_t next_kind;          /* next kind of CHECKSUMS */
    uint32_t crc, crc_at;
    int32_t next_node, exact, shown;
    int32_t is_predicted; /* 1: the piece is of a tree that has been predicted */
    ath_fault_info fault;
    int32_t node_step;
};

/* Parts of memory: a preparation's, and its segment's. Return their bytes; base null: they are only counted. */
uint64_t ath_carve_work(ath_work *work, const ath_file *file, int32_t frames, uint8_t *base);
uint64_t ath_carve_segment(ath_segment *segment, const ath_file *file, int32_t level, int32_t frames, int is_full,
                           uint8_t *base);

/* Returns whether the file has the vertices in the order of the source. */
int ath_is_source_order(const ath_file *file);

/* Returns whether ath_positions only copies the positions of a segment at a level, piece by piece. */
int ath_are_copied(const ath_file *file, int32_t index, int32_t level);

/* Returns the place among the positions of the first vertex of the piece in preparation. */
size_t ath_position_of_piece(const ath_work *work);

/* Returns who observes the segment in preparation; null for the segment before the one asked for, and if nobody does. */
ath_watcher *ath_watcher_of(const ath_work *work);

/* Returns a chunk that a segment needs for a stage, null if it has none: of any segment, and of the one in preparation. */
const ath_chunk *ath_wanted_chunk(const ath_file *file, int32_t segment, int32_t stage, int32_t kind, int32_t d);
const ath_chunk *ath_chunk_of(const ath_work *work, int32_t kind, int32_t d);

/* Note a fault in a chunk, and return its code. ath_blame: a content that is not valid, unless the result is ATH_OK. */
int ath_refuse_chunk(ath_work *work, int code, ath_field field, const ath_chunk *chunk, double found, double expected);
int ath_blame(ath_work *work, const ath_chunk *chunk, int result);

void ath_next_phase(ath_work *work, prepare_phase phase);

#endif
