/* Header, chunk table, error table, heads of chunks: read with every check that FORMAT.md asks for, in its order. */
#include "container.h"

enum { HEADER_SIZE = 64, CHUNK_SIZE = 16, ERRORS_SIZE = 8, CHECKSUM_AT = 12, MOST_SHIFT = 15, ONLY_TIPS = 8 };

static const uint32_t MOST_COUNT = 1u << 30; /* of anything, whatever the limits are */

static const double LARGEST = 1.7976931348623157e308;

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

static uint64_t error_count(const ath_header *header) { return (uint64_t)header->level_count * header->segment_count; }

int ath_is_finite(double value) { return value - value == 0.0; }

static int is_step(double value) { return ath_is_finite(value) && value > 0.0; }

void ath_default_limits(ath_limits *limits)
{
    static const ath_limits defaults = {1u << 20, 16u << 20,  1u << 26, 1u << 20,         1u << 20,
                                        4096,     256u << 20, 0,        (uint64_t)2 << 30};
    *limits = defaults;
}

/* ---- header ---- */

static uint32_t word_at(const uint8_t *bytes, size_t available, size_t at)
{
    uint32_t word = 0;
    for (size_t i = at; i < at + 4; i++) word = word << 8 | (i < available ? bytes[i] : 0);
    return word;
}

static int check_magic(const uint8_t *bytes, size_t available, ath_fault_info *fault)
{
    static const uint8_t magic[8] = {0x89, 'A', 'T', 'H', '\r', '\n', 0x1a, '\n'};
    for (size_t i = 0; i < 8 && i < available; i++) {
        double expected = (double)word_at(magic, sizeof magic, i & ~(size_t)3);
        if (bytes[i] != magic[i])
            return ath_refuse(fault, ATH_NOT_AN_ATH_FILE, ATH_FIELD_MAGIC,
                              (double)word_at(bytes, available, i & ~(size_t)3), expected, expected);
    }
    if (available < CHECKSUM_AT) return ATH_OK;
    uint32_t version = u16_at(bytes + 8) << 16 | u16_at(bytes + 10),
             expected = ATH_FORMAT_MAJOR << 16 | ATH_FORMAT_MINOR;
    if (version == expected) return ATH_OK;
    return ath_refuse(fault, ATH_UNSUPPORTED_VERSION, ATH_FIELD_VERSION, (double)version, (double)expected,
                      (double)expected);
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
    header->is_float64 = bytes[47] & 1;
    header->max_error = f64_at(bytes + 48);
    header->layer_count = bytes[56];
}

/* Whether the value is none of those allowed: then the fault is filled in. */
static int is_outside(ath_fault_info *fault, int code, ath_field field, double found, double least, double most)
{
    return !(found >= least && found <= most) && ath_refuse(fault, code, field, found, least, most);
}

static int is_bad_count(ath_fault_info *fault, ath_field field, uint32_t count, uint32_t limit)
{
    double most = limit < MOST_COUNT ? limit : MOST_COUNT;
    if (count == 0) return is_outside(fault, ATH_BAD_HEADER, field, 0, 1, most);
    return is_outside(fault, ATH_LIMIT_EXCEEDED, field, count, 1, most);
}

static int is_bad_header(const uint8_t *bytes, const ath_limits *limits, const ath_header *header,
                         ath_fault_info *fault)
{
    uint32_t least_segments = (header->frame_count + ATH_SEGMENT_FRAMES - 1) / ATH_SEGMENT_FRAMES;
    return is_bad_count(fault, ATH_FIELD_VERTEX_COUNT, header->vertex_count, limits->vertices)
           || is_bad_count(fault, ATH_FIELD_BRANCH_COUNT, header->branch_count, limits->branches)
           || is_bad_count(fault, ATH_FIELD_FRAME_COUNT, header->frame_count, limits->frames)
           || is_bad_count(fault, ATH_FIELD_SEGMENT_COUNT, header->segment_count, limits->frames)
           || is_bad_count(fault, ATH_FIELD_CHUNK_COUNT, header->chunk_count, limits->chunks)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_BRANCH_COUNT, header->branch_count, 1, header->vertex_count)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_SEGMENT_COUNT, header->segment_count, least_segments,
                         header->frame_count)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_FULL_LEVEL_COUNT, header->full_level_count, 2, ATH_LEVELS)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_LEVEL_COUNT, header->level_count, 1, header->full_level_count)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_CLIP_COUNT, header->clip_count, 1, 255)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_FLAGS, bytes[47], 0, 1)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_LAYER_COUNT, header->layer_count, 1, ATH_LAYERS)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_RESERVED, (double)(u64_at(bytes + 56) >> 8), 0, 0)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_MAX_ERROR, header->max_error, 0, LARGEST);
}

static int check_size(size_t available, uint64_t needed, ath_field field, ath_fault_info *fault)
{
    if (available >= needed) return ATH_OK;
    return ath_refuse(fault, ATH_MISSING, field, (double)available, (double)needed, (double)needed);
}

