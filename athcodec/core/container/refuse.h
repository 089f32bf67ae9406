/* Faults: what was found where, and what was expected. */
#ifndef ATH_CONTAINER_REFUSE_H
#define ATH_CONTAINER_REFUSE_H

#include "bits/format.h"

/* Fill in a fault, and the chunk that it is about. Both return the fault's code. */
int ath_refuse(ath_fault_info *fault, int code, ath_field field, double found, double least, double most);
int ath_fault_at(ath_fault_info *fault, const ath_chunk *chunk, int32_t index);
/* Refuses an entry of the front for a level and a segment. Returns ATH_BAD_CHUNK_TABLE. */
int ath_refuse_entry(ath_fault_info *fault, ath_field field, int32_t level, uint32_t segment, double found);

#endif
