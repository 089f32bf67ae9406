/* The bytes that segments need, and whether they are there. */
#include "file/file.h"

/* Returns the first chunk that ends behind `offset`. */
static uint32_t chunk_at(const ath_file *file, uint64_t offset)
{
    uint32_t low = 0, high = file->header.chunk_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (file->chunks[middle].offset + file->chunks[middle].length <= offset)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

void ath_feed(ath_file *file, const uint8_t *bytes, uint64_t offset, size_t size)
{
    uint64_t end = offset + size;
    for (uint32_t i = chunk_at(file, offset); i < file->header.chunk_count; i++) {
        ath_chunk *chunk = file->chunks + i;
        if (chunk->offset + chunk->length > end) break;
        if (chunk->offset >= offset && chunk->length > 0) chunk->bytes = bytes + (chunk->offset - offset);
    }
}

void ath_drop(ath_file *file, uint64_t offset, uint64_t size)
{
    for (uint32_t i = chunk_at(file, offset); i < file->header.chunk_count && file->chunks[i].offset < offset + size;
         i++)
        if (file->chunks[i].length > 0) file->chunks[i].bytes = 0;
}

/* The ranges found so far, and which chunks are wanted. */
typedef struct {
    const ath_file *file;
    int32_t level, all;
    uint64_t end; /* end of the last chunk in the list */
    ath_range *ranges;
    int32_t capacity, count;
} range_list;

/* Ignores a chunk that is null, empty, or fed and so not wanted. */
static void add_range(range_list *list, const ath_chunk *chunk, int all)
{
    if (!chunk || chunk->length == 0 || (chunk->bytes && !all)) return;
    int joined = list->count > 0 && chunk->offset == list->end;
    list->end = chunk->offset + chunk->length;
    if (!joined) list->count++;
    if (list->count > list->capacity) return;
    if (!joined) list->ranges[list->count - 1].offset = chunk->offset;
    list->ranges[list->count - 1].size = list->end - list->ranges[list->count - 1].offset;
}

/* Returns ath_file_needs but, unless `all` is 1, not for rest poses that have been read. */
static int is_used(const ath_file *file, int32_t kind, int32_t d, int32_t level, int all)
{
    if (!ath_file_needs(file, kind, d, level)) return 0;
    return all || kind != ATH_REFINED_REST || !file->layers[ath_layer_of(file, d)].rest_known;
}

/* Visits the chunks of these segments only, so that asking for segments one by one takes linear time. only_end: adds
 * only what a joined segment needs. */
static void add_segments(range_list *list, int32_t d, int32_t first, int32_t last, int only_end)
{
    const ath_file *file = list->file;
    uint32_t i = ath_first_chunk(file->chunks, file->header.chunk_count, ATH_STEMS, d, (uint32_t)first);
    for (; i < file->header.chunk_count; i++) {
        const ath_chunk *chunk = file->chunks + i;
        if (!ath_is_motion(chunk) || chunk->stage != d || (int32_t)chunk->segment > last) break;
        if (only_end && !ath_shapes_end(chunk->kind)) continue;
        if (is_used(file, chunk->kind, d, list->level, list->all)) add_range(list, chunk, list->all);
    }
}

/* Adds the chunks that all segments share, unless the visited segments include segment 0. */
static void add_shared(range_list *list, int32_t d)
{
    for (int32_t kind = ATH_SHAPES; kind <= ATH_REFINED_REST; kind++)
        if (ath_is_shared(kind) && is_used(list->file, kind, d, list->level, list->all))
            add_range(list, ath_file_chunk(list->file, kind, d, 0), list->all);
}

int32_t ath_onward_ranges(const ath_file *file, int32_t from_level, int32_t level, int32_t first_segment,
                          int32_t last_segment, int all, ath_range *ranges, int32_t capacity)
{
    range_list list = {file, ath_file_stage(file, level), all, 0, ranges, capacity, 0};
    for (int32_t d = ath_file_stage(file, from_level) + 1; d <= list.level; d++) {
        if (first_segment > 0) add_shared(&list, d);
        add_segments(&list, d, first_segment, last_segment, 0);
    }
    return list.count;
}

int32_t ath_ranges(const ath_file *file, int32_t level, int32_t first_segment, int32_t last_segment, int all,
                   ath_range *ranges, int32_t capacity)
{
    range_list list = {file, ath_file_stage(file, level), all, 0, ranges, capacity, 0};
    const ath_clip *last = ath_segment_clip(file, last_segment);
    int32_t of_loop = last->first_segment < first_segment ? -1 : ath_joined_to(file, last->first_segment, level);
    int32_t before = ath_joined_to(file, first_segment, level);
    if (before > first_segment) before = -1; /* the end of a loop, which comes last */
    for (int32_t d = 0; d <= list.level; d++) {
        if (before != 0 && first_segment > 0) add_shared(&list, d);
        if (before >= 0) add_segments(&list, d, before, before, 1);
        add_segments(&list, d, first_segment, last_segment, 0);
        if (of_loop > last_segment) add_segments(&list, d, of_loop, of_loop, 1);
    }
    return list.count;
}

static int has_chunks(const ath_file *file, int32_t segment, int32_t level, int only_end)
{
    level = ath_file_stage(file, level);
    for (int32_t kind = ATH_STEMS; kind <= ATH_PREDICTED; kind++)
        for (int32_t d = 0; d <= level; d++) {
            if (!is_used(file, kind, d, level, 0) || (only_end && !ath_shapes_end(kind))) continue;
            const ath_chunk *chunk = ath_file_chunk(file, kind, d, segment);
            if (chunk && !chunk->bytes) return 0;
        }
    return 1;
}

static int is_ready(const ath_file *file, int32_t segment, int32_t level)
{
    int32_t before = ath_joined_to(file, segment, level);
    return has_chunks(file, segment, level, 0) && (before < 0 || has_chunks(file, before, level, 1));
}

int32_t ath_ready_level(const ath_file *file, int32_t segment)
{
    for (int32_t level = file->info.level_count - 1; level >= 0; level--)
        if (is_ready(file, segment, level)) return level;
    return -1;
}
