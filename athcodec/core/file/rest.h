/* The rest poses of an opened file. */
#ifndef ATH_FILE_REST_H
#define ATH_FILE_REST_H

#include "file/file.h"

/* Returns where in the scratch memory, behind the models, the rotations of branches stand. */
size_t ath_turns_place(void);
/* Reads REST: the reference pose, or which mesh of the host's it is. */
int ath_read_reference(ath_file *file, ath_fault_info *fault);
/* Completes what follows from the reference pose. */
void ath_know_rest(ath_file *file);

#endif
