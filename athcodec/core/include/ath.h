/* athcodec plays .ath files. This header is the whole public C API; FORMAT.md describes the files.
 *
 *     ath_front -> ath_open -> ath_build        once per file: read the header, the hierarchy and the rest pose
 *     ath_set_host_mesh                         before ath_build, if the rest pose is a mesh that the host has
 *     ath_fault_text                            say in a sentence why a file is refused
 *     ath_refine                                once per level
 *     ath_ranges, ath_feed                      ask which bytes a level needs, and hand them over
 *     ath_array_named, ath_metadata_of          get the source's named arrays, such as "uv", and its metadata
 *     ath_prepare, or _start and _step          decode one segment at one level
 *     ath_prepare_to                            write all positions of a segment to memory of yours
 *     ath_keep, ath_prepare_onward              prepare a deeper level of a segment from the one that is prepared
 *     ath_positions, ath_matrices, ath_exact    get what to draw at a time, as often as you like
 *     ath_level_for                             choose the level to draw at a distance
 *     ath_fade_to, ath_faded_positions          go from one level to the next without a jump
 *     ath_blended_positions, ath_wind_weights   blend several clips, such as calm and storm
 *
 * Memory. No function allocates, and there are no globals. You ask for a size, provide that many bytes aligned to 16
 * (decoding is fastest with 64), and keep them while they are in use. To free an object, free its memory. An ath_file
 * holds pointers into the bytes that you fed to it: leave these bytes in place until you feed them anew or drop them.
 *
 * Threads. Functions that take a const object may run in parallel on it. One ath_work serves one thread at a time; any
 * number of them may prepare segments of one ath_file while others play. While ath_feed, ath_drop, ath_refine_size or
 * ath_refine runs, no other thread may prepare or call functions on chunks and ranges; playing may go on.
 * ath_set_host_mesh and ath_build run alone.
 *
 * Hostile input. Functions that read a file's bytes never read or write out of bounds, whatever the bytes are. They
 * need no more memory than they said, and run in time linear in it. Counts, levels and pointers from the caller are
 * trusted, unless a function says what it returns for bad ones.
 *
 * Units and layout. Positions and errors are in the file's scene units, time is in seconds, and frames count from 0.
 * Matrices are 3x4, row-major: x' = m[0] x + m[1] y + m[2] z + m[3], and so on. Vertices, branches and nodes come in
 * file order, where every subtree is one range of vertices, unless you ask for source order with an ath_order.
 *
 * Exactness. Decoded positions have the same bits on every machine, in WebAssembly and in Python, at whole frames and
 * between them. Contraction to FMA, which would change them, is switched off; -ffast-math and x87 are refused.
 *
 * Requirements. The core is C11 or C++17. It needs memcpy, memmove and memset, sqrt as an instruction
 * (-fno-math-errno), and nothing else. */
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

/* Codes below 64 are errors of a file (FORMAT.md, "Errors"). They never change. Codes from 64 on are about a call. */
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
    ATH_MORE = 64,         /* not an error: there is more to do, so call again */
    ATH_HELD = 65,         /* not an error: the frame to blend with is not prepared, so the nearer one is shown */
    ATH_MISSING = 66,      /* bytes that this needs have not been fed */
    ATH_NOT_PREPARED = 67, /* no segment that you passed has this frame at the level that is needed */
    ATH_NO_MEMORY = 68,    /* the memory is too small, or not aligned to 16 */
    ATH_BAD_ARGUMENT = 69  /* a level or segment that the file does not have */
} ath_result;

/* Returns the name of a code in FORMAT.md, such as "BAD_CHUNK"; "UNKNOWN" if there is no such code. */
ATH_API const char *ath_result_name(int result);

/* ---- constants of the format ------------------------------------------------------------------------------------- */

/* A decoder reads files of every minor version. ATH_FEATURES has a bit for each known feature. */
enum { ATH_FORMAT_MAJOR = 1, ATH_FORMAT_MINOR = 0, ATH_FEATURES = 0 };

/* Kinds of chunks. A decoder skips unknown kinds with the bit ATH_OPTIONAL. */
enum {
    ATH_OPTIONAL = 0x8000,
    ATH_HIERARCHY = 1,
    ATH_REST = 2,
    ATH_TIME = 3,
    ATH_METADATA = ATH_OPTIONAL | 4,
    ATH_FACES = 5,
    ATH_EDGES = ATH_OPTIONAL | 6,
    ATH_CLIPS = 7,
    ATH_PLACES = 8,
    ATH_STEMS = 16,
    ATH_AFFINES = 17,
    ATH_CORRECTIONS = 18,
    ATH_SHAPES = 19, /* one for all segments, in segment 0 */
    ATH_EXACT = 20,
    ATH_REFINED_REST = 21, /* one for all segments, in segment 0 */
    ATH_PREDICTED = 22,
    ATH_ATTRIBUTE = ATH_OPTIONAL | 32,
    ATH_SOURCE_REST = 33
};

enum { ATH_NO_LEVEL = 255 }; /* level of a chunk that belongs to no level */

/* Returns the name of a kind, such as "STEMS"; null if it is unknown. */
ATH_API const char *ath_kind_name(int kind);

/* ath_limits.memory_bytes limits places * (ATH_BYTES_PER_FRAME * F + ATH_BYTES_PER_VERTEX), where F is the number of
 * frames of the longest segment, plus ATH_BYTES_PER_TWIN for each vertex that shares the place of another. */
enum { ATH_BYTES_PER_FRAME = 60, ATH_BYTES_PER_VERTEX = 512, ATH_BYTES_PER_TWIN = 32 };

/* ---- faults ------------------------------------------------------------------------------------------------------ */

