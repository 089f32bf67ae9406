/* athcodec: plays .ath files. This header is the whole public C API; FORMAT.md describes the files.
 *
 *     ath_front -> ath_open -> ath_build        once per file: header, hierarchy, rest pose
 *     ath_set_host_mesh                         before ath_build, where the rest pose is a mesh that the host has
 *     ath_fault_text                            why a file is refused, in a sentence
 *     ath_refine                                once per level above 0
 *     ath_ranges, ath_feed                      which bytes a level needs; here they are
 *     ath_prepare, or _start and _step          one segment at one level: entropy decoding, inverse transforms
 *     ath_prepare_to                            the same, for who wants all of its positions at once
 *     ath_keep, ath_prepare_onward              a deeper level of a segment, from the one that is prepared
 *     ath_positions, ath_matrices, ath_exact    what to draw at a time, as often as wanted
 *     ath_level_for                             which level to draw at a distance
 *     ath_fade_to, ath_faded_positions          from one level to the next without a jump
 *     ath_blended_positions, ath_wind_weights   several clips at once: calm to storm
 *
 * Memory. Nothing here allocates, and there are no globals: the caller asks for a size, provides that many bytes,
 * aligned to 16, and keeps them while they are in use. Objects are freed by freeing their memory. An ath_file holds
 * pointers into the bytes that it was fed: these stay where they are until they are fed anew or dropped.
 *
 * Threads. Functions that take a const object may run in parallel on it. One ath_work serves one thread at a time; any
 * number of them may prepare segments of one ath_file while others play. ath_feed, ath_drop, ath_refine_size and
 * ath_refine run alone among those that look at bytes: preparations and the functions on chunks and ranges; playing may
 * go on. ath_set_host_mesh and ath_build run alone.
 *
 * Hostile input. Functions that read a file's bytes never read or write out of bounds, whatever the bytes are, need no
 * more memory than they said, and end in time linear in it. Counts, levels and pointers that the caller hands over are
 * trusted, unless a function says what it returns for bad ones.
 *
 * Units and layout. Positions and errors are in the file's scene units, time is in seconds, frames count from 0.
 * Matrices are 3x4, row-major: x' = m[0] x + m[1] y + m[2] z + m[3] and so on. Vertices, branches and nodes come in
 * file order unless an ath_order says otherwise: every subtree is one range of vertices there.
 *
 * Exactness. Decoded positions have the same bits on every machine, in WebAssembly and in Python, at whole frames and
 * between them. Arithmetic that would change them is switched off (contraction to FMA) or refused (-ffast-math, x87).
 *
 * Needs memcpy, memmove and memset, and sqrt as an instruction (-fno-math-errno); nothing else. C11 or C++17. */
#ifndef ATH_H
#define ATH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(ATH_STATIC)
#define ATH_API
#elif defined(_WIN32) && defined(ATH_BUILDING)
#define ATH_API __declspec(dllexport)
#elif defined(_WIN32)
#define ATH_API __declspec(dllimport)
#elif defined(__GNUC__)
#define ATH_API __attribute__((visibility("default")))
#else
#define ATH_API
#endif

/* ---- results ---------------------------------------------------------------------------------------------------- */

/* Codes below 64 are errors of a file: the table of FORMAT.md, "Errors", and of errors.py. They never change. Those
 * from 64 on are about a call. */
typedef enum ath_result {
    ATH_OK = 0,
    ATH_INVALID = 1,
    ATH_NOT_AN_ATH_FILE = 2,
    ATH_UNSUPPORTED_VERSION = 3,
    ATH_TRUNCATED = 4,
    ATH_BAD_CHECKSUM = 5,
    ATH_BAD_HEADER = 6,
    ATH_BAD_CHUNK_TABLE = 7,
    ATH_UNKNOWN_CHUNK = 8,
    ATH_BAD_CHUNK = 9,
    ATH_LIMIT_EXCEEDED = 10,
    ATH_TRAILING_BYTES = 11,
    ATH_NEEDS_HOST_MESH = 12,
    ATH_WRONG_HOST_MESH = 13,
    ATH_UNSUPPORTED_FEATURE = 14,
    ATH_MORE = 64,         /* not an error: there is more to do, call again */
    ATH_HELD = 65,         /* not an error: the frame to blend with is not prepared, the nearer one is shown */
    ATH_MISSING = 66,      /* bytes that this needs have not been fed */
    ATH_NOT_PREPARED = 67, /* no segment that was handed over has this frame, or what there is at two levels */
    ATH_NO_MEMORY = 68,    /* the memory is smaller than was asked for, or not aligned to 16 */
    ATH_BAD_ARGUMENT = 69  /* a level or segment that the file does not have */
} ath_result;

/* The code's name in FORMAT.md, such as "BAD_CHUNK"; "UNKNOWN" for no code. */
ATH_API const char *ath_result_name(int result);

/* ---- constants of the format ------------------------------------------------------------------------------------- */

