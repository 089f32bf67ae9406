/* Notes why a file is refused, in numbers; file/fault_text.c makes sentences of them. */
#include "container/refuse.h"

int ath_refuse(ath_fault_info *fault, int code, ath_field field, double found, double least, double most)
{
    memset(fault, 0, sizeof *fault);
    fault->code = code;
    fault->field = (int32_t)field;
    fault->chunk = -1;
    fault->level = ATH_NO_LEVEL;
    fault->found = found;
    fault->least = least;
    fault->most = most;
    return code;
}

int ath_fault_at(ath_fault_info *fault, const ath_chunk *chunk, int32_t index)
{
    fault->chunk = index;
    fault->kind = chunk->kind;
    fault->level = chunk->level;
    fault->segment = chunk->segment;
    fault->offset = chunk->offset;
    return fault->code;
}

int ath_refuse_entry(ath_fault_info *fault, ath_field field, int32_t level, uint32_t segment, double found)
{
    ath_refuse(fault, ATH_BAD_CHUNK_TABLE, field, found, 0, 0);
    fault->level = (uint8_t)level;
    fault->segment = segment;
    return ATH_BAD_CHUNK_TABLE;
}
