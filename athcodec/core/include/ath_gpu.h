/* athcodec: the GPU form of levels and segments, for engines that compute positions on the GPU. This optional header
 * beside ath.h uses no graphics API. docs/gpu.md describes what shaders do with the blocks, athcodec/gpu/ has shaders.
 *
 * Each block consists of little-endian 32-bit words and is uploaded as it is: a header, then sections. The header gives
 * the first word of each section. Positions are relative to the file's origin.
 *
 *     ath_gpu_level_size, ath_gpu_build_level once per file and level: bodies, bases, vertices
 *     ath_gpu_record, ath_gpu_recorded        once per segment and level: rows, waves, joins, corrections
 *     ath_gpu_bounds                          the box of a prepared segment, for culling
 *     ath_gpu_frame                           the frame of a segment that shows a frame of the file
 *
 * The rules of ath.h on memory, threads and hostile input hold here, too. */
#ifndef ATH_GPU_H
#define ATH_GPU_H

#include "ath.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- a level ---------------------------------------------------------------------------------------------------- */

enum {
    ATH_GPU_NODE = 1,    /* the body is one matrix; else it is a piece of at most 64 vertices */
    ATH_GPU_FOLLOWS = 2, /* the body turns with its parent's tangent */
    ATH_GPU_FITTED = 4   /* a sheet with children, which turn with the rotation nearest to its vertices */
};

/* A node or a piece, which is placed at once. Bodies come in file order. */
typedef struct ath_gpu_body {
    uint32_t flags;
    int32_t parent;       /* body that this one hangs on; -1: none */
    int32_t attach;       /* position that the body hangs on; -1: rest_point */
    uint32_t way;         /* mode m of the parent moves its tangent by word way + m of the bases */
    uint32_t modes;       /* most modes that rows may hold */
    int32_t first;        /* first position that the body places; index of a node's matrix */
    int32_t count;        /* positions that the body places; 3 for a node: the columns of its map */
    int32_t vertex;       /* vertex whose rest position belongs to the first position */
    uint32_t basis;       /* mode m moves position i by word basis + m * count + i of the bases */
    uint32_t shape_modes; /* modes that shapes are made of, if the body has shapes */
    float rest_point[3];  /* attach point in the rest pose */
    float tangent[3];     /* parent's tangent at the attach point in the rest pose, not normalised */
} ath_gpu_body;

typedef struct ath_gpu_vertex {
    float rest[3];
    uint32_t binding; /* index of its position or, with ATH_GPU_MOVED, of the matrix that moves its rest position */
} ath_gpu_vertex;
#define ATH_GPU_MOVED 0x80000000u

typedef struct ath_gpu_level {
    uint32_t words; /* size of the whole block */
    uint32_t level;
    uint32_t vertex_count, body_count, position_count, matrix_count;
    uint32_t depth_count;
    uint32_t vertices; /* ath_gpu_vertex, vertex_count in file order */
    uint32_t bodies;   /* ath_gpu_body */
    uint32_t order;    /* indices of bodies by depth, parents before children */
    uint32_t depths;   /* depth_count + 1 indices: where each depth begins in `order` */
    uint32_t bases;    /* floats */
    float origin[3];
    uint32_t reserved;
} ath_gpu_level;

/* Returns the bytes that ath_gpu_build_level needs at most. Call ath_refine for the level first. */
ATH_API size_t ath_gpu_level_size(const ath_file *file, int32_t level);
/* Builds the level's block at the beginning of `memory`; cast that to ath_gpu_level *. Returns ATH_OK, ATH_NO_MEMORY,
 * ATH_BAD_ARGUMENT or ATH_NEEDS_HOST_MESH. */
ATH_API int ath_gpu_build_level(const ath_file *file, int32_t level, void *memory, size_t memory_bytes);

/* ---- a segment -------------------------------------------------------------------------------------------------- */

/* Three axes of integers over functions of time. Axis a at frame t is `step` times the sum, over k below `count`, of
 * value a * count + k times wave k at t. */