/* Before 1.0 a decoder takes files of its own version alone. ATH_FEATURES has a bit for each known feature. */
enum { ATH_FORMAT_MAJOR = 0, ATH_FORMAT_MINOR = 13, ATH_FEATURES = 0 };

/* Kinds of chunks. An unknown kind with the bit ATH_OPTIONAL is skipped. */
enum {
    ATH_OPTIONAL = 0x8000,
    ATH_HIERARCHY = 1,
    ATH_REST = 2,
    ATH_TIME = 3,
    ATH_METADATA = ATH_OPTIONAL | 4,
    ATH_FACES = ATH_OPTIONAL | 5,
    ATH_EDGES = ATH_OPTIONAL | 6,
    ATH_CLIPS = 7,
    ATH_STEMS = 16,
    ATH_AFFINES = 17,
    ATH_CORRECTIONS = 18,
    ATH_SHAPES = 19, /* of all segments, in segment 0 */
    ATH_EXACT = 20,
    ATH_REFINED_REST = 21, /* of all segments, in segment 0 */
    ATH_PREDICTED = 22,
    ATH_ATTRIBUTE = ATH_OPTIONAL | 32,
    ATH_SOURCE_REST = 33
};

enum { ATH_NO_LEVEL = 255 }; /* level of a chunk that is of no level */

/* The kind's name, such as "STEMS"; null for an unknown one. */
ATH_API const char *ath_kind_name(int kind);

/* Max_Memory_Bytes limits vertices * (ATH_BYTES_PER_FRAME * F + ATH_BYTES_PER_VERTEX), F: frames of the longest
 * segment. */
enum { ATH_BYTES_PER_FRAME = 60, ATH_BYTES_PER_VERTEX = 512 };

/* ---- faults ------------------------------------------------------------------------------------------------------ */

/* What a fault is about; most are fields of FORMAT.md: ATH_FIELD_VERTEX_COUNT is Vertex_Count. */
typedef enum ath_field {
    ATH_FIELD_NONE,
    ATH_FIELD_MAGIC,        /* the four bytes of which one is wrong, as a number whose high byte comes first */
    ATH_FIELD_VERSION,      /* major << 8 | minor */
    ATH_FIELD_FEATURES,     /* bits that are not among ATH_FEATURES; `most` is the file's version, `least` this one's */
    ATH_FIELD_FILE_SIZE,    /* bytes that are there: for a caller who knows that no more will come */
    ATH_FIELD_HEADER_SIZE,  /* bytes that are there */
    ATH_FIELD_FRONT_SIZE,   /* bytes that are there, or Front_Length */
    ATH_FIELD_TABLE_SIZE,   /* of chunk table and error table, against the limit */
    ATH_FIELD_PRELUDE_SIZE, /* bytes that are there */
    ATH_FIELD_VERTEX_COUNT,
    ATH_FIELD_BRANCH_COUNT,
    ATH_FIELD_FRAME_COUNT,
    ATH_FIELD_SEGMENT_COUNT,
    ATH_FIELD_CHUNK_COUNT,
    ATH_FIELD_FULL_LEVEL_COUNT,
    ATH_FIELD_LEVEL_COUNT,
    ATH_FIELD_CLIP_COUNT,
    ATH_FIELD_LAYER_COUNT,
    ATH_FIELD_MAX_ERROR,
    ATH_FIELD_FRONT_CHECKSUM,
    ATH_FIELD_ERROR,         /* an entry of the error table, of this level and segment */
    ATH_FIELD_JOIN,          /* frames that a segment is joined over at a level, of this level and segment */
    ATH_FIELD_REPEAT,        /* a frame that repeats the one before, and is the first of its segment */
    ATH_FIELD_FRONT,         /* the end of its stream */
    ATH_FIELD_MEMORY,        /* bytes that a segment may take */
    ATH_FIELD_MISSING_CHUNK, /* a chunk that the table lacks: kind, level and segment say which */
    ATH_FIELD_CHUNK_KIND,    /* from here on: of the chunk */
    ATH_FIELD_CHUNK_SIZE,    /* bytes that are there, or against the limit */
    ATH_FIELD_CHUNK_LEVEL,
    ATH_FIELD_CHUNK_SEGMENT,
    ATH_FIELD_CHUNK_PLACE, /* its index in the chunk table */
    ATH_FIELD_UNEXPECTED_CHUNK,
    ATH_FIELD_CHUNK_CHECKSUM,
    ATH_FIELD_HIERARCHY_DEPTH,
    ATH_FIELD_CONTENT,
    ATH_FIELD_HOST_MESH, /* none was given: `least` is the first checksum of the one wanted, `most` its vertices */
    ATH_FIELD_HOST_VERTEX_COUNT, /* of the mesh that was given */
    ATH_FIELD_HOST_VERTEX,       /* of that mesh, which has a number that is not finite */
    ATH_FIELD_HOST_CHECKSUM      /* of the mesh that was given: of its two the one that differs, or the first */
} ath_field;

