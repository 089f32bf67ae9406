/* Keeps a prepared segment for a layer that refines it, as bytes without pointers, so that their owner may move them.
 * First a head, then the streams of all stages so far (later streams may begin with their bases), then, piece by piece,
 * the integers of the layer's rows, most of which are small. */
#ifndef ATH_PLAY_KEEP_H
#define ATH_PLAY_KEEP_H

#include "file/file.h"
#include "model/motion.h"

typedef struct {
    uint64_t bytes; /* 0: nothing is kept, or not all of it yet */
    int32_t segment, stage;
} kept_head;

typedef struct {
    uint8_t *at, *end; /* at null: nothing is kept, or there was no room for it */
} kept_writer;

/* Returns whether a stage holds all of the plant at a precision that a later one of the file refines. */
int ath_can_be_kept(const ath_file *file, int32_t stage);

void ath_keep_stream(kept_writer *to, const ath_stream *stream, int32_t frames);
/* shape_integers: ATH_SHAPE_NUMBERS of each of the piece's shapes. */
void ath_keep_piece(kept_writer *to, const ath_piece *piece, const ath_piece_rows *rows, const int32_t *shape_integers,
                    int32_t frames);

/* Each reads what stands at `at` and returns where the next begins. A stream without a learned basis is left without
 * its waves, else these go to `learned`. The rows and shapes of a piece are zero on entry. */
const uint8_t *ath_kept_stream(const uint8_t *at, ath_stream *stream, double *learned, int32_t frames);
const uint8_t *ath_kept_piece(const uint8_t *at, const ath_piece *piece, ath_piece_rows *rows, int32_t *shape_integers,
                              double *unit_shapes, int32_t frames);

#endif
