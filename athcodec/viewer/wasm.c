/* Functions that the C decoder needs in WebAssembly beside its own sources: the memory functions, which become one
 * instruction each, and checks that ath.h's structs are as ath_decoder.template.mjs reads them. */
#include "ath.h"
#include "ath_gpu.h"

void *memcpy(void *restrict to, const void *restrict from, size_t size) { return __builtin_memcpy(to, from, size); }

void *memset(void *to, int value, size_t size) { return __builtin_memset(to, value, size); }

_Static_assert(sizeof(size_t) == 4 && sizeof(void *) == 4, "pointers and sizes are read as 32 bits");
_Static_assert(offsetof(ath_info, is_predicted) == 116 && sizeof(ath_info) == 120, "INFO");
_Static_assert(offsetof(ath_clip, loop) == 32 && sizeof(ath_clip) == 40, "CLIP");
_Static_assert(offsetof(ath_chunk, level) == 30 && sizeof(ath_chunk) == 32, "CHUNK");
_Static_assert(offsetof(ath_branch, ring) == 40 && sizeof(ath_branch) == 44, "BRANCH");
_Static_assert(offsetof(ath_part, index) == 12 && sizeof(ath_part) == 16, "PART");
_Static_assert(offsetof(ath_polygons, is_derived) == 13 && sizeof(ath_polygons) == 16, "POLYGONS");
_Static_assert(offsetof(ath_array, packed_bytes) == 8 && offsetof(ath_array, name_bytes) == 24
                   && offsetof(ath_array, shape) == 40 && sizeof(ath_array) == 168,
               "PACKED_ARRAY");
_Static_assert(offsetof(ath_metadata, stored_bytes) == 8 && offsetof(ath_metadata, is_packed) == 24
                   && sizeof(ath_metadata) == 32,
               "PACKED_TEXT");
_Static_assert(offsetof(ath_range, size) == 8 && sizeof(ath_range) == 16, "RANGE_SIZE");
_Static_assert(sizeof(ath_gpu_room) == 28, "GPU_ROOM_SIZE");
_Static_assert(offsetof(ath_fade, level) == 4 && offsetof(ath_fade, weight) == 24 && offsetof(ath_fade, passed) == 56
                   && sizeof(ath_fade) == 88 && ATH_FADE_LEVELS == 4,
               "FADE");
_Static_assert(offsetof(ath_fault_info, chunk) == 8 && sizeof(ath_fault_info) == 56 && ATH_FAULT_TEXT == 256, "FAULT");
_Static_assert(ATH_MORE == 64 && ATH_HELD == 65 && ATH_MISSING == 66 && ATH_NOT_PREPARED == 67 && ATH_NO_MEMORY == 68
                   && ATH_BAD_ARGUMENT == 69,
               "result codes");
_Static_assert(ATH_FILE_ORDER == 0 && ATH_SOURCE_ORDER == 1, "ORDERS");
_Static_assert(ATH_LARGEST == 0 && ATH_P99 == 1 && ATH_RMS == 2, "MEASURES");
_Static_assert(ATH_CLAMP == 0 && ATH_LOOP == 1 && ATH_PING_PONG == 2 && ATH_AS_MARKED == 3, "WRAPS");
_Static_assert(ATH_LEVEL_NAME == 32, "LEVEL_NAME");