/* Why a file was refused, or what is missing of it (ATH_MISSING). */
typedef struct ath_fault_info {
    int32_t code;  /* ath_result; ATH_OK: no fault, and the rest says nothing */
    int32_t field; /* ath_field */
    int32_t chunk; /* index in ath_chunks; -1: none */
    uint16_t kind; /* of that chunk, or of the one that is missing */
    uint8_t level;
    uint8_t reserved;
    uint32_t segment;
    uint64_t offset;           /* of the chunk in the file */
    double found, least, most; /* the value found, the values allowed: integers below 2^53 are exact */
} ath_fault_info;

/* Writes the fault as one line of English, "where: got this; expected that", with a zero behind it, into at most
 * `capacity` bytes. Returns its length without the zero, also where it does not fit. ATH_FAULT_TEXT bytes hold any. */
enum { ATH_FAULT_TEXT = 256 };
ATH_API size_t ath_fault_text(const ath_fault_info *fault, char *text, size_t capacity);

/* ---- opening ---------------------------------------------------------------------------------------------------- */

typedef struct ath_file ath_file;       /* an opened file */
typedef struct ath_work ath_work;       /* scratch memory and state of one preparation at a time */
typedef struct ath_segment ath_segment; /* one prepared segment at one level */

/* What a file may ask for; FORMAT.md, "Limits", gives the defaults. */
typedef struct ath_limits {
    uint32_t chunks, table_bytes, vertices, branches, frames, hierarchy_depth, chunk_bytes;
    uint32_t reserved;
    uint64_t memory_bytes;
} ath_limits;

ATH_API void ath_default_limits(ath_limits *limits);

/* Looks at the front of a file, of which `available` bytes are there.
 * ATH_MISSING: at least *front_bytes are needed to go on. ATH_OK: *front_bytes are the prelude, up to the first motion
 * chunk, and ath_open needs *memory_bytes. Where these are known before the prelude is there, they are given with
 * ATH_MISSING, too (else they are 0): ath_open may follow once *front_bytes are there. Else an error of the file.
 * limits: null for the defaults. fault: null, or what ATH_MISSING or the error is about. */
ATH_API int ath_front(const uint8_t *bytes, size_t available, const ath_limits *limits, size_t *front_bytes,
                      size_t *memory_bytes, ath_fault_info *fault);

/* Opens a file in `memory`, from at least its prelude; feeds it all of `bytes`. The ath_file is the memory: cast it.
 * Checks what FORMAT.md, "Opening", lists for a stream, in its order. Errors of the file; ATH_MISSING, ATH_NO_MEMORY.
 * limits, fault: as for ath_front. */
ATH_API int ath_open(void *memory, size_t memory_bytes, const uint8_t *bytes, size_t available,
                     const ath_limits *limits, ath_fault_info *fault);

/* The rest pose of a file whose info.rest_is_host is 1: the mesh that it was made for, which the engine has anyway.
 * `vertex_count` positions of three floats, the first at `xyz`, each `stride` bytes behind the one before, at any
 * alignment: a vertex buffer will do. They are the numbers of the source in its order, scene units and axes, bit for bit but
 * that -0.0 counts as 0.0: as they were loaded, not scaled or turned. The file copies them.
 *     Without it a file opens, says what it holds, and is fed; what needs the rest pose is ATH_NEEDS_HOST_MESH: ath_build,
 * ath_refine_size, ath_refine, ath_rest, ath_level_rest, and all that prepares. ATH_WRONG_HOST_MESH: another number of
 * vertices, numbers that are not finite, or another checksum than the file names; nothing has changed then. A file that
 * holds its rest pose passes the mesh over: ATH_OK. */
ATH_API int ath_set_host_mesh(ath_file *file, const void *xyz, size_t stride, int32_t vertex_count,
                              ath_fault_info *fault);

/* Computes the bases that all segments share, in memory of their own, whose size depends on the plant and its rest pose.
 * Once, before anything is prepared. ATH_NO_MEMORY, ATH_NEEDS_HOST_MESH. */
ATH_API size_t ath_build_size(const ath_file *file);
ATH_API int ath_build(ath_file *file, void *memory, size_t memory_bytes);

/* Levels 0 to info.depth_levels - 1 are the branch hierarchy's, at the precision of the first layer; each further level
 * refines all of it by one layer. Level 1 and such levels may refine the rest pose, too. Before any level above 0 is
 * prepared, what the segments share at it is built, once ath_build has run, in memory that stays as long as the file's:
 *     ath_refine_size reads the rest poses up to the level's from their REFINED_REST chunks, which ath_ranges names until
 * they are read, and says how much memory ath_refine needs, which may be none. ATH_MISSING, ATH_BAD_CHECKSUM,
 * ATH_BAD_CHUNK, ATH_BAD_ARGUMENT, ATH_NEEDS_HOST_MESH.
 *     ath_refine builds what is not built yet. The same, ATH_NO_MEMORY.
 * Level 0, and what is built already, need neither, but allow both. */
ATH_API int ath_refine_size(ath_file *file, int32_t level, size_t *memory_bytes, ath_fault_info *fault);
ATH_API int ath_refine(ath_file *file, int32_t level, void *memory, size_t memory_bytes);