/* The subject of a fault. Most are fields of FORMAT.md: ATH_FIELD_VERTEX_COUNT is Vertex_Count. */
typedef enum ath_field {
    ATH_FIELD_NONE,
    ATH_FIELD_MAGIC,        /* the four bytes that are wrong, as a big-endian number */
    ATH_FIELD_VERSION,      /* major << 8 | minor */
    ATH_FIELD_FEATURES,     /* bits beyond ATH_FEATURES; `most` is the file's version, `least` the decoder's */
    ATH_FIELD_FILE_SIZE,    /* bytes that are there, if the caller knows that no more will come */
    ATH_FIELD_HEADER_SIZE,  /* bytes that are there */
    ATH_FIELD_FRONT_SIZE,   /* bytes that are there, or Front_Length */
    ATH_FIELD_TABLE_SIZE,   /* bytes of the chunk table and the error table, against the limit */
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
    ATH_FIELD_ERROR,         /* an entry of the error table; level and segment say which */
    ATH_FIELD_JOIN,          /* the frames that a segment is joined over; level and segment say where */
    ATH_FIELD_REPEAT,        /* a first frame of a segment that repeats the frame before */
    ATH_FIELD_FRONT,         /* the end of the front's stream */
    ATH_FIELD_MEMORY,        /* bytes that a segment may take */
    ATH_FIELD_MISSING_CHUNK, /* a chunk that the table lacks: kind, level and segment say which */
    ATH_FIELD_CHUNK_KIND,    /* this field and those up to CONTENT are about one chunk */
    ATH_FIELD_CHUNK_SIZE,    /* bytes that are there, or against the limit */
    ATH_FIELD_CHUNK_LEVEL,
    ATH_FIELD_CHUNK_SEGMENT,
    ATH_FIELD_CHUNK_PLACE, /* index in the chunk table */
    ATH_FIELD_UNEXPECTED_CHUNK,
    ATH_FIELD_CHUNK_CHECKSUM,
    ATH_FIELD_HIERARCHY_DEPTH,
    ATH_FIELD_CONTENT,
    ATH_FIELD_HOST_MESH, /* missing: `least` is the first checksum of the mesh that is needed, `most` its vertices */
    ATH_FIELD_HOST_VERTEX_COUNT, /* vertices of the mesh that was passed */
    ATH_FIELD_HOST_VERTEX,       /* vertex of the mesh with a number that is not finite */
    ATH_FIELD_HOST_CHECKSUM      /* the checksum of the mesh that differs, or its first one */
} ath_field;

/* Says why a file was refused, or what is missing of it (ATH_MISSING). */
typedef struct ath_fault_info {
    int32_t code;  /* ath_result; ATH_OK: there is no fault, and the other fields mean nothing */
    int32_t field; /* ath_field */
    int32_t chunk; /* index in ath_chunks; -1: none */
    uint16_t kind; /* kind of that chunk, or of the one that is missing */
    uint8_t level;
    uint8_t reserved;
    uint32_t segment;
    uint64_t offset;           /* offset of the chunk in the file */
    double found, least, most; /* the value found and the values allowed; integers below 2^53 are exact */
} ath_fault_info;

/* Writes the fault as one line of English, "where: got this; expected that", with a terminating zero, into at most
 * `capacity` bytes. Returns the length without the zero, even if it does not fit. ATH_FAULT_TEXT bytes always
 * suffice. */
enum { ATH_FAULT_TEXT = 256 };
ATH_API size_t ath_fault_text(const ath_fault_info *fault, char *text, size_t capacity);

/* ---- opening ---------------------------------------------------------------------------------------------------- */

typedef struct ath_file ath_file;       /* an opened file */
typedef struct ath_work ath_work;       /* scratch memory and state of one preparation at a time */
typedef struct ath_segment ath_segment; /* one prepared segment at one level */

/* Largest counts and sizes that a file may have. FORMAT.md, "Limits", has those of both profiles. The defaults are those
 * of the full profile; the small one is for telephones and web pages. */
typedef struct ath_limits {
    uint32_t chunks, table_bytes, vertices, branches, frames, hierarchy_depth, chunk_bytes;
    uint32_t reserved;
    uint64_t memory_bytes;
} ath_limits;

ATH_API void ath_default_limits(ath_limits *limits);
ATH_API void ath_small_limits(ath_limits *limits);

/* Looks at the front of a file, of which `available` bytes are there. ATH_OK: the prelude, up to the first motion
 * chunk, has *front_bytes, and ath_open needs *memory_bytes. ATH_MISSING: call again with at least *front_bytes. If
 * *memory_bytes is not 0, the front is complete: call ath_open once *front_bytes are there. Every other result is an
 * error of the file. limits: null for the defaults. fault: may be null. */
ATH_API int ath_front(const uint8_t *bytes, size_t available, const ath_limits *limits, size_t *front_bytes,
                      size_t *memory_bytes, ath_fault_info *fault);

/* Opens a file in `memory`, from at least its prelude, and feeds it all of `bytes`. Cast `memory` to ath_file *. The
 * checks are those of FORMAT.md, "Opening", for a stream, in that order. Returns ATH_OK, an error of the file,
 * ATH_MISSING or ATH_NO_MEMORY. limits, fault: see ath_front. */
ATH_API int ath_open(void *memory, size_t memory_bytes, const uint8_t *bytes, size_t available,
                     const ath_limits *limits, ath_fault_info *fault);