int ath_read_header(const uint8_t *bytes, size_t available, const ath_limits *limits, ath_header *header,
                    uint64_t *needed, ath_fault_info *fault)
{
    int result = check_magic(bytes, available, fault);
    *needed = HEADER_SIZE;
    if (result == ATH_OK) result = check_size(available, HEADER_SIZE, ATH_FIELD_HEADER_SIZE, fault);
    if (result != ATH_OK) return result;
    parse_header(bytes, header);
    if (is_bad_header(bytes, limits, header, fault)) return fault->code;
    uint64_t size = (uint64_t)CHUNK_SIZE * header->chunk_count + ERRORS_SIZE * error_count(header);
    if (size > limits->table_bytes)
        return ath_refuse(fault, ATH_LIMIT_EXCEEDED, ATH_FIELD_TABLE_SIZE, (double)size, 0, limits->table_bytes);
    header->chunks_at = *needed = HEADER_SIZE + size;
    return ATH_OK;
}

/* ---- tables ---- */

static int check_errors(const uint8_t *table, const ath_header *header, float *errors, ath_fault_info *fault)
{
    for (uint64_t i = 0; i < 2 * error_count(header); i++) {
        float error = f32_at(table + 4 * i);
        if (!ath_is_finite((double)error) || error < 0.0f) {
            ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_ERROR, (double)error, 0, LARGEST);
            fault->level = (uint8_t)(i / 2 / header->segment_count);
            fault->segment = (uint32_t)(i / 2 % header->segment_count);
            return ATH_BAD_CHUNK_TABLE;
        }
        if (errors) errors[i] = error;
    }
    return ATH_OK;
}

static int32_t kind_id(const ath_chunk *chunk) { return chunk->kind & ~ATH_OPTIONAL; }

int ath_is_motion(const ath_chunk *chunk) { return kind_id(chunk) >= 16 && kind_id(chunk) < 32; }

static int is_refused(int kind)
{
    return !ath_kind_name(kind) && (!(kind & ATH_OPTIONAL) || ath_kind_name(kind ^ ATH_OPTIONAL));
}

/* Grows along the file. */
static uint64_t key_of(const ath_chunk *chunk)
{
    if (ath_is_motion(chunk))
        return (uint64_t)1 << 62 | (uint64_t)chunk->level << 48 | (uint64_t)chunk->segment << 16 | chunk->kind;
    return (uint64_t)(kind_id(chunk) < 16 ? 0 : 2) << 62 | (uint64_t)kind_id(chunk);
}

static int is_bad_chunk(const ath_limits *limits, const ath_header *header, const ath_chunk *chunk, int reserved,
                        ath_fault_info *fault)
{
    int motion = ath_is_motion(chunk);
    double least_level = motion ? 0 : ATH_NO_LEVEL, most_level = motion ? header->level_count - 1 : ATH_NO_LEVEL;
    double most_segment = motion ? (double)header->segment_count - 1 : 0;
    return is_outside(fault, ATH_UNKNOWN_CHUNK, ATH_FIELD_CHUNK_KIND, is_refused(chunk->kind), 0, 0)
           || is_outside(fault, ATH_LIMIT_EXCEEDED, ATH_FIELD_CHUNK_SIZE, chunk->length, 0, limits->chunk_bytes)
           || is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_LEVEL, chunk->level, least_level, most_level)
           || is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_SEGMENT, chunk->segment, 0, most_segment)
           || is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_RESERVED, reserved, 0, 0);
}

static ath_chunk chunk_of(const uint8_t *entry, uint64_t offset)
{
    ath_chunk chunk;
    memset(&chunk, 0, sizeof chunk);
    chunk.kind = (uint16_t)u16_at(entry);
    chunk.level = entry[3];
    chunk.segment = u32_at(entry + 4);
    chunk.length = u32_at(entry + 8);
    chunk.checksum = u32_at(entry + 12);
    chunk.offset = offset;
    chunk.bytes = chunk.length == 0 ? entry : 0; /* there is nothing to wait for */
    return chunk;
}

static int parse_chunks(const uint8_t *table, const ath_limits *limits, const ath_header *header, uint64_t *prelude,
                        ath_chunk *chunks, ath_fault_info *fault)
{
    uint64_t offset = header->chunks_at, key_before = 0;
    *prelude = header->file_length;
    for (uint32_t i = 0; i < header->chunk_count; i++) {
        const uint8_t *entry = table + (size_t)CHUNK_SIZE * i;
        ath_chunk chunk = chunk_of(entry, offset);
        uint64_t key = key_of(&chunk);
        int repeatable = chunk.kind & ATH_OPTIONAL && kind_id(&chunk) >= 32;
        int in_order = i == 0 || key > key_before || (key == key_before && repeatable);
        if (is_bad_chunk(limits, header, &chunk, entry[2], fault)
            || is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_PLACE, i, 0, in_order ? i : i - 1.0))
            return ath_fault_at(fault, &chunk, (int32_t)i);
        if (key >> 62 > 0 && (i == 0 || key_before >> 62 == 0)) *prelude = offset;
        key_before = key;
        offset += chunk.length;
        if (chunks) chunks[i] = chunk;
    }
    if (offset == header->file_length) return ATH_OK;
    double expected = (double)header->file_length;
    return ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_FILE_LENGTH, (double)offset, expected, expected);
}