/* ---- what a file holds ------------------------------------------------------------------------------------------- */

typedef struct ath_info {
    uint64_t file_length, prelude_length;
    double max_error; /* of the deepest stored level, promised */
    double origin[3];
    int32_t vertex_count, branch_count;
    int32_t frame_count, segment_count; /* of all clips */
    int32_t clip_count;
    int32_t level_count; /* stored levels: 0 to level_count - 1 */
    int32_t full_level_count;
    int32_t layer_count;  /* of the full file; 1: no level refines another */
    int32_t depth_levels; /* levels of the first layer: those beyond are refinements */
    int32_t node_count, chunk_count;
    int32_t is_float64;        /* 1: positions are double in the file's own arithmetic, else float */
    int32_t rest_is_float64;   /* 1: the rest pose is double, else float */
    int32_t rest_is_host;      /* 1: the rest pose is a mesh of the host's, for ath_set_host_mesh */
    uint32_t host_checksum[2]; /* of that mesh: CRC-32C of its floats as bytes, little-endian, and of these backwards */
    int32_t is_predicted;      /* 1: all levels but level 0 are predicted motion */
} ath_info;

ATH_API void ath_get_info(const ath_file *file, ath_info *info);

/* A clip. Frames and segments are numbered over the whole file, one clip after the other. */
typedef struct ath_clip {
    const char *name; /* UTF-8, ends with a zero; empty where the only clip of a file has none */
    double duration;  /* seconds from its first frame to its last */
    int32_t first_frame, frame_count;
    int32_t first_segment, segment_count;
    int32_t loop;     /* 1: its first frame follows its last */
    int32_t periodic; /* 1: a loop that is one segment, coded by functions of time that go on across its seam */
} ath_clip;

/* info.clip_count of them. */
ATH_API const ath_clip *ath_clips(const ath_file *file);
/* The clip of this name, -1: none. */
ATH_API int32_t ath_clip_named(const ath_file *file, const char *name);
/* How well a level keeps the step of a loop from its last frame to its first: the most that any vertex's is off, scene
 * units; 0 for clips that are no loops. Known of all full_level_count levels, stored or not. */
ATH_API double ath_seam_error(const ath_file *file, int32_t clip, int32_t level);

enum { ATH_SHEET = 1, ATH_LOOSE = 2, ATH_WHOLE = 4 };

/* A branch; parents come before children, a subtree is the branches b to b + subtree - 1. */
typedef struct ath_branch {
    int32_t parent;  /* branch, below its own index; -1 for a root */
    int32_t count;   /* vertices of its stem, at least 1 */
    int32_t attach;  /* vertex of the parent's stem that it hangs on, -1 for a root */
    int32_t flags;   /* ATH_SHEET: flat or compact; ATH_LOOSE: not attached; ATH_WHOLE: its subtree moves as one */
    int32_t lag;     /* of the rest pose's predictor; 0: a beam */
    int32_t first;   /* its first vertex */
    int32_t subtree; /* branches in its subtree, itself included */
    int32_t depth;
    int32_t rigid;  /* layers, from the first on, in which its pieces turn and move as they are */
    int32_t detail; /* 0, or what its largest step of the rest pose is, 2 to the power of half of it less 64 */
    int32_t ring;   /* vertices of each ring of a tube, which move alike; 0: it has no rings */
} ath_branch;

ATH_API const ath_branch *ath_branches(const ath_file *file);
/* File vertex i is vertex vertex_source[i] of the source; branches likewise. */
ATH_API const int32_t *ath_vertex_source(const ath_file *file);
ATH_API const int32_t *ath_branch_source(const ath_file *file);
/* Seconds, frame_count of them, increasing within a clip. */
ATH_API const double *ath_times(const ath_file *file);

typedef enum ath_order { ATH_FILE_ORDER = 0, ATH_SOURCE_ORDER = 1 } ath_order;

/* Reads the rest pose of the source where it has a chunk of its own, SOURCE_REST, which stands behind all motion: no
 * player needs it. It is coded about a reference pose, the finest one that ath_refine_size has read; read again with a
 * finer one it comes out closer to the source's. Files without the chunk need nothing read: ATH_OK. ATH_MISSING,
 * ATH_BAD_CHECKSUM, ATH_BAD_CHUNK. */
ATH_API int ath_read_rest(ath_file *file, ath_fault_info *fault);
/* The rest pose of the source, for binding, normals and the like: vertex_count positions, `stride` bytes apart. Where
 * the source gave none it is the finest reference pose, see below, that ath_refine_size has read. Where
 * info.rest_is_float64 is 0 the source's numbers were floats: what the file's arithmetic has as doubles is rounded to them.
 * ATH_NEEDS_HOST_MESH; ATH_MISSING: ath_read_rest has not read it. */