/* These do the work of ath_open, ath_refine_size and ath_refine in slices: each runs steps until their cost exceeds *cost,
 * in the unit of ath_prepare_within, and subtracts it. ATH_MORE: call it again before any other function that changes the
 * file or its bytes. A step costs at most 98304, or 1 for each vertex or frame of the file, or 16 for each vertex of one
 * branch; a lossless rest pose is one step. ath_open_start reads the front and returns ATH_MORE, or an error of ath_open;
 * ath_open_within reads the rest and finds its faults. Without ath_build, ath_refine_within from level 0 on does its work,
 * in memory that ath_refine_size_within adds. */
ATH_API int ath_open_start(void *memory, size_t memory_bytes, const uint8_t *bytes, size_t available,
                           const ath_limits *limits, ath_fault_info *fault);
ATH_API int ath_open_within(ath_file *file, int32_t *cost, ath_fault_info *fault);
ATH_API int ath_refine_size_within(ath_file *file, int32_t level, size_t *memory_bytes, int32_t *cost,
                                   ath_fault_info *fault);
ATH_API int ath_refine_within(ath_file *file, int32_t level, void *memory, size_t memory_bytes, int32_t *cost);

/* Gives the rest pose to a file whose info.rest_is_host is 1: the mesh that the file was made for. `xyz` points to
 * `vertex_count` positions of three floats, `stride` bytes apart, at any alignment; a vertex buffer will do. They are
 * the source's numbers in its order, units and axes, as loaded: not scaled or turned, and bit for bit the same, except
 * that -0.0 counts as 0.0. The file copies them.
 *     Without the mesh you can open, query and feed the file. ath_build, ath_refine_size, ath_refine, ath_rest,
 * ath_level_rest and every preparation return ATH_NEEDS_HOST_MESH.
 *     ATH_WRONG_HOST_MESH: the number of vertices or a checksum differs, or a number is not finite; nothing has
 * changed. If the file holds its rest pose, the mesh is ignored (ATH_OK). */
ATH_API int ath_set_host_mesh(ath_file *file, const void *xyz, size_t stride, int32_t vertex_count,
                              ath_fault_info *fault);

/* Computes what all segments share at level 0, in memory of ath_build_size bytes, which depends on the plant and its
 * rest pose, and in which ath_refine goes on. Call ath_build once, before you prepare anything. Returns ATH_OK,
 * ATH_NO_MEMORY or ATH_NEEDS_HOST_MESH. */
ATH_API size_t ath_build_size(const ath_file *file);
ATH_API int ath_build(ath_file *file, void *memory, size_t memory_bytes);

/* Levels 0 to info.depth_levels - 1 follow the branch hierarchy at the precision of the first layer. Each further level
 * refines all of the plant by one layer or more. Any level may refine the rest pose, too. Before you prepare a level,
 * and after ath_build, build what the segments share at that level:
 *     ath_refine_size reads the rest poses up to that level from their REFINED_REST chunks, which ath_ranges lists
 * until they are read. It gives the memory that ath_refine needs, which may be 0. Returns ATH_OK, ATH_MISSING,
 * ATH_BAD_CHECKSUM, ATH_BAD_CHUNK, ATH_BAD_ARGUMENT or ATH_NEEDS_HOST_MESH.
 *     ath_refine builds what is not built yet, in memory that you keep as long as the file's. Returns the same codes,
 * or ATH_NO_MEMORY. For a level that is built, both calls do nothing. */
ATH_API int ath_refine_size(ath_file *file, int32_t level, size_t *memory_bytes, ath_fault_info *fault);
ATH_API int ath_refine(ath_file *file, int32_t level, void *memory, size_t memory_bytes);

/* ---- what a file holds ------------------------------------------------------------------------------------------- */

typedef struct ath_info {
    uint64_t file_length, prelude_length;
    double max_error; /* error bound of the deepest stored level, scene units */
    double origin[3];
    int32_t vertex_count; /* vertices of the source, which ATH_SOURCE_ORDER has */
    int32_t place_count;  /* places of vertices, which ATH_FILE_ORDER has; as many, or fewer where some coincide */
    int32_t branch_count;
    int32_t frame_count, segment_count; /* sums over all clips */
    int32_t clip_count;
    int32_t level_count;      /* stored levels: 0 to level_count - 1 */
    int32_t full_level_count; /* levels of the file before it was truncated */
    int32_t layer_count;      /* layers of precision before truncation; 1: no level refines another */
    int32_t depth_levels;     /* levels up to the first of all vertices; deeper levels are refinements */
    int32_t node_count, chunk_count;
    int32_t is_float64;        /* 1: decoded positions are doubles, else floats */
    int32_t rest_is_float64;   /* 1: the rest pose has doubles, else floats */
    int32_t rest_is_host;      /* 1: the host has the rest pose, see ath_set_host_mesh */
    uint32_t host_checksum[2]; /* CRC-32C of the host's mesh as little-endian bytes, forwards and backwards */
    int32_t is_predicted;      /* 1: all levels except level 0 are predicted motion */
} ath_info;

ATH_API void ath_get_info(const ath_file *file, ath_info *info);

/* A clip. Frames and segments are numbered over the whole file, one clip after the other. */
typedef struct ath_clip {
    const char *name; /* UTF-8, zero-terminated; empty if the only clip of a file has no name */
    double duration;  /* seconds from its first frame to its last */
    int32_t first_frame, frame_count;
    int32_t first_segment, segment_count;
    int32_t loop;     /* 1: its first frame follows its last */
    int32_t periodic; /* 1: a loop of one segment, coded by functions of time that are periodic */
} ath_clip;

/* Returns info.clip_count clips. */
ATH_API const ath_clip *ath_clips(const ath_file *file);
/* Returns the index of the clip with a name; -1: none has it. */
ATH_API int32_t ath_clip_named(const ath_file *file, const char *name);
/* Returns the largest error, in scene units, of any vertex's step from a loop's last frame to its first; 0 for clips
 * that do not loop. It is known for all info.full_level_count levels, stored or not. */