static uint32_t front_checksum(const uint8_t *bytes, uint64_t size)
{
    static const uint8_t blank[4] = {0, 0, 0, 0};
    uint32_t crc = ath_crc32c(ath_crc32c(0, bytes, CHECKSUM_AT), blank, sizeof blank);
    return ath_crc32c(crc, bytes + CHECKSUM_AT + 4, (size_t)size - CHECKSUM_AT - 4);
}

static int check_front(const uint8_t *bytes, const ath_header *header, ath_fault_info *fault)
{
    uint32_t found = front_checksum(bytes, header->chunks_at);
    if (found == header->checksum) return ATH_OK;
    return ath_refuse(fault, ATH_BAD_CHECKSUM, ATH_FIELD_FRONT_CHECKSUM, found, header->checksum, header->checksum);
}

int ath_read_tables(const uint8_t *bytes, size_t available, const ath_limits *limits, const ath_header *header,
                    uint64_t *needed, ath_chunk *chunks, float *errors, ath_fault_info *fault)
{
    const uint8_t *table = bytes + HEADER_SIZE;
    *needed = header->chunks_at;
    int result = available >= *needed
                     ? check_front(bytes, header, fault)
                     : check_size(available - HEADER_SIZE, *needed - HEADER_SIZE, ATH_FIELD_TABLE_SIZE, fault);
    if (result != ATH_OK) return result;
    result = check_errors(table + (size_t)CHUNK_SIZE * header->chunk_count, header, errors, fault);
    if (result != ATH_OK) return result;
    if ((result = parse_chunks(table, limits, header, needed, chunks, fault)) != ATH_OK) return result;
    return check_size(available, *needed, ATH_FIELD_PRELUDE_SIZE, fault);
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
    if (chunk.size < 36 || chunk.bytes[0] > 1 || chunk.bytes[1] > 1 || u16_at(chunk.bytes + 2) != 0)
        return ATH_BAD_CHUNK;
    head->exact = chunk.bytes[0];
    head->is_float64 = chunk.bytes[1];
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
        int beyond =
            (first == 0xed && second > 0x9f) || (first == 0xf4 && second > 0x8f); /* surrogates, no character */
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

int ath_parse_refined_rest(ath_bytes chunk, double *step, ath_bytes *body)
{
    if (chunk.size < 8) return ATH_BAD_CHUNK;
    *step = f64_at(chunk.bytes);
    *body = rest_of(chunk, 8);
    return is_step(*step) ? ATH_OK : ATH_BAD_CHUNK;
}

int ath_parse_refined_shapes(ath_bytes chunk, int32_t *shift, ath_bytes *body)
{
    if (chunk.size < 1 || chunk.bytes[0] > MOST_SHIFT) return ATH_BAD_CHUNK;
    *shift = chunk.bytes[0];
    *body = rest_of(chunk, 1);
    return ATH_OK;
}

int ath_parse_refined_stems(ath_bytes chunk, int32_t frames, ath_stems_head *head, ath_bytes *body)
{
    if (chunk.size < 2) return ATH_BAD_CHUNK;
    head->ratio = (int32_t)u16_at(chunk.bytes);
    return head->ratio < 1 ? ATH_BAD_CHUNK : ath_parse_stems(rest_of(chunk, 2), frames, head, body);
}

int ath_parse_stems(ath_bytes chunk, int32_t frames, ath_stems_head *head, ath_bytes *body)
{
    if (chunk.size < 6) return ATH_BAD_CHUNK;
    int32_t rotation = chunk.bytes[4] & ~ONLY_TIPS;
    head->step = (double)f32_at(chunk.bytes);
    head->rotation_step_factor = (double)(1 << rotation >> 1);
    head->only_tips = rotation != chunk.bytes[4];
    head->bits = chunk.bytes[5];
    *body = rest_of(chunk, 6);
    if (!is_step(head->step) || rotation > 4) return ATH_BAD_CHUNK;
    if (head->bits == 0) return ATH_OK;
    if (head->bits < 8 || head->bits > 16 || body->size < 7) return ATH_BAD_CHUNK;
    head->rank = (int32_t)u16_at(body->bytes);
    head->base = body->bytes[2] == ATH_NO_LEVEL ? -1 : body->bytes[2];
    size_t length = u32_at(body->bytes + 3);
    if (head->rank < 1 || head->rank > frames || length > body->size - 7) return ATH_BAD_CHUNK;
    head->basis = rest_of(*body, 7);
    head->basis.size = length;
    *body = rest_of(*body, 7 + length);
    return ATH_OK;
}

int ath_parse_corrections(ath_bytes chunk, double *step, ath_bytes *body)
{
    if (chunk.size < 4) return ATH_BAD_CHUNK;
    *step = (double)f32_at(chunk.bytes);
    *body = rest_of(chunk, 4);
    return is_step(*step) ? ATH_OK : ATH_BAD_CHUNK;
}