ATH_API int ath_rest(const ath_file *file, ath_order order, float *xyz, size_t stride);
ATH_API int ath_rest_float64(const ath_file *file, ath_order order, double *xyz, size_t stride);
/* The reference pose of a level, which it moves and which its matrices apply to: the rest pose of the source, or another
 * that the motion is closer to, such as its mean. The same for all levels with nodes above level 0. ATH_BAD_ARGUMENT for
 * no level of the file, and where ath_refine_size has not read it; ATH_NEEDS_HOST_MESH. */
ATH_API int ath_level_rest(const ath_file *file, int32_t level, ath_order order, double *xyz, size_t stride);

/* How errors of all vertices in all frames are made one number: the largest; what at most a hundredth of them exceeds,
 * which says what is seen where single vertices stray; the root of the mean square. */
typedef enum ath_measure { ATH_LARGEST = 0, ATH_P99 = 1, ATH_RMS = 2 } ath_measure;
enum { ATH_MEASURES = 3 };

/* Error of showing `level` in these segments, measured by the encoder, scene units; rounded up by at most a 32nd.
 * Segments of one clip: quiet ones are shown well by coarser levels than wild ones. */
ATH_API double ath_level_error(const ath_file *file, int32_t level, int32_t first_segment, int32_t last_segment,
                               ath_measure measure);

/* The same of each segment: level_count x segment_count x ATH_MEASURES of them. */
ATH_API const double *ath_errors(const ath_file *file);

/* What a level is, for people: "depth 1", the levels of the branch hierarchy; "layer 2 of 3", each of all branches ("all
 * branches" where there is one layer); "lossless". Writes it with a zero behind it into at most `capacity` bytes, and
 * returns its length without the zero. ATH_LEVEL_NAME bytes hold any. */
enum { ATH_LEVEL_NAME = 32 };
ATH_API size_t ath_level_name(const ath_file *file, int32_t level, char *text, size_t capacity);

/* First frame of a segment (for segment_count: frame_count), and the segment that a frame is in. */
ATH_API int32_t ath_segment_start(const ath_file *file, int32_t segment);
ATH_API int32_t ath_segment_of(const ath_file *file, int32_t frame);

/* The chunk table, in file order, unknown optional kinds included. Payloads: FORMAT.md. Static data (METADATA,
 * ATTRIBUTE) is handed over as stored, zstd frames and all; check it with ath_check_chunk before use. */
typedef struct ath_chunk {
    const uint8_t *bytes; /* null: not fed */
    uint64_t offset;
    uint32_t length, checksum;
    uint32_t segment;
    uint16_t kind;
    uint8_t level; /* ATH_NO_LEVEL: not of a level */
    uint8_t reserved;
} ath_chunk;

ATH_API const ath_chunk *ath_chunks(const ath_file *file);
/* ATH_OK, ATH_MISSING or ATH_BAD_CHECKSUM. fault: null, or what that is about. */
ATH_API int ath_check_chunk(const ath_file *file, int32_t index, ath_fault_info *fault);

/* Polygons of FACES, or edges of EDGES: faces of as many `columns` each or, where is_mixed is 1, of numbers of corners of
 * their own. The types are those of the source's arrays: bits 0 and 1: 1, 2, 4 or 8 bytes; bit 2: signed; bit 3: its bytes
 * stood the other way, high ones first. Where is_derived is 1 the edges are not stored: one from each vertex but the
 * first of a root to the one before it on its stem, or else to the attach vertex. */
typedef struct ath_polygons {
    uint32_t face_count, corner_count, columns;
    uint8_t is_mixed, is_derived, index_type, count_type;
} ath_polygons;

/* kind: ATH_FACES or ATH_EDGES. ATH_MISSING, ATH_BAD_CHECKSUM, ATH_BAD_CHUNK, ATH_LIMIT_EXCEEDED; ATH_BAD_ARGUMENT where the
 * file has none. fault: null, or what that is about. */
ATH_API int ath_polygons_of(const ath_file *file, int kind, ath_polygons *shape, ath_fault_info *fault);
/* Reads them in `memory`, which is scratch, of ath_polygons_size bytes: corner_count vertices in source order, and
 * face_count numbers of corners where is_mixed is 1 (else null). The same, ATH_NO_MEMORY. */
ATH_API size_t ath_polygons_size(const ath_file *file);
ATH_API int ath_read_polygons(const ath_file *file, int kind, void *memory, size_t memory_bytes, uint32_t *counts,
                              int32_t *corners, ath_fault_info *fault);

/* ---- bytes ------------------------------------------------------------------------------------------------------- */

/* `bytes` are the file's from `offset` on, `size` of them. Chunks that lie wholly inside can be used from now on,
 * others are left alone: for a download that grows or arrives in pieces, feed the joined piece again. Any order. */
ATH_API void ath_feed(ath_file *file, const uint8_t *bytes, uint64_t offset, size_t size);
/* Forgets chunks that touch this range, so that their bytes can go: not those that a preparation has begun to read. */
ATH_API void ath_drop(ath_file *file, uint64_t offset, uint64_t size);

typedef struct ath_range {
    uint64_t offset, size;
} ath_range;

