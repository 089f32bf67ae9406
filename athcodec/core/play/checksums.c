/* The first phase: checksums of the chunks that a preparation needs, in slices. */
#include "play/checksums.h"

enum { CHECKSUM_STEP = 1 << 16 };

int32_t ath_checksum_steps(const ath_chunk *chunk)
{
    return chunk && chunk->length > 0 ? (int32_t)((chunk->length - 1) / CHECKSUM_STEP) + 1 : 1;
}

/* Skips REFINED_REST, which has been read. */
int32_t ath_kind_after(int32_t kind) { return kind == ATH_EXACT ? ATH_PREDICTED : kind + 1; }

const ath_chunk *ath_chunk_to_check(const ath_work *work) { return ath_chunk_of(work, work->next_kind, work->next); }

/* Moves on to the next chunk of the stage, or to the next stage. */
static void next_to_check(ath_work *work)
{
    work->crc = work->crc_at = 0;
    work->next_kind = ath_kind_after(work->next_kind);
    if (work->next_kind <= ATH_PREDICTED) return;
    work->next_kind = ATH_STEMS;
    if (work->next++ == work->stage) ath_next_phase(work, HEADS);
}

uint32_t ath_size_to_check(const ath_work *work, const ath_chunk *chunk)
{
    uint32_t left = chunk->length - work->crc_at;
    return left < (uint32_t)CHECKSUM_STEP ? left : (uint32_t)CHECKSUM_STEP;
}

int ath_check_some(ath_work *work)
{
    const ath_chunk *chunk = ath_chunk_to_check(work);
    if (chunk && work->crc_at < chunk->length) {
        uint32_t size = ath_size_to_check(work, chunk);
        work->crc = ath_crc32c(work->crc, chunk->bytes + work->crc_at, size);
        work->crc_at += size;
    }
    if (chunk && work->crc_at < chunk->length) return ATH_OK;
    if (chunk && work->crc != chunk->checksum)
        return ath_refuse_chunk(work, ATH_BAD_CHECKSUM, ATH_FIELD_CHUNK_CHECKSUM, chunk, work->crc, chunk->checksum);
    next_to_check(work);
    return ATH_OK;
}
