/* Header, chunk table, error table, heads of chunks: read with every check that FORMAT.md asks for, in its order. */
#include "container.h"

enum {
    HEADER_SIZE = 64,
    CHUNK_SIZE = 16,
    ERRORS_SIZE = 8,
    CHECKSUM_AT = 12,
    OPTIONAL = 0x8000,
    MAJOR = 0,
    MINOR = 4
};

static uint32_t u16_at(const uint8_t *at) { return (uint32_t)at[0] | (uint32_t)at[1] << 8; }

static uint32_t u32_at(const uint8_t *at) { return u16_at(at) | u16_at(at + 2) << 16; }

static uint64_t u64_at(const uint8_t *at) { return u32_at(at) | (uint64_t)u32_at(at + 4) << 32; }

static float f32_at(const uint8_t *at)
{
    uint32_t bits = u32_at(at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static double f64_at(const uint8_t *at)
{
    uint64_t bits = u64_at(at);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

int ath_is_finite(double value) { return value - value == 0.0; }

static int is_step(double value) { return ath_is_finite(value) && value > 0.0; }

void ath_default_limits(ath_limits *limits)
{
    static const ath_limits defaults = {1u << 20, 16u << 20, 1u << 26, 1u << 20, 1u << 20, 4096, 256u << 20, 0,
                                        (uint64_t)2 << 30};
    *limits = defaults;
}

/* ---- header ---- */

static int check_magic(const uint8_t *bytes, size_t available)
{
    static const uint8_t magic[8] = {0x89, 'A', 'T', 'H', '\r', '\n', 0x1a, '\n'};
    for (size_t i = 0; i < 8 && i < available; i++)
        if (bytes[i] != magic[i]) return ATH_NOT_AN_ATH_FILE;
    if (available >= CHECKSUM_AT && (u16_at(bytes + 8) != MAJOR || u16_at(bytes + 10) != MINOR))
        return ATH_UNSUPPORTED_VERSION;
    return ATH_OK;
}

static void parse_header(const uint8_t *bytes, ath_header *header)
{
    header->checksum = u32_at(bytes + CHECKSUM_AT);
    header->file_length = u64_at(bytes + 16);
    header->chunk_count = u32_at(bytes + 24);
    header->vertex_count = u32_at(bytes + 28);
    header->branch_count = u32_at(bytes + 32);
    header->frame_count = u32_at(bytes + 36);
    header->segment_count = u32_at(bytes + 40);
    header->level_count = bytes[44];
    header->full_level_count = bytes[45];
    header->clip_count = bytes[46];
    header->wide = bytes[47] & 1;
    header->max_error = f64_at(bytes + 48);
}

static int check_count(uint32_t count, uint32_t limit)
{
    return count == 0 ? ATH_BAD_HEADER : count > limit ? ATH_LIMIT_EXCEEDED : ATH_OK;
}

static int check_header(const uint8_t *bytes, const ath_limits *limits, const ath_header *header)
{
    uint32_t counts[5] = {header->vertex_count, header->branch_count, header->frame_count, header->segment_count,
                          header->chunk_count};
    uint32_t most[5] = {limits->vertices, limits->branches, limits->frames, limits->frames, limits->chunks};
    for (int32_t i = 0; i < 5; i++) {
        int result = check_count(counts[i], most[i] < 1u << 30 ? most[i] : 1u << 30);
        if (result != ATH_OK) return result;
    }
    int valid = header->branch_count <= header->vertex_count && header->segment_count <= header->frame_count
                && header->frame_count <= (uint64_t)ATH_SEGMENT_FRAMES * header->segment_count
                && header->full_level_count >= 2 && header->full_level_count <= ATH_LEVELS && header->level_count >= 1
                && header->level_count <= header->full_level_count && header->clip_count >= 1 && bytes[47] < 2
                && u64_at(bytes + 56) == 0 && ath_is_finite(header->max_error) && header->max_error >= 0.0;
    return valid ? ATH_OK : ATH_BAD_HEADER;
}

/* ---- tables ---- */

static uint64_t error_count(const ath_header *header)
{
    return (uint64_t)header->level_count * header->segment_count;
}

static int check_errors(const uint8_t *table, uint64_t count, float *errors)
{
    for (uint64_t i = 0; i < 2 * count; i++) {
        float error = f32_at(table + 4 * i);
        if (!ath_is_finite((double)error) || error < 0.0f) return ATH_BAD_CHUNK_TABLE;
        if (errors) errors[i] = error;
    }
    return ATH_OK;
}

static int32_t kind_id(const ath_chunk *chunk) { return chunk->kind & ~OPTIONAL; }

int ath_is_motion(const ath_chunk *chunk) { return kind_id(chunk) >= 16 && kind_id(chunk) < 32; }

/* 1: known; 0: to be skipped; -1: refused. */
static int known(uint32_t kind)
{
    static const uint16_t kinds[] = {ATH_HIERARCHY, ATH_REST, ATH_TIME, ATH_CLIPS, OPTIONAL | 4, OPTIONAL | 5, OPTIONAL | 6,
                                     ATH_STEMS, ATH_AFFINES, ATH_CORRECTIONS, ATH_SHAPES, ATH_EXACT,
                                     OPTIONAL | 32};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        if (kinds[i] == kind) return 1;
        if ((kinds[i] & ~OPTIONAL) == (int)(kind & ~(uint32_t)OPTIONAL)) return -1;
    }
    return kind & OPTIONAL ? 0 : -1;
}

/* Grows along the file. */
static uint64_t key_of(const ath_chunk *chunk)
{
    if (ath_is_motion(chunk))
        return (uint64_t)1 << 62 | (uint64_t)chunk->level << 48 | (uint64_t)chunk->segment << 16 | chunk->kind;
    return (uint64_t)(kind_id(chunk) < 16 ? 0 : 2) << 62 | (uint64_t)kind_id(chunk);
}

static int check_chunk(const uint8_t *entry, const ath_limits *limits, const ath_header *header, const ath_chunk *chunk)
{
    if (known(chunk->kind) < 0) return ATH_UNKNOWN_CHUNK;
    if (chunk->length > limits->chunk_bytes) return ATH_LIMIT_EXCEEDED;
    int placed = ath_is_motion(chunk) ? chunk->level < header->level_count && chunk->segment < header->segment_count
                                      : chunk->level == ATH_NO_LEVEL && chunk->segment == 0;
    return placed && entry[2] == 0 ? ATH_OK : ATH_BAD_CHUNK_TABLE;
}

static int parse_chunks(const uint8_t *table, const ath_limits *limits, const ath_header *header, uint64_t *prelude,
                        ath_chunk *chunks)
{
    uint64_t offset = header->chunks_at, key_before = 0;
    *prelude = header->file_length;
    for (uint32_t i = 0; i < header->chunk_count; i++) {
        const uint8_t *entry = table + (size_t)CHUNK_SIZE * i;
        ath_chunk chunk;
        memset(&chunk, 0, sizeof chunk);
        chunk.kind = (uint16_t)u16_at(entry);
        chunk.level = entry[3];
        chunk.segment = u32_at(entry + 4);
        chunk.length = u32_at(entry + 8);
        chunk.checksum = u32_at(entry + 12);
        chunk.offset = offset;
        chunk.bytes = chunk.length == 0 ? table : 0; /* there is nothing to wait for */
        int result = check_chunk(entry, limits, header, &chunk);
        if (result != ATH_OK) return result;
        uint64_t key = key_of(&chunk);
        int repeatable = chunk.kind & OPTIONAL && kind_id(&chunk) >= 32;
        if (i > 0 && (key < key_before || (key == key_before && !repeatable))) return ATH_BAD_CHUNK_TABLE;
        if (key >> 62 > 0 && (i == 0 || key_before >> 62 == 0)) *prelude = offset;
        key_before = key;
        offset += chunk.length;
        if (chunks) chunks[i] = chunk;
    }
    return offset == header->file_length ? ATH_OK : ATH_BAD_CHUNK_TABLE;
}

static uint32_t front_checksum(const uint8_t *bytes, uint64_t size)
{
    static const uint8_t blank[4] = {0, 0, 0, 0};
    uint32_t crc = ath_crc32c(ath_crc32c(0, bytes, CHECKSUM_AT), blank, sizeof blank);
    return ath_crc32c(crc, bytes + CHECKSUM_AT + 4, (size_t)size - CHECKSUM_AT - 4);
}

int ath_read_front(const uint8_t *bytes, size_t available, const ath_limits *limits, ath_header *header, uint64_t *needed,
                   ath_chunk *chunks, float *errors)
{
    int result = check_magic(bytes, available);
    *needed = HEADER_SIZE;
    if (result != ATH_OK) return result;
    if (available < HEADER_SIZE) return ATH_MISSING;
    parse_header(bytes, header);
    if ((result = check_header(bytes, limits, header)) != ATH_OK) return result;
    uint64_t table_size = (uint64_t)CHUNK_SIZE * header->chunk_count, count = error_count(header);
    if (table_size + ERRORS_SIZE * count > limits->table_bytes) return ATH_LIMIT_EXCEEDED;
    header->chunks_at = *needed = HEADER_SIZE + table_size + ERRORS_SIZE * count;
    if (available < *needed) return ATH_MISSING;
    if (front_checksum(bytes, *needed) != header->checksum) return ATH_BAD_CHECKSUM;
    if ((result = check_errors(bytes + HEADER_SIZE + table_size, count, errors)) != ATH_OK) return result;
    if ((result = parse_chunks(bytes + HEADER_SIZE, limits, header, needed, chunks)) != ATH_OK) return result;
    return available < *needed ? ATH_MISSING : ATH_OK;
}

uint32_t ath_first_chunk(const ath_chunk *chunks, uint32_t chunk_count, int32_t kind, int32_t level, uint32_t segment)
{
    ath_chunk wanted;
    memset(&wanted, 0, sizeof wanted);
    wanted.kind = (uint16_t)kind;
    wanted.level = (uint8_t)level;
    wanted.segment = segment;
    uint64_t key = key_of(&wanted);
    uint32_t low = 0, high = chunk_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (key_of(chunks + middle) < key)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

const ath_chunk *ath_find_chunk(const ath_chunk *chunks, uint32_t chunk_count, int32_t kind, int32_t level,
                                uint32_t segment)
{
    const ath_chunk *found = chunks + ath_first_chunk(chunks, chunk_count, kind, level, segment);
    if (found == chunks + chunk_count || found->kind != kind) return 0;
    return !ath_is_motion(found) || (found->level == level && found->segment == segment) ? found : 0;
}

/* ---- heads of chunks ---- */

static ath_bytes rest_of(ath_bytes chunk, size_t head)
{
    ath_bytes rest;
    rest.bytes = chunk.bytes + head;
    rest.size = chunk.size - head;
    return rest;
}

int ath_parse_hierarchy(ath_bytes chunk, ath_thresholds *head, ath_bytes *body)
{
    if (chunk.size < 16) return ATH_BAD_CHUNK;
    head->epsilon = f32_at(chunk.bytes);
    head->xi = f32_at(chunk.bytes + 4);
    head->eta = u32_at(chunk.bytes + 8);
    head->lambda = u32_at(chunk.bytes + 12);
    *body = rest_of(chunk, 16);
    int valid = ath_is_finite((double)head->epsilon) && ath_is_finite((double)head->xi) && head->epsilon >= 0.0f
                && head->xi >= 0.0f;
    return valid ? ATH_OK : ATH_BAD_CHUNK;
}

int ath_parse_rest(ath_bytes chunk, ath_rest_head *head, ath_bytes *body)
{
    if (chunk.size < 36 || chunk.bytes[0] > 1 || chunk.bytes[1] > 1 || u16_at(chunk.bytes + 2) != 0) return ATH_BAD_CHUNK;
    head->exact = chunk.bytes[0];
    head->wide = chunk.bytes[1];
    head->step = f64_at(chunk.bytes + 28);
    *body = rest_of(chunk, 36);
    int valid = is_step(head->step);
    for (int32_t k = 0; k < 3; k++) {
        head->origin[k] = f64_at(chunk.bytes + 4 + 8 * k);
        valid = valid && ath_is_finite(head->origin[k]);
    }
    return valid ? ATH_OK : ATH_BAD_CHUNK;
}

/* Bytes of the character at the front; 0 where it is not UTF-8 (RFC 3629), or a control character. */
static size_t character_size(ath_bytes text)
{
    static const uint8_t least[4] = {0x20, 0xc2, 0xe0, 0xf0}, most[4] = {0x7e, 0xdf, 0xef, 0xf4};
    uint8_t first = text.bytes[0];
    for (size_t more = 0; more < 4; more++) {
        if (first < least[more] || first > most[more]) continue;
        if (more >= text.size) return 0;
        for (size_t i = 1; i <= more; i++)
            if (text.bytes[i] >> 6 != 2) return 0;
        uint8_t second = more > 0 ? text.bytes[1] : 0;
        int overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
        int beyond = (first == 0xed && second > 0x9f) || (first == 0xf4 && second > 0x8f); /* surrogates, no character */
        return overlong || beyond ? 0 : more + 1;
    }
    return 0;
}

static int is_name(ath_bytes text)
{
    while (text.size > 0) {
        size_t size = character_size(text);
        if (size == 0) return 0;
        text = rest_of(text, size);
    }
    return 1;
}

float ath_seam(const ath_clip_entry *entry, int32_t level) { return f32_at(entry->seams + 4 * level); }

int ath_parse_clip(ath_bytes *chunk, const ath_header *header, ath_clip_entry *entry)
{
    if (chunk->size < 10 || chunk->bytes[8] > 1) return ATH_BAD_CHUNK;
    entry->frames = u32_at(chunk->bytes);
    entry->segments = u32_at(chunk->bytes + 4);
    entry->loop = chunk->bytes[8];
    entry->name.size = chunk->bytes[9];
    size_t seams = entry->loop ? 4 * (size_t)header->full_level_count : 0;
    *chunk = rest_of(*chunk, 10);
    if (entry->segments < 1 || entry->segments > entry->frames
        || entry->frames > (uint64_t)ATH_SEGMENT_FRAMES * entry->segments || chunk->size < entry->name.size + seams
        || (entry->name.size == 0 && header->clip_count > 1))
        return ATH_BAD_CHUNK;
    entry->name.bytes = chunk->bytes;
    entry->seams = chunk->bytes + entry->name.size;
    *chunk = rest_of(*chunk, entry->name.size + seams);
    if (!is_name(entry->name)) return ATH_BAD_CHUNK;
    for (int32_t level = 0; entry->loop && level < header->full_level_count; level++)
        if (!ath_is_finite((double)ath_seam(entry, level)) || ath_seam(entry, level) < 0.0f) return ATH_BAD_CHUNK;
    return ATH_OK;
}

int ath_parse_time(ath_bytes chunk, int32_t clip_count, ath_time_method *method, ath_bytes *body)
{
    if (chunk.size < 1 || chunk.bytes[0] > 2) return ATH_BAD_CHUNK;
    *method = chunk.bytes[0];
    *body = rest_of(chunk, 1);
    return *method == 2 || body->size == 16 * (size_t)clip_count ? ATH_OK : ATH_BAD_CHUNK;
}

int ath_parse_steady(ath_bytes body, int32_t clip, double *first, double *step)
{
    *first = f64_at(body.bytes + 16 * (size_t)clip);
    *step = f64_at(body.bytes + 16 * (size_t)clip + 8);
    return is_step(*step) ? ATH_OK : ATH_BAD_CHUNK;
}

int ath_parse_stems(ath_bytes chunk, int32_t frames, ath_stems_head *head, ath_bytes *body)
{
    if (chunk.size < 8 || chunk.bytes[4] > 4) return ATH_BAD_CHUNK;
    head->step = (double)f32_at(chunk.bytes);
    head->omega = (double)(1 << chunk.bytes[4] >> 1);
    head->bits = chunk.bytes[5];
    head->rank = (int32_t)u16_at(chunk.bytes + 6);
    head->basis = *body = rest_of(chunk, 8);
    if (!is_step(head->step)) return ATH_BAD_CHUNK;
    if (head->bits == 0) return head->rank == 0 ? ATH_OK : ATH_BAD_CHUNK;
    if (head->bits < 8 || head->bits > 16 || head->rank < 1 || head->rank > frames || body->size < 4) return ATH_BAD_CHUNK;
    size_t length = u32_at(body->bytes);
    if (length > body->size - 4) return ATH_BAD_CHUNK;
    head->basis = rest_of(*body, 4);
    head->basis.size = length;
    *body = rest_of(*body, 4 + length);
    return ATH_OK;
}

int ath_parse_corrections(ath_bytes chunk, double *step, ath_bytes *body)
{
    if (chunk.size < 4) return ATH_BAD_CHUNK;
    *step = (double)f32_at(chunk.bytes);
    *body = rest_of(chunk, 4);
    return is_step(*step) ? ATH_OK : ATH_BAD_CHUNK;
}