ATH_API double ath_seam_error(const ath_file *file, int32_t clip, int32_t level);

enum { ATH_SHEET = 1, ATH_LOOSE = 2, ATH_WHOLE = 4, ATH_STILL = 8 };

/* A branch. Parents come before children; the subtree of branch b is the branches b to b + subtree - 1. Vertices are
 * those of ATH_FILE_ORDER. */
typedef struct ath_branch {
    int32_t parent;  /* branch with a smaller index; -1 for a root */
    int32_t count;   /* vertices of the stem, at least 1 */
    int32_t attach;  /* vertex of the parent's stem that the branch hangs on; -1 for a root */
    int32_t flags;   /* ATH_SHEET: flat or compact; ATH_LOOSE: not attached or, of a root, its tree has predicted
                        motion; ATH_WHOLE: its subtree moves as one; ATH_STILL: what it carries does not turn as it
                        bends */
    int32_t lag;     /* vertices after which the rest pose tends to repeat its steps; 0: a beam */
    int32_t first;   /* first vertex */
    int32_t subtree; /* branches in the subtree, this one included */
    int32_t depth;
    int32_t rigid;  /* number of layers, from the first, in which its pieces do not bend */
    int32_t detail; /* 0, or the largest step of its rest pose is 2 to the power of detail / 2 - 64 */
    int32_t ring;   /* vertices of each ring of a tube; 0: the branch is no tube */
} ath_branch;

ATH_API const ath_branch *ath_branches(const ath_file *file);
/* Returns for each of place_count vertices in file order the first vertex of the source that is there. */
ATH_API const int32_t *ath_vertex_source(const ath_file *file);
/* Returns for each of vertex_count vertices of the source the one in file order whose position it has. */
ATH_API const int32_t *ath_vertex_places(const ath_file *file);
/* Returns a permutation: branch i of the file is branch [i] of the source. */
ATH_API const int32_t *ath_branch_source(const ath_file *file);
/* Returns the times of all frames, in seconds. They increase within a clip. */
ATH_API const double *ath_times(const ath_file *file);

/* info.place_count vertices in file order, stem after stem, or info.vertex_count of the source in its order. */
typedef enum ath_order { ATH_FILE_ORDER = 0, ATH_SOURCE_ORDER = 1 } ath_order;

/* Reads the rest pose of the source, if it differs from the reference pose and so has a chunk of its own, SOURCE_REST.
 * The chunk stands behind all motion, since no player needs it. It is coded about the finest reference pose that
 * ath_refine_size has read: read again with a finer one, the result is closer to the source. For files without the
 * chunk there is nothing to do. Returns ATH_OK, ATH_MISSING, ATH_BAD_CHECKSUM or ATH_BAD_CHUNK. */
ATH_API int ath_read_rest(ath_file *file, ath_fault_info *fault);
/* Write the rest pose of the source, for binding and normals: a position for each vertex, `stride` bytes apart. If the
 * source had none, it is the finest reference pose (see ath_level_rest) that ath_refine_size has read. If
 * info.rest_is_float64 is 0, round doubles to float to get the source's numbers. Return ATH_OK, ATH_NEEDS_HOST_MESH, or
 * ATH_MISSING: call ath_read_rest first. */
ATH_API int ath_rest(const ath_file *file, ath_order order, float *xyz, size_t stride);
ATH_API int ath_rest_float64(const ath_file *file, ath_order order, double *xyz, size_t stride);
/* Writes the reference pose of a level, which its matrices apply to: the rest pose of the source, or another pose that
 * the motion is closer to, such as the mean. All levels with nodes above level 0 share one. Returns ATH_OK,
 * ATH_NEEDS_HOST_MESH, or ATH_BAD_ARGUMENT: there is no such level, or ath_refine_size has not read its pose. */
ATH_API int ath_level_rest(const ath_file *file, int32_t level, ath_order order, double *xyz, size_t stride);

/* Summaries of the errors of all vertices in all frames: the largest error; the 99th percentile, which tells what is
 * seen when single vertices stray; the root mean square. */
typedef enum ath_measure { ATH_LARGEST = 0, ATH_P99 = 1, ATH_RMS = 2 } ath_measure;
enum { ATH_MEASURES = 3 };

/* Returns the error of showing `level` in segments of one clip, as the encoder measured it, in scene units. It is
 * rounded up by at most a 32nd. Calm segments have small errors at coarser levels than wild ones. */
ATH_API double ath_level_error(const ath_file *file, int32_t level, int32_t first_segment, int32_t last_segment,
                               ath_measure measure);

/* Returns the errors of single segments: level_count x segment_count x ATH_MEASURES. */
ATH_API const double *ath_errors(const ath_file *file);

/* Writes the name of a level for people: "depth 1" for levels of the branch hierarchy, "layer 2 of 3" for levels of all
 * branches ("all branches" if there is one layer), or "lossless". At most `capacity` bytes are written, with a
 * terminating zero. Returns the length without the zero. ATH_LEVEL_NAME bytes always suffice. */
enum { ATH_LEVEL_NAME = 32 };
ATH_API size_t ath_level_name(const ath_file *file, int32_t level, char *text, size_t capacity);

/* Return the first frame of a segment (frame_count for segment_count), and the segment that holds a frame. */
ATH_API int32_t ath_segment_start(const ath_file *file, int32_t segment);
ATH_API int32_t ath_segment_of(const ath_file *file, int32_t frame);

