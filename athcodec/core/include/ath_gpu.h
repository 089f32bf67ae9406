/* athcodec: the GPU form of a level and of a segment, for engines that compute positions on the GPU. An optional file beside
 * ath.h, without any graphics API; docs/gpu.md describes what shaders do with it, athcodec/gpu/ has them in WGSL.
 *
 * Each form is one block of 32-bit words, little-endian, that goes to the GPU as it is: a header, then sections, which the
 * header gives by the word that they begin at. Positions are relative to the file's origin.
 *
 *     ath_gpu_level_size, ath_gpu_build_level once per file and level: bodies, bases, vertices
 *     ath_gpu_record, ath_gpu_recorded        once per segment and level: rows, waves, joins, corrections
 *     ath_gpu_bounds                          the box of a prepared segment, for culling
 *     ath_gpu_frame                           which frame of a segment shows a frame of the file
 *
 * Memory, threads and hostile input as in ath.h. */
#ifndef ATH_GPU_H
#define ATH_GPU_H

#include "ath.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- a level ---------------------------------------------------------------------------------------------------- */

enum {
    ATH_GPU_NODE = 1,    /* a body that is a matrix; else a piece, at most 64 vertices */
    ATH_GPU_FOLLOWS = 2, /* it turns with its parent's tangent */
    ATH_GPU_FITTED = 4   /* a sheet with children: what it hands on is the rotation nearest to its vertices */
};

/* What is placed at once. Bodies come in file order. */
typedef struct ath_gpu_body {
    uint32_t flags;
    int32_t parent;       /* the body that it hangs on, -1: none */
    int32_t attach;       /* the position that it hangs on; -1: rest_point */
    uint32_t way;         /* word of the bases: mode m of the parent moves its tangent by word way + m */
    uint32_t modes;       /* that it may have */
    int32_t first;        /* of the positions that it places; of a node, its matrix */
    int32_t count;        /* of positions; 3 of a node: the columns of its map */
    int32_t vertex;       /* whose rest position is that of the first */
    uint32_t basis;       /* mode m moves position i by word basis + m * count + i */
    uint32_t shape_modes; /* modes that shapes are made of, where it has any */
    float rest_point[3];  /* what it hangs on, in the rest pose */
    float tangent[3];     /* of the parent there, in the rest pose, as long as it is */
} ath_gpu_body;

typedef struct ath_gpu_vertex {
    float rest[3];
    uint32_t binding; /* its position; with ATH_GPU_MOVED the matrix that moves its rest position */
} ath_gpu_vertex;
#define ATH_GPU_MOVED 0x80000000u

/* The header of a level. */
typedef struct ath_gpu_level {
    uint32_t words; /* of the whole block */
    uint32_t level;
    uint32_t vertex_count, body_count, position_count, matrix_count;
    uint32_t depth_count;
    uint32_t vertices; /* ath_gpu_vertex, vertex_count in file order */
    uint32_t bodies;   /* ath_gpu_body */
    uint32_t order;    /* bodies, parents before children, by depth */
    uint32_t depths;   /* depth_count + 1: where each depth begins in `order` */
    uint32_t bases;    /* floats */
    float origin[3];
    uint32_t reserved;
} ath_gpu_level;

/* Bytes that ath_gpu_build_level needs at most, once ath_refine has built the level. */
ATH_API size_t ath_gpu_level_size(const ath_file *file, int32_t level);
/* Builds the level's block at the beginning of `memory`, which is an ath_gpu_level. ATH_OK, ATH_NO_MEMORY, ATH_BAD_ARGUMENT,
 * ATH_NEEDS_HOST_MESH. */
ATH_API int ath_gpu_build_level(const ath_file *file, int32_t level, void *memory, size_t memory_bytes);

/* ---- a segment -------------------------------------------------------------------------------------------------- */

/* Three axes of integers over functions of time: what axis a is at frame t is step times the sum over k below `count` of value
 * a * count + k times wave k at t. */
