/* Checksums of the chunks that a preparation needs. */
#ifndef ATH_PLAY_CHECKSUMS_H
#define ATH_PLAY_CHECKSUMS_H

#include "play/work.h"

int32_t ath_checksum_steps(const ath_chunk *chunk);
/* Returns the kind of chunk whose checksum comes next at a stage. */
int32_t ath_kind_after(int32_t kind);
/* Return the chunk that the next step looks at, or null, and how many of its bytes. */
const ath_chunk *ath_chunk_to_check(const ath_work *work);
uint32_t ath_size_to_check(const ath_work *work, const ath_chunk *chunk);
int ath_check_some(ath_work *work);

#endif
