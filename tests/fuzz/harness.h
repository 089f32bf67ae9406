/* What the fuzz targets share: memory of exactly the size asked for, checksums made to fit, and
 * segments prepared under watch. What counts as a fault is said by REQUIRE; the sanitizers say the rest.
 *
 * An input is an .ath file and, behind it, OPTIONS bytes that say how it is used. */
#ifndef FUZZ_HARNESS_H
#define FUZZ_HARNESS_H

#include "file/file.h"
#include "play/segment.h"

#include <stdio.h>
#include <stdlib.h>

enum { OPTIONS = 16, HEADER = 24, CHUNK_COUNT_AT = 20, FUZZ_MESH_VERTICES = 1 << 14 };

#define REQUIRE(condition, what)                                                                                       \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: broken promise: %s\n", __FILE__, __LINE__, what);                                  \
            abort();                                                                                                   \
        }                                                                                                              \
    } while (0)

/* Aligned to 16, filled with `fill`, so that what is read before it is written shows up; exactly `size` bytes, so that
 * the sanitizer sees what is beyond. Freed by free. */
void *fuzz_memory(size_t size, int fill);

/* A copy of the same kind. */
uint8_t *fuzz_copy(const uint8_t *bytes, size_t size);

uint32_t fuzz_u32(const uint8_t *at);
void fuzz_put_u32(uint8_t *at, uint32_t value);

/* Where the first chunk begins; 0: the front does not fit. */
size_t fuzz_chunks_at(const uint8_t *file, size_t size);

/* Magic, version, length of the front and checksums that fit whatever the rest says; that of the host's mesh, too. */
void fuzz_repair(uint8_t *file, size_t size);

/* The chunks of a file whose front is valid but for what fuzz_repair changes, *count of them, to be freed, and the
 * number of vertices; null: none. */
ath_chunk *fuzz_chunks(uint8_t *file, size_t size, uint32_t *count, uint32_t *vertices);

/* The mesh that a host has, of up to FUZZ_MESH_VERTICES, three floats each, to be freed. */
float *fuzz_host_mesh(size_t vertices);

/* Limits small enough for a fuzzer, and for the memory of all its objects to be bounded by. */
ath_limits fuzz_limits(uint64_t memory_bytes);

/* A file and the memory it lives in. */
typedef struct {
    ath_file *file;
    void *bases;
    void *layers[ATH_LAYERS]; /* of ath_refine, as many as it asked for */
    int32_t layer_count;
    size_t memory; /* bytes of file and bases */
} fuzz_file;

/* Opens, gives the host's mesh where one is asked for, and builds; 0 and nothing to close where the file is refused. `available` may be less than the file. */
int fuzz_open(fuzz_file *opened, const uint8_t *bytes, size_t available, const ath_limits *limits, int fill);
void fuzz_close(fuzz_file *opened);

/* Builds what the layers up to a level's share; 0 where their chunks are missing or refused, or it is more than
 * `most`. */
int fuzz_refine(fuzz_file *opened, int32_t level, uint64_t most, int fill);

/* One segment at one level, prepared `steps` steps at a time; null where it is refused or larger than `most`. */
ath_segment *fuzz_prepare(fuzz_file *opened, int32_t segment, int32_t level, int32_t steps, uint64_t most, int fill);

/* Goes on from a segment at `level`, where that can be prepared, to `deeper`: that has to come out as when it is
 * prepared alone. */
void fuzz_go_on(fuzz_file *opened, int32_t segment, int32_t level, int32_t deeper, uint64_t most, int fill);

/* Prepares a segment with its positions in memory of the caller's, where they can go there: they have to be those of the
 * segment prepared alone. */
void fuzz_prepare_to(fuzz_file *opened, int32_t segment, int32_t level, uint64_t most, int fill);

/* Whether both show the same bits. */
int fuzz_same(const ath_file *file, const ath_segment *a, const ath_segment *b);

#endif