/* An entry of the chunk table, which is in file order and includes unknown optional kinds. FORMAT.md describes the
 * payloads. The bytes are as stored: call ath_check_chunk before you use them. */
typedef struct ath_chunk {
    const uint8_t *bytes; /* null: not fed */
    uint64_t offset;
    uint32_t length, checksum;
    uint32_t segment;
    uint16_t kind;
    uint8_t level; /* the first level that needs the chunk; ATH_NO_LEVEL: it belongs to no level */
    uint8_t stage; /* Stage in the chunk table; more than `level` if there are stages that are no levels */
} ath_chunk;

ATH_API const ath_chunk *ath_chunks(const ath_file *file);
/* Returns ATH_OK, ATH_MISSING or ATH_BAD_CHECKSUM. fault: may be null. */
ATH_API int ath_check_chunk(const ath_file *file, int32_t index, ath_fault_info *fault);

/* The polygons of FACES or the edges of EDGES. Each face has `columns` corners or, if is_mixed is 1, a number of its
 * own. The types are those of the source's arrays. Bits 0 and 1: 1, 2, 4 or 8 bytes; bit 2: signed; bit 3: big-endian.
 * If is_derived is 1, edges are not stored: each vertex has one to the vertex before it on its stem, the first of a
 * stem to the attach vertex, and the first of a root none. */
typedef struct ath_polygons {
    uint32_t face_count, corner_count, columns;
    uint8_t is_mixed, is_derived, index_type, count_type;
} ath_polygons;

/* Fills `shape` for a kind, ATH_FACES or ATH_EDGES. Returns ATH_OK, ATH_MISSING, ATH_BAD_CHECKSUM, ATH_BAD_CHUNK,
 * ATH_LIMIT_EXCEEDED, or ATH_BAD_ARGUMENT: the file has none. fault: may be null. */
ATH_API int ath_polygons_of(const ath_file *file, int kind, ath_polygons *shape, ath_fault_info *fault);
/* Reads corner_count vertices, numbered as in the source, into `corners` and, if is_mixed is 1, face_count numbers of
 * corners into `counts` (else null). memory: scratch of ath_polygons_size bytes. Returns the same codes, or
 * ATH_NO_MEMORY. */
ATH_API size_t ath_polygons_size(const ath_file *file);
ATH_API int ath_read_polygons(const ath_file *file, int kind, void *memory, size_t memory_bytes, uint32_t *counts,
                              int32_t *corners, ath_fault_info *fault);

/* Bytes of the file. */
typedef struct ath_range {
    uint64_t offset, size;
} ath_range;

/* A named array of the source, such as "uv" or "radius", from an ATTRIBUTE chunk; its number is the chunk's. The numbers
 * of its elements are little-endian, in row-major order. They are packed: unpack the zstd frame with a zstd library,
 * such as ZSTD_decompress(unpacked, array.bytes, array.packed, array.packed_bytes), and refuse the array unless exactly
 * array.bytes bytes come out. Then ath_array_elements puts them in order. */
typedef enum ath_array_kind {
    ATH_BOOLEANS = 0,
    ATH_UNSIGNED = 1,
    ATH_INTEGERS = 2,
    ATH_FLOATS = 3,
    ATH_TEXTS = 4 /* padded with zeros */
} ath_array_kind;
enum { ATH_DIMENSIONS = 32 };
typedef struct ath_array {
    const char *name;             /* UTF-8 without a terminating zero, in the bytes of the chunk */
    const uint8_t *packed;        /* one zstd frame */
    uint64_t packed_bytes, bytes; /* of the frame, and of all elements; both are 0 if a size of the shape is 0 */
    uint32_t name_bytes, kind, item_bytes, dimension_count;
    uint32_t shape[ATH_DIMENSIONS];
} ath_array;

/* Writes the ranges of the arrays that have not been fed, which no level needs and which may stand behind the motion.
 * Ranges ascend, and adjacent ones are merged. Returns their number, of which at most `capacity` are written. */
ATH_API int32_t ath_array_ranges(const ath_file *file, ath_range *ranges, int32_t capacity);
/* Returns the number of the array with a name, among those that have been fed and are valid; -1: none has it. */
ATH_API int32_t ath_array_named(const ath_file *file, const char *name);
/* Fills `array` from the chunk with a number. Returns ATH_OK, ATH_MISSING, ATH_BAD_CHECKSUM, ATH_BAD_CHUNK,
 * ATH_LIMIT_EXCEEDED, or ATH_BAD_ARGUMENT: the chunk is no ATTRIBUTE. fault: may be null. */
ATH_API int ath_array_of(const ath_file *file, int32_t chunk, ath_array *array, ath_fault_info *fault);
/* Writes the array.bytes bytes of all elements, from as many unpacked bytes that are elsewhere in memory. */
ATH_API void ath_array_elements(const ath_array *array, const void *unpacked, void *elements);

/* The metadata: a JSON object in UTF-8 without a terminating zero. That the text is JSON is not checked. */
typedef struct ath_metadata {
    const uint8_t *stored;        /* null: the file has none */
    uint64_t stored_bytes, bytes; /* as stored, and of the text */
    int32_t is_packed;            /* 1: one zstd frame, to be unpacked as that of an array; 0: the text itself */
} ath_metadata;

/* Fills `metadata`. Returns ATH_OK, ATH_BAD_CHECKSUM, ATH_BAD_CHUNK or ATH_LIMIT_EXCEEDED. fault: may be null. */
ATH_API int ath_metadata_of(const ath_file *file, ath_metadata *metadata, ath_fault_info *fault);

/* ---- bytes ------------------------------------------------------------------------------------------------------- */