/* Bytes that the segments first to last need for `level` and that have not been fed; with `all` those that have been,
 * too; those of segments that they are joined to among them. Ascending, neighbours joined. Returns their number, of which
 * at most `capacity` are written. */
ATH_API int32_t ath_ranges(const ath_file *file, int32_t level, int32_t first_segment, int32_t last_segment, int all,
                           ath_range *ranges, int32_t capacity);

/* The deepest level that a segment can be prepared at with what has been fed; -1: none. */
ATH_API int32_t ath_ready_level(const ath_file *file, int32_t segment);

/* ---- levels ------------------------------------------------------------------------------------------------------ */

/* A level cuts the plant into parts: nodes, subtrees that move by one matrix, and exact runs, stems whose vertices
 * have positions of their own. Parts ascend and hold every vertex once. The last level is exact throughout. */
typedef struct ath_part {
    int32_t first, count; /* vertices */
    int32_t branch;       /* of a node; -1 for an exact run */
    int32_t index;        /* of a node's matrix, or of a run's first vertex among the exact ones */
} ath_part;

/* Numbers of parts, of nodes (matrices) and of exact vertices at a level. Any result may be null. */
ATH_API void ath_cut_size(const ath_file *file, int32_t level, int32_t *parts, int32_t *nodes, int32_t *exact_vertices);
/* Fills ath_cut_size's number of parts. */
ATH_API void ath_cut(const ath_file *file, int32_t level, ath_part *parts);

/* ---- preparing --------------------------------------------------------------------------------------------------- */

/* Bytes that an ath_work needs to prepare any segment of the file, and that a prepared segment at a level takes. */
ATH_API size_t ath_work_size(const ath_file *file);
ATH_API size_t ath_segment_size(const ath_file *file, int32_t level);

/* Begins to prepare a segment at a level, once ath_build has run; the ath_work and the ath_segment are their memories.
 * Only bytes of this segment, of the one that it is joined to, and of levels up to this one are read. ATH_OK, ATH_MISSING,
 * ATH_NO_MEMORY, ATH_BAD_ARGUMENT, ATH_NEEDS_HOST_MESH. */
ATH_API int ath_prepare_start(void *work, size_t work_bytes, const ath_file *file, int32_t segment, int32_t level,
                              void *memory, size_t memory_bytes);
/* Goes on for `steps` steps, each a bounded piece of work: at most 64 vertices, or one matrix, over the segment's
 * frames. ATH_MORE until it is done: ATH_OK, and the segment can be played. ATH_BAD_CHECKSUM, ATH_BAD_CHUNK: it
 * cannot be, and further steps are an ATH_BAD_ARGUMENT. */
ATH_API int ath_prepare_step(ath_work *work, int32_t steps);
/* Segments may be joined to the one before them in their clip, the first of a loop to its last, so that motion does not
 * tick where they meet. Such a segment takes the end of that one: the first steps decode it anew, ATH_MISSING where it lacks
 * bytes, unless
 *     ath_follow, between the call that begins the preparation and its first step, hands over the segment that it is joined
 * to, prepared at the same level. It is read at once. ATH_BAD_ARGUMENT: it is not that; nothing has changed. ATH_OK, too, for
 * a preparation that takes no end.
 *     ath_joined_to: the segment that one is joined to at a level, -1: to none. */
ATH_API int ath_follow(ath_work *work, const ath_segment *before);
/* Between the call that begins a preparation and its first step: the segment's positions go to memory of the caller's, frame by
 * frame, 3 floats (info.is_float64: doubles) a vertex, as ath_positions would copy them; of its own memory, their part stays
 * untouched. They have to stay there as long as the segment is used. ATH_BAD_ARGUMENT, and nothing has changed, where
 * ath_positions would not only copy: the order of the file is not the source's, frames of the segment repeat, or the level
 * has nodes. */
ATH_API int ath_prepare_to(ath_work *work, void *positions);
ATH_API int32_t ath_joined_to(const ath_file *file, int32_t segment, int32_t level);
/* Over how many frames, 0: not at all; ATH_JOIN_SLOPED above that where velocities are joined, too: level_count x
 * segment_count of them. */
enum { ATH_JOIN_SLOPED = 128 };
ATH_API const uint8_t *ath_joins(const ath_file *file);

/* Of each frame whether it shows the very positions of the one before, at all levels: such frames take no bytes. */
ATH_API const uint8_t *ath_repeats(const ath_file *file);
/* What the error of the preparation is about, and which bytes ATH_MISSING: of _start once it had its memory, of
 * _step. */
ATH_API void ath_work_fault(const ath_work *work, ath_fault_info *fault);
/* How many steps that takes in all. */
ATH_API int32_t ath_prepare_steps(const ath_file *file, int32_t segment, int32_t level);
/* Both at once. */
ATH_API int ath_prepare(void *work, size_t work_bytes, const ath_file *file, int32_t segment, int32_t level,
                        void *memory, size_t memory_bytes);

