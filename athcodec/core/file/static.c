/* Static data: the named arrays of the source and its metadata. The heads are read here; zstd libraries unpack the rest. */
#include "file/file.h"

/* Limits of FORMAT.md, in bytes: a name, an element that is a text, an array, the metadata, and a frame's window. */
enum { NAME_MOST = 4096, TEXT_MOST = 1 << 20, ARRAY_MOST = 1 << 28, METADATA_MOST = 1 << 20, WINDOW_MOST = 8 << 20 };
enum { ARRAY_HEAD = 8, FRAME_HEAD = 18, BLOCK_HEAD = 3 };

/* Returns `count` bytes, at most 8, as a little-endian number. */
static uint64_t number_at(const uint8_t *bytes, size_t count)
{
    uint64_t value = 0;
    for (size_t i = 0; i < count; i++) value |= (uint64_t)bytes[i] << 8 * i;
    return value;
}

/* ---- zstd frames (RFC 8878) ---- */

/* Walks over the blocks behind a frame's header. Libraries would unpack further frames behind the first, too. */
static int check_blocks(ath_bytes left, size_t checksum_bytes)
{
    for (int is_last = 0; !is_last;) {
        if (left.size < BLOCK_HEAD) return ATH_BAD_CHUNK;
        uint64_t head = number_at(left.bytes, BLOCK_HEAD), type = head >> 1 & 3, size = type == 1 ? 1 : head >> 3;
        left.bytes += BLOCK_HEAD;
        left.size -= BLOCK_HEAD;
        if (type == 3 || size > left.size) return ATH_BAD_CHUNK;
        left.bytes += size;
        left.size -= (size_t)size;
        is_last = head & 1;
    }
    return left.size == checksum_bytes ? ATH_OK : ATH_BAD_CHUNK;
}

/* Checks that `bytes` are one frame that needs no dictionary, no window above WINDOW_MOST and `expected`, and states a
 * size of its content of at most `most`, which it gets. */
static int check_frame(ath_bytes bytes, uint64_t expected, uint64_t most, uint64_t *content)
{
    static const uint8_t magic[] = {0x28, 0xb5, 0x2f, 0xfd}, name_sizes[] = {0, 1, 2, 4};
    uint8_t head[FRAME_HEAD] = {0};
    memcpy(head, bytes.bytes, bytes.size < sizeof head ? bytes.size : sizeof head);
    size_t flags = head[4], single = flags >> 5 & 1, name = 6 - single, at = name + name_sizes[flags & 3];
    size_t size = flags >> 6 ? (size_t)1 << (flags >> 6) : single;
    for (size_t i = 0; i < sizeof magic; i++)
        if (head[i] != magic[i]) return ATH_BAD_CHUNK;
    uint64_t window = single ? 0 : (uint64_t)(8 + (head[5] & 7)) << (7 + (head[5] >> 3));
    if (window > WINDOW_MOST && window > expected) return ATH_LIMIT_EXCEEDED;
    if (flags & 8 || size == 0 || at + size > bytes.size) return ATH_BAD_CHUNK;
    *content = number_at(head + at, size) + (size == 2 ? 256 : 0);
    if (*content > most) return ATH_LIMIT_EXCEEDED;
    if (*content == 0 || number_at(head + name, at - name) != 0) return ATH_BAD_CHUNK;
    ath_bytes blocks = {bytes.bytes + at + size, bytes.size - at - size};
    return check_blocks(blocks, flags & 4 ? 4 : 0);
}

/* ---- chunks ---- */

/* Checks the checksum of a chunk and gets its bytes. From then on, the fault is that its content is not valid. */
static int load_chunk(const ath_file *file, int32_t index, ath_bytes *content, ath_fault_info *fault)
{
    const ath_chunk *chunk = file->chunks + index;
    int result = ath_check_chunk(file, index, fault);
    if (result != ATH_OK) return result;
    content->bytes = chunk->bytes;
    content->size = chunk->length;
    ath_refuse(fault, ATH_BAD_CHUNK, ATH_FIELD_CONTENT, 0, 0, 0);
    ath_fault_at(fault, chunk, index);
    return ATH_OK;
}

/* ---- arrays ---- */

static int is_size_of_kind(uint32_t kind, uint32_t size)
{
    int is_number = size == 1 || size == 2 || size == 4 || size == 8;
    if (kind == ATH_TEXTS) return size >= 1 && size <= TEXT_MOST;
    if (kind == ATH_BOOLEANS) return size == 1;
    return kind < ATH_TEXTS && is_number && !(kind == ATH_FLOATS && size == 1);
}

/* Reads the shape, and gets the bytes of all elements: 0 if a size is 0. */
static int parse_shape(const uint8_t *sizes, ath_array *array)
{
    uint64_t most = array->item_bytes; /* sizes of 0 count as 1 */
    int is_empty = 0;
    if (array->dimension_count > ATH_DIMENSIONS) return ATH_BAD_CHUNK;
    for (uint32_t d = 0; d < array->dimension_count; d++) {
        array->shape[d] = (uint32_t)number_at(sizes + 4 * (size_t)d, 4);
        if (array->shape[d] == 0) is_empty = 1;
        if (array->shape[d] > 0) most *= array->shape[d];
        if (most > ARRAY_MOST) return ATH_LIMIT_EXCEEDED;
    }
    array->bytes = is_empty ? 0 : most;
    return most > ARRAY_MOST ? ATH_LIMIT_EXCEEDED : ATH_OK;
}

