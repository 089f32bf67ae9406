/* The bytes of an .ath file (FORMAT.md, "File"). Only this parser and container.py know offsets. */
#ifndef ATH_CONTAINER_CONTAINER_H
#define ATH_CONTAINER_CONTAINER_H

#include "container/header.h"
#include "container/refuse.h"

/* Reads the header. On ATH_MISSING, *needed is how many bytes of the front are wanted, on ATH_OK the front's length. */
int ath_read_header(const uint8_t *bytes, size_t available, const ath_limits *limits, ath_header *header,
                    uint64_t *needed, ath_fault_info *fault);
/* Reads the rest of a front whose header is valid. Fills the header's file_length and, unless null, chunk_count chunks
 * and what ath_errors, ath_joins and ath_repeats return. *needed is the length of the prelude. */
int ath_read_tables(const uint8_t *bytes, size_t available, const ath_limits *limits, ath_header *header,
                    uint64_t *needed, ath_chunk *chunks, double *errors, uint8_t *joins, uint8_t *repeats,
                    ath_fault_info *fault);

/* Returns the index of the first chunk that does not come before this one in file order. */
uint32_t ath_first_chunk(const ath_chunk *chunks, uint32_t chunk_count, int32_t kind, int32_t stage, uint32_t segment);
/* Returns the chunk of this kind, or null. For the prelude, pass stage ATH_NO_LEVEL and segment 0. */
const ath_chunk *ath_find_chunk(const ath_chunk *chunks, uint32_t chunk_count, int32_t kind, int32_t stage,
                                uint32_t segment);

/* ---- heads of chunks: ATH_OK or ATH_BAD_CHUNK; `body` is what follows the head ---- */

typedef struct {
    const uint8_t *bytes;
    size_t size;
} ath_bytes;

typedef struct {
    double origin[3], step;
    int32_t exact, is_float64, is_host, connected;
    uint32_t host_checksum[2]; /* checksums of the host's mesh, if that is the rest pose */
} ath_rest_head;

typedef struct {
    double step;
    int32_t exact;
} ath_source_rest_head;

typedef struct {
    uint32_t frames, segments;
    int32_t loop, periodic;
    ath_bytes name;       /* UTF-8 */
    const uint8_t *seams; /* loops only: full_level_count floats, see ath_seam */
} ath_clip_entry;

/* first + i * step; i / rate, with a whole rate; one by one */
typedef enum { ATH_TIME_STEP, ATH_TIME_RATE, ATH_TIME_STREAM } ath_time_method;

/* Time basis of STEMS: the waves of stems, or learned rows, as integers of waves or as samples. */
enum { ATH_WAVES, ATH_BASIS_IN_WAVES, ATH_BASIS_AS_SAMPLES };
enum { ATH_MOST_SAMPLE = 8192 }; /* the sample that stands for 1 */

typedef struct {
    double step, rotation_step_factor;
    int32_t basis_kind;
    int32_t rank;  /* rows of a learned basis */
    int32_t base;  /* level of the stream whose basis this one begins with; -1: none */
    int32_t ratio; /* refinements: the step of the layer before over this one's */
    int32_t turn;  /* the largest rotation step of rigid pieces is 2 to the power of -turn / 2; 0: no limit */
    ath_bytes basis;
} ath_stems_head;

int ath_parse_rest(ath_bytes chunk, ath_rest_head *head, ath_bytes *body);
/* Largest sum of faces and corners of FACES or EDGES. */
enum { MOST_CORNERS = 1 << 26 };
/* Returns the bits of the largest number that an integer type holds. */
ATH_INLINE int32_t ath_bits_of_type(int32_t type) { return (8 << (type & 3)) - (type >> 2 & 1); }

/* Returns how many vertices, of `vertex_count`, the numbers of an integer type can name. */
int32_t ath_vertices_of_type(int32_t type, int32_t vertex_count);
/* Returns whether bytes are UTF-8 (RFC 3629), of which control characters are taken if `may_control` is 1. */
int ath_is_text(ath_bytes text, int may_control);
int ath_parse_polygons(ath_bytes chunk, ath_polygons *shape, ath_bytes *body);
int ath_parse_source_rest(ath_bytes chunk, ath_source_rest_head *head, ath_bytes *body);
/* Parses the entry at the front of `chunk`, and moves `chunk` past it. */
int ath_parse_clip(ath_bytes *chunk, const ath_header *header, ath_clip_entry *entry);
float ath_seam(const ath_clip_entry *entry, int32_t level);
int ath_parse_time(ath_bytes chunk, int32_t clip_count, ath_time_method *method, ath_bytes *body);
int ath_parse_steady(ath_bytes body, ath_time_method method, int32_t clip, double *first, double *step);
int ath_parse_stems(ath_bytes chunk, int32_t frames, ath_stems_head *head, ath_bytes *body);
/* Heads of refinements. shift: predictions are the integers of the layer before times 2 ^ shift. */
int ath_parse_refined_stems(ath_bytes chunk, int32_t frames, ath_stems_head *head, ath_bytes *body);
int ath_parse_refined_shapes(ath_bytes chunk, int32_t *shift, ath_bytes *body);
/* REFINED_REST, PREDICTED, CORRECTIONS: a step and a stream. */
int ath_parse_stepped(ath_bytes chunk, double *step, ath_bytes *body);

int ath_is_finite(double value);

#endif
