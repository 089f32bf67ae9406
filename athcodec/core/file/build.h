/* The waves that all segments share, once they are built. */
#ifndef ATH_FILE_BUILD_H
#define ATH_FILE_BUILD_H

#include "file/file.h"

/* Return the waves of a segment's stems, and those of the maps of its nodes. */
const double *ath_file_waves(const ath_file *file, int32_t segment);
const double *ath_file_node_waves(const ath_file *file, int32_t segment);

#endif