static int parse_array(ath_bytes chunk, ath_array *array)
{
    if (chunk.size < ARRAY_HEAD) return ATH_BAD_CHUNK;
    array->kind = chunk.bytes[0];
    array->dimension_count = chunk.bytes[1];
    array->name_bytes = (uint32_t)number_at(chunk.bytes + 2, 2);
    array->item_bytes = (uint32_t)number_at(chunk.bytes + 4, 4);
    size_t start = ARRAY_HEAD + 4 * (size_t)array->dimension_count, end = start + array->name_bytes;
    if (end > chunk.size || !is_size_of_kind(array->kind, array->item_bytes)) return ATH_BAD_CHUNK;
    ath_bytes name = {chunk.bytes + start, array->name_bytes}, frame = {chunk.bytes + end, chunk.size - end};
    if (name.size > NAME_MOST) return ATH_LIMIT_EXCEEDED;
    if (name.size == 0 || !ath_is_text(name, 1)) return ATH_BAD_CHUNK;
    int result = parse_shape(chunk.bytes + ARRAY_HEAD, array);
    if (result != ATH_OK) return result;
    array->name = (const char *)name.bytes;
    array->packed = frame.bytes;
    array->packed_bytes = frame.size;
    if (array->bytes == 0) return frame.size == 0 ? ATH_OK : ATH_BAD_CHUNK;
    uint64_t content = 0;
    result = check_frame(frame, array->bytes, UINT64_MAX, &content);
    return result == ATH_OK && content != array->bytes ? ATH_BAD_CHUNK : result;
}

int ath_array_of(const ath_file *file, int32_t chunk, ath_array *array, ath_fault_info *fault)
{
    ath_fault_info unwanted;
    ath_bytes bytes;
    memset(array, 0, sizeof *array);
    if (!fault) fault = &unwanted;
    if (chunk < 0 || chunk >= file->info.chunk_count || file->chunks[chunk].kind != ATH_ATTRIBUTE)
        return ath_refuse(fault, ATH_BAD_ARGUMENT, ATH_FIELD_NONE, 0, 0, 0);
    int result = load_chunk(file, chunk, &bytes, fault);
    return result == ATH_OK ? fault->code = parse_array(bytes, array) : result;
}

int32_t ath_array_named(const ath_file *file, const char *name)
{
    for (int32_t i = 0; i < file->info.chunk_count; i++) {
        ath_array array;
        uint32_t same = 0;
        if (file->chunks[i].kind != ATH_ATTRIBUTE || ath_array_of(file, i, &array, 0) != ATH_OK) continue;
        while (same < array.name_bytes && name[same] && array.name[same] == name[same]) same++;
        if (same == array.name_bytes && !name[same]) return i;
    }
    return -1;
}

void ath_array_elements(const ath_array *array, const void *unpacked, void *elements)
{
    const uint8_t *planes = (const uint8_t *)unpacked;
    uint8_t *out = (uint8_t *)elements;
    size_t item = array->item_bytes, count = (size_t)array->bytes / item;
    for (size_t k = 0; k < item; k++)
        for (size_t i = 0; i < count; i++) out[i * item + k] = planes[k * count + i];
}

int32_t ath_array_ranges(const ath_file *file, ath_range *ranges, int32_t capacity)
{
    int32_t count = 0;
    uint64_t end = 0;
    for (int32_t i = 0; i < file->info.chunk_count; i++) {
        const ath_chunk *chunk = file->chunks + i;
        if (chunk->kind != ATH_ATTRIBUTE || chunk->bytes || chunk->length == 0) continue;
        int is_next = count > 0 && chunk->offset == end;
        ath_range range = {chunk->offset, chunk->length};
        end = chunk->offset + chunk->length;
        if (!is_next && count < capacity) ranges[count] = range;
        if (!is_next) count++;
        if (is_next && count <= capacity) ranges[count - 1].size += chunk->length;
    }
    return count;
}

/* ---- metadata ---- */

static int parse_metadata(ath_bytes chunk, ath_metadata *metadata)
{
    if (chunk.size < 1 || chunk.bytes[0] > 1) return ATH_BAD_CHUNK;
    ath_bytes body = {chunk.bytes + 1, chunk.size - 1};
    metadata->is_packed = chunk.bytes[0];
    metadata->stored = body.bytes;
    metadata->stored_bytes = metadata->bytes = body.size;
    if (metadata->is_packed) return check_frame(body, 0, METADATA_MOST, &metadata->bytes);
    return body.size > METADATA_MOST ? ATH_LIMIT_EXCEEDED : ATH_OK;
}

int ath_metadata_of(const ath_file *file, ath_metadata *metadata, ath_fault_info *fault)
{
    ath_fault_info unwanted;
    const ath_chunk *chunk = ath_find_chunk(file->chunks, file->header.chunk_count, ATH_METADATA, ATH_NO_LEVEL, 0);
    ath_bytes bytes;
    memset(metadata, 0, sizeof *metadata);
    if (!fault) fault = &unwanted;
    fault->code = ATH_OK;
    if (!chunk) return ATH_OK;
    int result = load_chunk(file, (int32_t)(chunk - file->chunks), &bytes, fault);
    return result == ATH_OK ? fault->code = parse_metadata(bytes, metadata) : result;
}