/* Hands over `size` bytes of the file from `offset` on. Chunks that lie wholly inside can be used from now on; others
 * stay as they are. If a download grows or arrives in pieces, join the pieces and feed them again, in any order. */
ATH_API void ath_feed(ath_file *file, const uint8_t *bytes, uint64_t offset, size_t size);
/* Forgets chunks that touch a range, so that you may free their bytes. Do not drop chunks of a running preparation. */
ATH_API void ath_drop(ath_file *file, uint64_t offset, uint64_t size);

/* Writes the ranges of bytes that the segments first to last, and those that they are joined to, need for `level` and
 * that have not been fed; if `all` is 1, those that have been fed as well. Ranges ascend, and adjacent ones are merged.
 * Returns their number, of which at most `capacity` are written. */
ATH_API int32_t ath_ranges(const ath_file *file, int32_t level, int32_t first_segment, int32_t last_segment, int all,
                           ath_range *ranges, int32_t capacity);

/* Returns the deepest level that a segment can be prepared at with the bytes that have been fed; -1: none. */
ATH_API int32_t ath_ready_level(const ath_file *file, int32_t segment);

/* ---- levels ------------------------------------------------------------------------------------------------------ */

/* A level cuts the plant into parts: nodes, which are subtrees that one matrix moves, and exact runs, which are stems
 * whose vertices have positions of their own. Parts ascend and hold every vertex once. The last level has only runs. */
typedef struct ath_part {
    int32_t first, count; /* vertices in file order, one for each place */
    int32_t branch;       /* branch of a node; -1 for an exact run */
    int32_t index;        /* index of a node's matrix, or of a run's first vertex among the exact vertices */
} ath_part;

/* Counts the parts, the nodes (matrices) and the exact vertices of a level. Any result may be null. */
ATH_API void ath_cut_size(const ath_file *file, int32_t level, int32_t *parts, int32_t *nodes, int32_t *exact_vertices);
/* Fills as many parts as ath_cut_size counts. */
ATH_API void ath_cut(const ath_file *file, int32_t level, ath_part *parts);

/* ---- preparing --------------------------------------------------------------------------------------------------- */

/* Return the bytes that an ath_work needs to prepare any segment, and that a prepared segment takes at a level. */
ATH_API size_t ath_work_size(const ath_file *file);
ATH_API size_t ath_segment_size(const ath_file *file, int32_t level);

/* Begins to prepare a segment at a level, after ath_build. Cast `work` to ath_work *, and `memory` to ath_segment *.
 * Only bytes of this segment and of the one that it is joined to, at levels up to this one, are read. Returns ATH_OK,
 * ATH_MISSING, ATH_NO_MEMORY, ATH_BAD_ARGUMENT or ATH_NEEDS_HOST_MESH. */
ATH_API int ath_prepare_start(void *work, size_t work_bytes, const ath_file *file, int32_t segment, int32_t level,
                              void *memory, size_t memory_bytes);
/* Runs `steps` steps, each a bounded piece of work: at most 64 vertices, or one matrix, over the segment's frames.
 * Returns ATH_MORE until the segment can be played, then ATH_OK. After ATH_BAD_CHECKSUM or ATH_BAD_CHUNK the segment
 * cannot be played, and further steps return ATH_BAD_ARGUMENT. */
ATH_API int ath_prepare_step(ath_work *work, int32_t steps);
/* Does the same, but runs steps until their cost exceeds *cost, and subtracts it. The unit is a vertex-frame: the time
 * of placing one vertex in one frame at one layer of precision, mostly 5 to 20 nanoseconds. A step costs at most 64
 * vertices in all frames of the segment, as often as there are layers, or 16384. */
ATH_API int ath_prepare_within(ath_work *work, int32_t *cost);
/* A segment may be joined to the one before it in its clip (the first of a loop to the last), so that motion does not
 * tick where they meet. Its preparation needs the end of that segment, and decodes it anew in its first steps
 * (ATH_MISSING if bytes are missing), unless you pass the prepared segment to ath_follow.
 *     ath_follow: call it before the first step. `before` is the segment that ath_joined_to names, prepared at the same
 * level; it is read at once. Returns ATH_OK, also if the preparation needs no end, or ATH_BAD_ARGUMENT: `before` is
 * another segment or level, and nothing has changed.
 *     ath_joined_to: returns the segment that one is joined to at a level; -1: none. */
ATH_API int ath_follow(ath_work *work, const ath_segment *before);
/* Call ath_prepare_to before the first step to have the segment's positions written to `positions`: frame by frame, 3
 * floats (doubles if info.is_float64 is 1) per vertex, as ath_positions would copy them. Leave them in place while you
 * use the segment. Their part of the segment's own memory stays unused. Returns ATH_BAD_ARGUMENT, and changes nothing,
 * if ath_positions would not just copy: vertices share a place, the source mixes the vertices of several branches,
 * frames repeat, the level has nodes, or motion is predicted and the file's order differs from the source's.
 *     ath_segment_size_to: returns the bytes that ath_prepare_start needs as `memory` if ath_prepare_to follows: without
 * that part, or ath_segment_size where the positions cannot be written elsewhere or the segment is joined. */
ATH_API int ath_prepare_to(ath_work *work, void *positions);
ATH_API size_t ath_segment_size_to(const ath_file *file, int32_t segment, int32_t level);
ATH_API int32_t ath_joined_to(const ath_file *file, int32_t segment, int32_t level);
/* Returns level_count x segment_count numbers of frames over which segments are joined; 0: not joined. ATH_JOIN_SLOPED
 * is added if velocities are joined, too. */