typedef struct ath_gpu_row {
    uint32_t values; /* word in the section of values where they begin, two to a word, the low half first */
    uint16_t count;
    uint8_t slot;  /* below 64: a mode or, of a body with shapes, below its shape_modes, three shapes; else see below */
    uint8_t waves; /* an index of wave_sets; with ATH_GPU_WIDE a value is a word */
    float step;
} ath_gpu_row;
enum { ATH_GPU_SHIFT = 64, ATH_GPU_ROTATION = 65, ATH_GPU_WIDE = 128 };

/* What moves a body. Its rows ascend by slot, but that those of its shift and its rotation are the first. */
typedef struct ath_gpu_move {
    uint32_t row;    /* its first */
    uint32_t counts; /* rows; 65536 times shapes */
    uint32_t shapes; /* word in the section of shapes: of each 3 * shape_modes floats, axis a of mode m at 3 m + a */
    uint32_t turn;   /* word in that of turns: 9 floats, the matrix that makes a rotation vector of its row */
} ath_gpu_move;

/* A vector that is added around a frame: a value is integer * 2^(width >> 4) * correction_part * part(width & 15, distance). */
typedef struct ath_gpu_correction {
    int16_t value[3];
    uint8_t frame, width;
} ath_gpu_correction;

enum { ATH_GPU_WAVE_SETS = 34 }; /* of stems, of nodes, and learned of each level */

/* The header of a segment. */
typedef struct ath_gpu_segment {
    uint32_t words; /* of the whole block */
    uint32_t level, segment;
    uint32_t frames;      /* coded ones */
    uint32_t join_frames; /* that are joined to the segment before; 0: none are */
    uint32_t row_count;
    uint32_t corrected_count; /* positions that are corrected */
    float correction_part;
    uint32_t moves;         /* ath_gpu_move, of each body */
    uint32_t rows;          /* ath_gpu_row */
    uint32_t values;        /* 16 or 32-bit integers */
    uint32_t shapes, turns; /* floats */
    uint32_t join_curve;    /* 2 floats of each joined frame: what is left of jumps and of slopes */
    uint32_t join_steps;    /* 2 floats of each body: the steps of the jumps and of the slopes of its positions */
    uint32_t joins;         /* of each number of a position a word: its jump, and times 65536 its slope, 16 bits each */
    uint32_t matrix_joins;  /* 24 floats of each matrix: jump and slope of 9 numbers of R, then of c */
    uint32_t corrected;   /* 2 words of each corrected position, and of one behind the last: it, its first correction */
    uint32_t corrections; /* ath_gpu_correction, of 2 words each */
    uint32_t baked;       /* 0, or frames x positions x 3 floats, in place of all that moves: motion that has no rows */
    uint32_t wave_sets[ATH_GPU_WAVE_SETS]; /* words of their floats, each wave `frames` of them; 0: none */
} ath_gpu_segment;

/* Words of the parts of a segment whose sizes are not known before it is decoded. */
typedef struct ath_gpu_room {
    uint32_t rows, values, shapes, turns, corrected, corrections, waves;
} ath_gpu_room;

/* Bytes that recording with such room needs. */
ATH_API size_t ath_gpu_record_size(const ath_file *file, int32_t level, const ath_gpu_room *room);
/* Between ath_prepare_start and the first step: what is prepared is recorded in `memory`, too, which is left alone until the last
 * step has come. ATH_NO_MEMORY. */
ATH_API int ath_gpu_record(ath_work *work, const ath_gpu_room *room, void *memory, size_t memory_bytes);
/* After ath_prepare_step was ATH_OK: the segment's block; null where there was too little room, and `needed` says how much there
 * has to be in a preparation that is done again. With a room of zeros that is the way to find out. needed: may be null. */
ATH_API const ath_gpu_segment *ath_gpu_recorded(const void *memory, ath_gpu_room *needed);

/* The box of all that a prepared segment shows, relative to the origin: least x, y, z, then most. */
ATH_API void ath_gpu_bounds(const ath_file *file, const ath_segment *segment, float box[6]);

/* Which of the coded frames of its segment shows a frame of the file. */
ATH_API int32_t ath_gpu_frame(const ath_file *file, int32_t frame);

#ifdef __cplusplus
}
#endif
#endif