/* Going on. A segment that is prepared at a level of all vertices, from info.depth_levels - 1 on, can be prepared at a
 * deeper one from there: chunks of levels up to its own are not read again, and may have been dropped. For that the
 * preparation at the first of the two levels keeps its integers, in memory of the caller's:
 *     ath_keep, between the call that begins that preparation and its first step. No size below ath_keep_size is sure to
 * do, but a hundredth mostly does: where there is no room, nothing is kept. ATH_NO_MEMORY: not even for a few bytes.
 *     ath_kept_size, after its last step: how many bytes are in use; 0: nothing is kept. They hold no pointers: copy them
 * where they take no more than that.
 *     ath_prepare_onward, in place of ath_prepare_start, of the segment that `from` is. `from` and `kept` stay as they
 * are until the last step, which comes after at most ath_prepare_steps; `from` can be played whatever comes of it.
 * ATH_BAD_ARGUMENT, too, where ath_goes_on says 0: `level` is no deeper than that of `from`, or `kept` is not of its
 * segment and level.
 *     ath_onward_ranges: ath_ranges without what only levels up to `from_level` need, and of these segments alone: what
 * the one that the first is joined to needs is left to ath_ranges, or to ath_follow.
 * ath_keep_size is 0 where nothing is to be kept: at levels that no other goes on from, and at the one before the
 * source's own numbers, which go on from the positions of `from`, and null for `kept`. */
ATH_API size_t ath_keep_size(const ath_file *file, int32_t level);
ATH_API int ath_keep(ath_work *work, void *memory, size_t memory_bytes);
ATH_API size_t ath_kept_size(const void *kept);
ATH_API int ath_goes_on(const ath_file *file, const ath_segment *from, const void *kept, int32_t level);
ATH_API int ath_prepare_onward(void *work, size_t work_bytes, const ath_file *file, const ath_segment *from,
                               const void *kept, int32_t level, void *memory, size_t memory_bytes);
ATH_API int32_t ath_onward_ranges(const ath_file *file, int32_t from_level, int32_t level, int32_t first_segment,
                                  int32_t last_segment, int all, ath_range *ranges, int32_t capacity);

/* Of a prepared segment; -1 where it is not (not yet, or damaged). */
ATH_API int32_t ath_segment_index(const ath_segment *segment);
ATH_API int32_t ath_segment_level(const ath_segment *segment);

/* ---- playing ----------------------------------------------------------------------------------------------------- */

/* ATH_AS_MARKED: ATH_LOOP for clips that are loops, else ATH_CLAMP. */
typedef enum ath_wrap { ATH_CLAMP = 0, ATH_LOOP = 1, ATH_PING_PONG = 2, ATH_AS_MARKED = 3 } ath_wrap;

/* Where on the file's frames a time, in seconds since the clip's first frame, is: from that to the clip's last and,
 * for a loop, on to the frame behind it, as the last frame blends into the first over the mean frame time. */
ATH_API double ath_frame_at(const ath_file *file, int32_t clip, double seconds, ath_wrap wrap);

/* The frames that a place on the frames lies between, and the weight of the second; the same one twice where that is 0.
 * Behind the last frame of a clip is its first. */
typedef struct ath_blend {
    int32_t frame[2], segment[2];
    double weight;
} ath_blend;

ATH_API ath_blend ath_blend_at(const ath_file *file, double frame);

/* What follows shows a place on the frames from prepared segments, of which any number may be handed over; nulls and
 * unprepared ones are passed over. Between two frames it is their blend. Where they are in two segments of which one
 * is there, or both at different levels, the nearer frame that is there is shown (ATH_HELD). ATH_OK, ATH_HELD,
 * ATH_NOT_PREPARED: nothing was written. Playing backwards or at random costs the same as forwards. */

/* All vertices, `stride` bytes apart; those of nodes are moved by their matrices. */
ATH_API int ath_positions(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                          ath_order order, float *xyz, size_t stride);
ATH_API int ath_positions_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                  double frame, ath_order order, double *xyz, size_t stride);

/* For skinning on the GPU: one matrix per node of the cut, 12 floats, `stride` bytes apart, from rest positions
 * (ath_level_rest) to positions; and the exact vertices, which no matrix moves. A renderer needs both: at the last level of
 * the hierarchy and at those beyond there are no matrices, at level 0 nothing but. */
ATH_API int ath_matrices(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                         float *matrices, size_t stride);
ATH_API int ath_matrices_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                 double frame, double *matrices, size_t stride);
ATH_API int ath_exact(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                      float *xyz, size_t stride);
ATH_API int ath_exact_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                              double frame, double *xyz, size_t stride);
/* The level that these show, which tells how many matrices and exact vertices there are; -1: none has the frame. */
ATH_API int32_t ath_shown_level(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                double frame);

/* ---- from level to level ----------------------------------------------------------------------------------------- */

/* A plant whose level changes would jump by the distance of the two. A fade goes from level to level over a moment, 0.2
 * seconds say, without a jump and without a jerk: levels that are faded out and in are blended, with weights that change
 * smoothly, also where a change overtakes the one before. It is begun with zeros, by ath_fade fade = {0}. */