enum { ATH_JOIN_SLOPED = 128 };
ATH_API const uint8_t *ath_joins(const ath_file *file);
/* Returns the stage of each of the full_level_count levels: a stage of FORMAT.md. */
ATH_API const uint8_t *ath_stages(const ath_file *file);

/* Returns frame_count flags: 1 if the frame shows the positions of the frame before. Such frames take no bytes. */
ATH_API const uint8_t *ath_repeats(const ath_file *file);
/* Fills the fault behind an error of ath_prepare_step, or of ath_prepare_start once the memory sufficed. After
 * ATH_MISSING it names the chunk whose bytes are missing. */
ATH_API void ath_work_fault(const ath_work *work, ath_fault_info *fault);
/* Returns the largest number of steps that a preparation takes. */
ATH_API int32_t ath_prepare_steps(const ath_file *file, int32_t segment, int32_t level);
/* Prepares a segment in one call: ath_prepare_start, then all steps. */
ATH_API int ath_prepare(void *work, size_t work_bytes, const ath_file *file, int32_t segment, int32_t level,
                        void *memory, size_t memory_bytes);

/* A segment that is prepared at a level of all vertices (from info.depth_levels - 1 on) can be prepared at a deeper
 * level from there. Chunks of levels up to its own are not read again, and may have been dropped. For that, the
 * preparation of the first level keeps its integers in memory of yours:
 *     ath_keep: call it before the first step of that preparation. ath_keep_size bytes always suffice, and a hundredth
 * of them mostly do. If there is no room, nothing is kept. ATH_NO_MEMORY: not even the head fits.
 *     ath_kept_size: call it after the last step. Returns the bytes in use; 0: nothing is kept. The bytes hold no
 * pointers, so that you may copy them to smaller memory.
 *     ath_prepare_onward: call it instead of ath_prepare_start, for the segment that `from` is. Leave `from` and `kept`
 * unchanged until the last step, which comes after at most ath_prepare_steps. If a call fails, `from` can still be
 * played. ATH_BAD_ARGUMENT: ath_goes_on returns 0, since `level` is no deeper than that of `from`, or `kept` belongs to
 * another segment or level.
 *     ath_onward_ranges: returns the ranges that only levels beyond `from_level` need, for these segments alone. Use
 * ath_ranges or ath_follow for the segment that the first is joined to. ath_keep_size is 0 if nothing has to be kept:
 * if no level goes on from this one, and at the last lossy level, from whose positions the lossless level goes on. Pass
 * null as `kept` then. */
ATH_API size_t ath_keep_size(const ath_file *file, int32_t level);
ATH_API int ath_keep(ath_work *work, void *memory, size_t memory_bytes);
ATH_API size_t ath_kept_size(const void *kept);
ATH_API int ath_goes_on(const ath_file *file, const ath_segment *from, const void *kept, int32_t level);
ATH_API int ath_prepare_onward(void *work, size_t work_bytes, const ath_file *file, const ath_segment *from,
                               const void *kept, int32_t level, void *memory, size_t memory_bytes);
ATH_API int32_t ath_onward_ranges(const ath_file *file, int32_t from_level, int32_t level, int32_t first_segment,
                                  int32_t last_segment, int all, ath_range *ranges, int32_t capacity);

/* Return the segment and the level that are prepared; -1 if the preparation is not done, or has failed. */
ATH_API int32_t ath_segment_index(const ath_segment *segment);
ATH_API int32_t ath_segment_level(const ath_segment *segment);

/* ---- playing ----------------------------------------------------------------------------------------------------- */

/* ATH_AS_MARKED is ATH_LOOP for clips that are loops, else ATH_CLAMP. */
typedef enum ath_wrap { ATH_CLAMP = 0, ATH_LOOP = 1, ATH_PING_PONG = 2, ATH_AS_MARKED = 3 } ath_wrap;

/* Returns the place on the file's frames of a time in seconds since the clip's first frame. With ATH_LOOP, the last
 * frame blends into the first over the mean frame time, so that the place goes on up to one frame beyond the last. */
ATH_API double ath_frame_at(const ath_file *file, int32_t clip, double seconds, ath_wrap wrap);

/* The two frames that a place on the frames lies between, and the weight of the second. If that is 0, both are the
 * same. After the last frame of a clip comes its first. */
typedef struct ath_blend {
    int32_t frame[2], segment[2];
    double weight;
} ath_blend;

ATH_API ath_blend ath_blend_at(const ath_file *file, double frame);

/* The functions below show a place on the frames from prepared segments. Pass any number of segments; null and
 * unprepared ones are ignored. Between two frames, the result is their blend. If the frames are in two segments of
 * which one is missing, or which are at different levels, the nearer frame that is prepared is shown. They return
 * ATH_OK, ATH_HELD for a frame without its blend, or ATH_NOT_PREPARED: nothing was written. Playing backwards or at
 * random costs the same as forwards. */

/* Write all vertices, `stride` bytes apart. Vertices of nodes are moved by their matrices. */
ATH_API int ath_positions(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                          ath_order order, float *xyz, size_t stride);
ATH_API int ath_positions_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                  double frame, ath_order order, double *xyz, size_t stride);

/* For skinning on the GPU, write one matrix of 12 numbers per node of the cut, `stride` bytes apart, which takes rest
 * positions (ath_level_rest) to positions, and the exact vertices, which no matrix moves. A renderer needs both: level
 * 0 has only matrices, the last level of the hierarchy and all beyond have only exact vertices. */
ATH_API int ath_matrices(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                         float *matrices, size_t stride);
ATH_API int ath_matrices_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                 double frame, double *matrices, size_t stride);
ATH_API int ath_exact(const ath_file *file, const ath_segment *const *segments, int32_t segment_count, double frame,
                      float *xyz, size_t stride);