typedef struct ath_gpu_row {
    uint32_t values; /* first word in the section of values, which has two values per word, the low half first */
    uint16_t count;
    uint8_t slot;  /* below 64: a mode, or three shapes below shape_modes of a body with shapes; else see below */
    uint8_t waves; /* index into wave_sets; with ATH_GPU_WIDE each value is a whole word */
    float step;
} ath_gpu_row;
enum { ATH_GPU_SHIFT = 64, ATH_GPU_ROTATION = 65, ATH_GPU_WIDE = 128 };

/* The motion of a body. Rows of its shift and its rotation come first, the others ascend by slot. */
typedef struct ath_gpu_move {
    uint32_t row;    /* index of the first row */
    uint32_t counts; /* number of rows + 65536 times number of shapes */
    uint32_t shapes; /* first word in the section of shapes: 3 * shape_modes floats each, axis a of mode m at 3 m + a */
    uint32_t turn;   /* first word in the section of turns: a 3x3 matrix from the rotation row to the rotation vector */
} ath_gpu_move;

/* A vector that is added around a frame. Axis a adds value[a] * 2^(width >> 4) * correction_part times the footprint's
 * part of width & 15 at the distance in frames. */
typedef struct ath_gpu_correction {
    int16_t value[3];
    uint8_t frame, width;
} ath_gpu_correction;

enum { ATH_GPU_WAVE_SETS = 34 }; /* waves of stems, waves of nodes, and a learned set for each level */

typedef struct ath_gpu_segment {
    uint32_t words; /* size of the whole block */
    uint32_t level, segment;
    uint32_t frames;      /* coded frames */
    uint32_t join_frames; /* frames that are joined to the segment before; 0: none are */
    uint32_t row_count;
    uint32_t corrected_count; /* corrected positions */
    float correction_part;
    uint32_t moves;         /* one ath_gpu_move per body */
    uint32_t rows;          /* ath_gpu_row */
    uint32_t values;        /* 16 or 32-bit integers */
    uint32_t shapes, turns; /* floats */
    uint32_t join_curve;    /* 2 floats per joined frame: the shares of jumps and of slopes that are left */
    uint32_t join_steps;    /* 2 floats per body: the steps of its positions' jumps and slopes */
    uint32_t joins;         /* a word per coordinate of a position: signed 16-bit jump (low half) and slope */
    uint32_t matrix_joins;  /* 24 floats per matrix: jump and slope of each of the 9 numbers of R, then of c */
    uint32_t corrected;     /* 2 words per corrected position, and 2 at the end: the position, its first correction */
    uint32_t corrections;   /* ath_gpu_correction, 2 words each */
    uint32_t baked;         /* 0, or frames x positions x 3 floats, for motion that has no rows */
    uint32_t wave_sets[ATH_GPU_WAVE_SETS]; /* first words of the sets, floats, `frames` per wave; 0: the set is empty */
} ath_gpu_segment;

/* Sizes in words of those sections of a segment that are known only once it is decoded. */
typedef struct ath_gpu_room {
    uint32_t rows, values, shapes, turns, corrected, corrections, waves;
} ath_gpu_room;

/* Returns the bytes that recording with such room needs. */
ATH_API size_t ath_gpu_record_size(const ath_file *file, int32_t level, const ath_gpu_room *room);
/* Call ath_gpu_record between ath_prepare_start and the first step. The preparation is then recorded in `memory`, too:
 * leave that unchanged until the last step. Returns ATH_OK or ATH_NO_MEMORY. */
ATH_API int ath_gpu_record(ath_work *work, const ath_gpu_room *room, void *memory, size_t memory_bytes);
/* Call ath_gpu_recorded once ath_prepare_step has returned ATH_OK. Returns the segment's block; null: there was too
 * little room. Then prepare the segment again with the room in `needed`; to find it, start with zeros. `needed` may be
 * null. */
ATH_API const ath_gpu_segment *ath_gpu_recorded(const void *memory, ath_gpu_room *needed);

/* Fills the box of all that a prepared segment shows, relative to the origin: least x, y, z, then largest x, y, z. */
ATH_API void ath_gpu_bounds(const ath_file *file, const ath_segment *segment, float box[6]);

/* Returns the coded frame of its segment that shows a frame of the file. */
ATH_API int32_t ath_gpu_frame(const ath_file *file, int32_t frame);

#ifdef __cplusplus
}
#endif
#endif