enum { ATH_FADE_LEVELS = 4 };
typedef struct ath_fade {
    int32_t count;                  /* of levels that are shown; 0: none yet; 1: nothing fades */
    int32_t level[ATH_FADE_LEVELS]; /* the one that is gone to last; one may be there twice */
    double weight[ATH_FADE_LEVELS]; /* they add up to 1 */
    double passed[ATH_FADE_LEVELS]; /* how far the change to each but the first has come, 0 to 1 */
} ath_fade;

/* Once per drawn frame: the level to show, prepared by now, and the time since the last call as a share of what a fade
 * takes: seconds / 0.2. A share of 1 or more, and the first level of all, show the level at once. Where ATH_FADE_LEVELS
 * are shown already a further one waits for its turn. */
ATH_API void ath_fade_to(ath_fade *fade, int32_t level, double share);
/* The deepest of its levels, whose cut the matrices and exact vertices below are of; -1: it has none. */
ATH_API int32_t ath_fade_cut(const ath_fade *fade);

/* As ath_positions, ath_matrices and ath_exact, but of all levels of a fade, blended: the segments of each are handed over,
 * so that those that fade out stay prepared as long as the fade names them. Matrices are of the nodes of ath_fade_cut's
 * level, and exact vertices those of that level: bind vertices by ath_cut of it. Where it is above 0, both are about the
 * ath_level_rest of level 1, also what level 0 gives to them: a renderer that shows level 0, too, on that has no jump there.
 * ATH_NOT_PREPARED: a level that has a weight lacks the frame, or no segment is of the deepest level; nothing was written.
 * With one level the numbers have the bits of the functions above. */
ATH_API int ath_faded_positions(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                double frame, const ath_fade *fade, ath_order order, float *xyz, size_t stride);
ATH_API int ath_faded_matrices(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                               double frame, const ath_fade *fade, float *matrices, size_t stride);
ATH_API int ath_faded_exact(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                            double frame, const ath_fade *fade, float *xyz, size_t stride);

/* ---- several clips at once --------------------------------------------------------------------------------------- */

/* Up to four clips of a file blended, from calm to storm or between headings of the wind, each at its own frame and level.
 * What each shows is taken apart along the hierarchy and blended there: edges of stems by direction and length, sheets by
 * rotation and by what they keep from it. So branches stay where they hang, and an edge of a stem is as long as those of
 * the clips in their weighted mean. Roots take the mean of positions. */
enum { ATH_BLEND_CLIPS = 4 };
typedef struct ath_share {
    const ath_segment *const *segments; /* as for ath_positions */
    int32_t segment_count;
    double frame, weight;
} ath_share;

/* Weights need not add up to 1. Shares of none (or less) are passed over and need no segments; where only one is left the
 * numbers have the bits of ath_positions. memory: ath_blend_size, scratch. ATH_OK, ATH_HELD; ATH_NOT_PREPARED,
 * ATH_NO_MEMORY; ATH_BAD_ARGUMENT: no share has a weight, one is infinite, or there are more than ATH_BLEND_CLIPS: nothing
 * was written. */
ATH_API size_t ath_blend_size(const ath_file *file);
ATH_API int ath_blended_positions(const ath_file *file, const ath_share *shares, int32_t share_count, ath_order order,
                                  float *xyz, size_t stride, void *memory, size_t memory_bytes);

/* The wind of a clip, as its metadata name it: the heading in degrees. A strength that is not finite: it has none. */
typedef struct ath_wind {
    double strength, heading;
} ath_wind;

/* Weights of clips for a wanted wind, of which at most four are above 0; they add up to 1 and change without a jump. They
 * are bilinear in strength and heading: between the two strengths of clips that are next to the wanted one by how near each
 * is, and in each of them between the clips whose headings are next to the wanted one on either side of the circle.
 * Beyond the calmest and the wildest clip these are shown. Of clips of one wind the first; where none has any, clip 0. */
ATH_API void ath_wind_weights(const ath_wind *clips, int32_t clip_count, double strength, double heading,
                              double *weights);

/* ---- level of detail --------------------------------------------------------------------------------------------- */

/* The coarsest stored level whose error, seen from `distance` (scene units) under a vertical field of view
 * of `fov` (radians) on a screen of `height` pixels, is at most `pixels` in these segments; the deepest level where
 * none is. So that a level does not flicker at its boundary, go finer when the one for `pixels` is deeper than the
 * one shown, and coarser only when the one for a smaller `pixels` is shallower: examples/play.c does. (Song, Yang
 * and Peng 2011: the view-dependent choice.) */
ATH_API int32_t ath_level_for(const ath_file *file, int32_t first_segment, int32_t last_segment, ath_measure measure,
                              double distance, double fov, double height, double pixels);

/* CRC-32C (Castagnoli) of `size` bytes, continuing from `crc` (0 to start). */
ATH_API uint32_t ath_crc32c(uint32_t crc, const uint8_t *bytes, size_t size);

#ifdef __cplusplus
}
#endif
#endif