ATH_API int ath_exact_float64(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                              double frame, double *xyz, size_t stride);
/* Returns the level that the functions above show, whose cut has the matrices; -1: no segment has the frame. */
ATH_API int32_t ath_shown_level(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                double frame);

/* ---- from level to level ----------------------------------------------------------------------------------------- */

/* If a plant changed its level at once, it would jump by the distance between the two levels. A fade blends levels over
 * a moment, such as 0.2 seconds, with weights that change smoothly, even if a change overtakes the one before.
 * Initialise it with zeros: ath_fade fade = {0}. */
enum { ATH_FADE_LEVELS = 4 };
typedef struct ath_fade {
    int32_t count;                  /* levels that are shown; 0: none yet; 1: nothing fades */
    int32_t level[ATH_FADE_LEVELS]; /* the newest level is last; a level may be there twice */
    double weight[ATH_FADE_LEVELS]; /* their sum is 1 */
    double passed[ATH_FADE_LEVELS]; /* progress of the change to each level except the first, 0 to 1 */
} ath_fade;

/* Call ath_fade_to once per drawn frame, with the level to show, which must be prepared, and with the time since the
 * last call as a share of a fade's duration: seconds / 0.2. The first level, and any level at a share of 1 or more,
 * shows at once. If ATH_FADE_LEVELS levels are shown already, a further one waits. */
ATH_API void ath_fade_to(ath_fade *fade, int32_t level, double share);
/* Returns the deepest level of a fade; -1: it has none. The matrices and exact vertices below belong to its cut. */
ATH_API int32_t ath_fade_cut(const ath_fade *fade);

/* These do what ath_positions, ath_matrices and ath_exact do, but blend all levels of a fade. Pass the segments of each
 * level: keep those that fade out prepared as long as the fade names their level. Matrices belong to the nodes of
 * ath_fade_cut's level, and so do the exact vertices: bind vertices by the ath_cut of that level. If that level is
 * above 0, both apply to the ath_level_rest of level 1, even the share of level 0. Show level 0 on that pose, too, to
 * avoid a jump. ATH_NOT_PREPARED: a level with a weight lacks the frame, or no segment is at the deepest level; nothing
 * was written. With one level, the results are bit for bit those of the functions above. */
ATH_API int ath_faded_positions(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                                double frame, const ath_fade *fade, ath_order order, float *xyz, size_t stride);
ATH_API int ath_faded_matrices(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                               double frame, const ath_fade *fade, float *matrices, size_t stride);
ATH_API int ath_faded_exact(const ath_file *file, const ath_segment *const *segments, int32_t segment_count,
                            double frame, const ath_fade *fade, float *xyz, size_t stride);

/* ---- several clips at once --------------------------------------------------------------------------------------- */

/* Up to four clips of a file can be blended, each at its own frame and level: from calm to storm, or between headings
 * of the wind. The blend runs along the hierarchy. Edges of stems are blended by direction and length, sheets by
 * rotation and by shape, roots by position. So branches stay attached, and an edge has the clips' weighted mean
 * length. */
enum { ATH_BLEND_CLIPS = 4 };
typedef struct ath_share {
    const ath_segment *const *segments; /* see ath_positions */
    int32_t segment_count;
    double frame, weight;
} ath_share;

/* Weights need not add up to 1. A share with a weight of 0 or less is ignored and needs no segments. If one share is
 * left, the results are bit for bit those of ath_positions. memory: scratch of ath_blend_size bytes. Returns ATH_OK or
 * ATH_HELD; if nothing was written, ATH_NOT_PREPARED, ATH_NO_MEMORY, or ATH_BAD_ARGUMENT: no share has a weight, a
 * weight is infinite, or there are more than ATH_BLEND_CLIPS shares. */
ATH_API size_t ath_blend_size(const ath_file *file);
ATH_API int ath_blended_positions(const ath_file *file, const ath_share *shares, int32_t share_count, ath_order order,
                                  float *xyz, size_t stride, void *memory, size_t memory_bytes);

/* The wind of a clip, as its metadata name it; the heading is in degrees. A strength that is not finite: none. */
typedef struct ath_wind {
    double strength, heading;
} ath_wind;

/* Fills the weights of clips for a wind. At most four are above 0, and their sum is 1. They change continuously with
 * the wind: bilinearly between the two clip strengths around `strength` and, at each, between the two headings around
 * `heading`. Beyond the calmest and the wildest clip, the weights are those at that clip's strength. Of clips with
 * equal winds the first counts. If no clip has a wind, clip 0 has the weight 1. */
ATH_API void ath_wind_weights(const ath_wind *clips, int32_t clip_count, double strength, double heading,
                              double *weights);

/* ---- level of detail --------------------------------------------------------------------------------------------- */

/* Returns the coarsest stored level whose error in these segments is at most `pixels`, seen from `distance` (scene
 * units) under a vertical field of view of `fov` (radians) on a screen of `height` pixels; the deepest level if none
 * is. The choice is that of Song, Yang and Peng (2011). To keep a level from flickering at its boundary, go finer when
 * the level for `pixels` is deeper than the one shown, and coarser only when the level for a smaller `pixels` is
 * shallower, as examples/play.c does. */
ATH_API int32_t ath_level_for(const ath_file *file, int32_t first_segment, int32_t last_segment, ath_measure measure,
                              double distance, double fov, double height, double pixels);

/* Returns the CRC-32C (Castagnoli) of `size` bytes, continuing from `crc` (0 to start). */
ATH_API uint32_t ath_crc32c(uint32_t crc, const uint8_t *bytes, size_t size);

#ifdef __cplusplus
}
#endif
#endif
