/* Reads the front and the heads of chunks, with the checks of FORMAT.md in its order. */
#include "container/container.h"
#include "container/front.inl"

enum { HEADER_SIZE = 24, CHECKSUM_SIZE = 4, CHECKSUM_AT = 12, TABLE_ENTRY = 16, MOST_SHIFT = 15 };

static const uint32_t MOST_COUNT = 1u << 30; /* largest count of anything, whatever the limits are */

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

int ath_is_finite(double value) { return value - value == 0.0; }
static int is_step(double value) { return ath_is_finite(value) && value > 0.0; }

void ath_default_limits(ath_limits *limits)
{
    static const ath_limits defaults = {1u << 20, 16u << 20,  1u << 26, 1u << 20,         1u << 20,
                                        4096,     256u << 20, 0,        (uint64_t)2 << 30};
    *limits = defaults;
}

void ath_small_limits(ath_limits *limits)
{
    static const ath_limits small = {1u << 16, 1u << 20,  1u << 20, 1u << 16,           1u << 16,
                                     1024,     32u << 20, 0,        (uint64_t)256 << 20};
    *limits = small;
}

/* ---- header ---- */

static uint32_t word_at(const uint8_t *bytes, size_t available, size_t at)
{
    uint32_t word = 0;
    for (size_t i = at; i < at + 4; i++) word = word << 8 | (i < available ? bytes[i] : 0);
    return word;
}

/* A minor version only adds what a decoder skips, or what a bit of Features announces. */
static int check_version(uint32_t major, uint32_t minor, uint32_t features, ath_fault_info *fault)
{
    double known = (double)(ATH_FORMAT_MAJOR << 8 | ATH_FORMAT_MINOR), found = (double)(major << 8 | minor);
    if (major != ATH_FORMAT_MAJOR)
        return ath_refuse(fault, ATH_UNSUPPORTED_VERSION, ATH_FIELD_VERSION, found, known, known);
    if ((features & ~(uint32_t)ATH_FEATURES) == 0) return ATH_OK;
    return ath_refuse(fault, ATH_UNSUPPORTED_FEATURE, ATH_FIELD_FEATURES, (double)(features & ~(uint32_t)ATH_FEATURES),
                      known, found);
}

/* Checks the magic bytes as far as they are there, and the version and features once the bytes reach the checksum. */
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
    return check_version(bytes[8], bytes[9], u16_at(bytes + 10), fault);
}

/* Returns the code, and fills in the fault, if the value is out of range; else 0. */
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

static int is_bad_header(const ath_limits *limits, const ath_header *header, ath_fault_info *fault)
{
    uint32_t least_segments = (header->frame_count + ATH_SEGMENT_FRAMES - 1) / ATH_SEGMENT_FRAMES;
    return is_bad_count(fault, ATH_FIELD_VERTEX_COUNT, header->vertex_count, limits->vertices)
           || is_bad_count(fault, ATH_FIELD_BRANCH_COUNT, header->branch_count, limits->branches)
           || is_bad_count(fault, ATH_FIELD_FRAME_COUNT, header->frame_count, limits->frames)
           || is_bad_count(fault, ATH_FIELD_SEGMENT_COUNT, header->segment_count, limits->frames)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_BRANCH_COUNT, header->branch_count, 1, header->place_count)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_SEGMENT_COUNT, header->segment_count, least_segments,
                         header->frame_count)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_FULL_LEVEL_COUNT, header->full_level_count, 1, ATH_LEVELS)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_LEVEL_COUNT, header->level_count, 1, header->full_level_count)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_CLIP_COUNT, header->clip_count, 1, 255)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_LAYER_COUNT, header->layer_count, 1,
                         header->is_predicted ? 1 : ATH_LAYERS)
           || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_MAX_ERROR, header->max_error, 0, LARGEST);
}

static int check_size(size_t available, uint64_t needed, ath_field field, ath_fault_info *fault)
{
    if (available >= needed) return ATH_OK;
    return ath_refuse(fault, ATH_MISSING, field, (double)available, (double)needed, (double)needed);
}

static uint32_t front_checksum(const uint8_t *bytes, uint64_t size)
{
    static const uint8_t blank[4] = {0, 0, 0, 0};
    uint32_t crc = ath_crc32c(ath_crc32c(0, bytes, CHECKSUM_AT), blank, sizeof blank);
    return ath_crc32c(crc, bytes + CHECKSUM_AT + 4, (size_t)size - CHECKSUM_AT - 4);
}

/* Checks Front_Length, Chunk_Count and the checksum of the front. */
static int check_front(const uint8_t *bytes, size_t available, const ath_limits *limits, const ath_header *header,
                       ath_fault_info *fault)
{
    double size = (double)header->front_length, most = (double)limits->table_bytes;
    double least = (double)HEADER_SIZE + (double)CHECKSUM_SIZE * header->chunk_count;
    if (is_bad_count(fault, ATH_FIELD_CHUNK_COUNT, header->chunk_count, limits->chunks)
        || is_outside(fault, ATH_LIMIT_EXCEEDED, ATH_FIELD_FRONT_SIZE, size, 0, most)
        || is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_FRONT_SIZE, size, least, most))
        return fault->code;
    int result = check_size(available, header->front_length, ATH_FIELD_FRONT_SIZE, fault);
    if (result != ATH_OK) return result;
    uint32_t found = front_checksum(bytes, header->front_length), expected = u32_at(bytes + CHECKSUM_AT);
    if (found == expected) return ATH_OK;
    return ath_refuse(fault, ATH_BAD_CHECKSUM, ATH_FIELD_FRONT_CHECKSUM, found, expected, expected);
}

static void start_stream(ath_coder *coder, const uint8_t *bytes, ath_header *header)
{
    size_t checksums = (size_t)CHECKSUM_SIZE * header->chunk_count;
    coder_start(coder, bytes + HEADER_SIZE, (size_t)header->front_length - HEADER_SIZE - checksums);
    code_counts(coder, header);
}

int ath_read_header(const uint8_t *bytes, size_t available, const ath_limits *limits, ath_header *header,
                    uint64_t *needed, ath_fault_info *fault)
{
    ath_coder coder;
    *needed = HEADER_SIZE;
    memset(header, 0, sizeof *header);
    int result = check_magic(bytes, available, fault);
    if (result == ATH_OK) result = check_size(available, HEADER_SIZE, ATH_FIELD_HEADER_SIZE, fault);
    if (result != ATH_OK) return result;
    header->front_length = *needed = u32_at(bytes + 16);
    header->chunk_count = u32_at(bytes + 20);
    if ((result = check_front(bytes, available, limits, header, fault)) != ATH_OK) return result;
    start_stream(&coder, bytes, header);
    if (is_bad_header(limits, header, fault)) return fault->code;
    code_stages(&coder, header);
    header->stage_count = header->stages[header->level_count - 1] + 1;
    int32_t deepest = header->stages[header->full_level_count - 1];
    if (is_outside(fault, ATH_BAD_HEADER, ATH_FIELD_FULL_LEVEL_COUNT, deepest + 1, 1, ATH_LEVELS)) return fault->code;
    double size =
        (double)TABLE_ENTRY * ((double)header->chunk_count + (double)header->level_count * header->segment_count);
    if (is_outside(fault, ATH_LIMIT_EXCEEDED, ATH_FIELD_TABLE_SIZE, size, 0, limits->table_bytes)) return fault->code;
    return ATH_OK;
}

/* ---- tables ---- */

const char *ath_kind_name(int kind)
{
    switch (kind) {
    case ATH_HIERARCHY: return "HIERARCHY";
    case ATH_REST: return "REST";
    case ATH_TIME: return "TIME";
    case ATH_METADATA: return "METADATA";
    case ATH_FACES: return "FACES";
    case ATH_EDGES: return "EDGES";
    case ATH_CLIPS: return "CLIPS";
    case ATH_SOURCE_REST: return "SOURCE_REST";
    case ATH_STEMS: return "STEMS";
    case ATH_AFFINES: return "AFFINES";
    case ATH_CORRECTIONS: return "CORRECTIONS";
    case ATH_SHAPES: return "SHAPES";
    case ATH_EXACT: return "EXACT";
    case ATH_REFINED_REST: return "REFINED_REST";
    case ATH_PREDICTED: return "PREDICTED";
    case ATH_ATTRIBUTE: return "ATTRIBUTE";
    case ATH_PLACES: return "PLACES";
    default: return 0;
    }
}

static int is_refused(int kind)
{
    return !ath_kind_name(kind) && (!(kind & ATH_OPTIONAL) || ath_kind_name(kind ^ ATH_OPTIONAL));
}

/* Returns a key that grows along the file. */
static uint64_t key_of(const ath_chunk *chunk)
{
    if (ath_is_motion(chunk))
        return (uint64_t)1 << 62 | (uint64_t)chunk->stage << 48 | (uint64_t)chunk->segment << 16 | chunk->kind;
    return (uint64_t)(ath_kind_id(chunk) < 16 ? 0 : 2) << 62 | (uint64_t)ath_kind_id(chunk);
}

static int is_bad_chunk(const ath_limits *limits, const ath_header *header, const ath_chunk *chunk, int32_t stage,
                        ath_fault_info *fault)
{
    int motion = ath_is_motion(chunk);
    return is_outside(fault, ATH_UNKNOWN_CHUNK, ATH_FIELD_CHUNK_KIND, is_refused(chunk->kind), 0, 0)
           || is_outside(fault, ATH_LIMIT_EXCEEDED, ATH_FIELD_CHUNK_SIZE, chunk->length, 0, limits->chunk_bytes)
           || (motion
               && (is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_LEVEL, stage, 0, header->stage_count - 1)
                   || is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_SEGMENT, chunk->segment, 0,
                                 (double)header->segment_count - 1)));
}

/* *prelude: offset of the first chunk behind the prelude. */
static int read_chunks(ath_coder *coder, const uint8_t *checksums, const ath_limits *limits, ath_header *header,
                       uint64_t *prelude, ath_chunk *chunks, ath_fault_info *fault)
{
    chunk_model model;
    uint64_t offset = header->front_length, key_before = 0;
    int in_prelude = 1;
    *prelude = offset;
    header->has_faces = 0;
    chunk_model_init(&model);
    for (uint32_t i = 0; i < header->chunk_count; i++) {
        ath_chunk chunk;
        memset(&chunk, 0, sizeof chunk);
        chunk.offset = offset;
        code_chunk(coder, &model, header->segment_count, &chunk);
        chunk.checksum = u32_at(checksums + CHECKSUM_SIZE * (size_t)i);
        chunk.stage = (uint8_t)(ath_is_motion(&chunk) ? ath_min(model.stage, ATH_NO_LEVEL) : (int32_t)ATH_NO_LEVEL);
        chunk.level = (uint8_t)(ath_is_motion(&chunk) ? ath_level_of(header, chunk.stage) : (int32_t)ATH_NO_LEVEL);
        chunk.bytes = chunk.length == 0 ? checksums : 0; /* an empty chunk needs no feeding */
        uint64_t key = key_of(&chunk);
        int repeatable = chunk.kind & ATH_OPTIONAL && ath_kind_id(&chunk) >= 32;
        int in_order = i == 0 || key > key_before || (key == key_before && repeatable);
        if (is_bad_chunk(limits, header, &chunk, model.stage, fault)
            || is_outside(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_CHUNK_PLACE, i, 0, in_order ? i : i - 1.0))
            return ath_fault_at(fault, &chunk, (int32_t)i);
        key_before = key;
        offset += chunk.length;
        in_prelude = in_prelude && key >> 62 == 0;
        if (in_prelude) *prelude = offset;
        if (chunk.kind == ATH_FACES) header->has_faces = 1;
        if (chunks) chunks[i] = chunk;
    }
    header->file_length = offset;
    return ATH_OK;
}

static double short_float(int32_t value)
{
    uint32_t bits = (uint32_t)value << ATH_SHORT_SHIFT;
    float number;
    memcpy(&number, &bits, sizeof number);
    return (double)number;
}

static int read_errors(ath_coder *coder, const ath_header *header, double *errors, ath_fault_info *fault)
{
    error_model model;
    int32_t first[ATH_MEASURES];
    error_model_init(&model);
    for (int32_t i = 0; i < ATH_MEASURES; i++) first[i] = first_error(header->max_error);
    for (int32_t level = 0; level < header->level_count; level++) {
        int32_t entry[ATH_MEASURES];
        double most = level == header->level_count - 1 ? header->max_error : LARGEST;
        memcpy(entry, first, sizeof entry);
        for (uint32_t segment = 0; segment < header->segment_count; segment++) {
            if (!code_errors(coder, &model, segment == 0, entry, entry))
                return ath_refuse_entry(fault, ATH_FIELD_ERROR, level, segment, 0);
            if (segment == 0) memcpy(first, entry, sizeof first);
            for (int32_t i = 0; errors && i < ATH_MEASURES; i++) {
                double error = short_float(entry[i]);
                *errors++ = error < most ? error : most;
            }
        }
    }
    return ATH_OK;
}

static int read_joins(ath_coder *coder, const ath_header *header, uint8_t *joins, ath_fault_info *fault)
{
    join_model model;
    join_model_init(&model);
    for (int32_t level = 0; level < header->level_count; level++) {
        int32_t width = -1;
        for (uint32_t segment = 0; segment < header->segment_count; segment++) {
            width = header->segment_count > 1 ? code_join(coder, &model, width, 0) : 0;
            if (width < 0) return ath_refuse_entry(fault, ATH_FIELD_JOIN, level, segment, 0);
            if (joins) *joins++ = (uint8_t)width;
        }
    }
    return ATH_OK;
}

static int read_repeats(ath_coder *coder, const ath_header *header, uint8_t *repeats, ath_fault_info *fault)
{
    repeat_model model;
    int has_repeats = code_has_repeats(coder, &model, 0);
    if (repeats) memset(repeats, 0, header->frame_count);
    for (uint32_t i = 1; has_repeats && i < header->frame_count; i++) {
        int repeat = code_repeat(coder, &model, 0);
        if (repeats) repeats[i] = (uint8_t)repeat;
    }
    if (coder_finish(coder)) return ATH_OK;
    return ath_refuse(fault, ATH_BAD_CHUNK_TABLE, ATH_FIELD_FRONT, 0, 0, 0);
}

int ath_read_tables(const uint8_t *bytes, size_t available, const ath_limits *limits, ath_header *header,
                    uint64_t *needed, ath_chunk *chunks, double *errors, uint8_t *joins, uint8_t *repeats,
                    ath_fault_info *fault)
{
    ath_coder coder;
    const uint8_t *checksums = bytes + (header->front_length - (uint64_t)CHECKSUM_SIZE * header->chunk_count);
    start_stream(&coder, bytes, header);
    code_stages(&coder, header);
    int result = read_chunks(&coder, checksums, limits, header, needed, chunks, fault);
    if (result == ATH_OK) result = read_errors(&coder, header, errors, fault);
    if (result == ATH_OK) result = read_joins(&coder, header, joins, fault);
    if (result == ATH_OK) result = read_repeats(&coder, header, repeats, fault);
    return result != ATH_OK ? result : check_size(available, *needed, ATH_FIELD_PRELUDE_SIZE, fault);
}

uint32_t ath_first_chunk(const ath_chunk *chunks, uint32_t chunk_count, int32_t kind, int32_t stage, uint32_t segment)
{
    const ath_chunk wanted = {0, 0, 0, 0, segment, (uint16_t)kind, 0, (uint8_t)stage};
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

const ath_chunk *ath_find_chunk(const ath_chunk *chunks, uint32_t chunk_count, int32_t kind, int32_t stage,
                                uint32_t segment)
{
    const ath_chunk *found = chunks + ath_first_chunk(chunks, chunk_count, kind, stage, segment);
    if (found == chunks + chunk_count || found->kind != kind) return 0;
    return !ath_is_motion(found) || (found->stage == stage && found->segment == segment) ? found : 0;
}

/* ---- heads of chunks ---- */

static ath_bytes rest_of(ath_bytes chunk, size_t head)
{
    ath_bytes rest = {chunk.bytes + head, chunk.size - head};
    return rest;
}

/* Bits of Method. */
enum { REST_EXACT = 1, REST_FLOAT64 = 2, REST_HOST = 4, REST_CONNECTED = 8 };

int ath_parse_rest(ath_bytes chunk, ath_rest_head *head, ath_bytes *body)
{
    if (chunk.size < 17) return ATH_BAD_CHUNK;
    int32_t method = chunk.bytes[0];
    head->exact = (method & REST_EXACT) != 0;
    head->is_float64 = (method & REST_FLOAT64) != 0;
    head->is_host = method == REST_HOST;
    head->connected = (method & REST_CONNECTED) != 0;
    int32_t others = REST_EXACT | REST_FLOAT64 | REST_CONNECTED;
    if (!head->is_host && method & ~others) return ATH_BAD_CHUNK;
    head->step = (double)f32_at(chunk.bytes + 13);
    *body = rest_of(chunk, 17);
    int valid = is_step(head->step) && (!head->is_host || body->size == sizeof head->host_checksum);
    for (size_t k = 0; valid && head->is_host && k < 2; k++) head->host_checksum[k] = u32_at(body->bytes + 4 * k);
    for (int32_t k = 0; k < 3; k++) {
        head->origin[k] = (double)f32_at(chunk.bytes + 1 + 4 * k);
        valid = valid && ath_is_finite(head->origin[k]);
    }
    return valid ? ATH_OK : ATH_BAD_CHUNK;
}

/* Bits of Index_Type above the type itself. */
enum { IS_MIXED = 8, IS_DERIVED = 16, TYPE_BITS = 7 };

int32_t ath_vertices_of_type(int32_t type, int32_t vertex_count)
{
    int32_t bits = ath_bits_of_type(type);
    return bits < 31 ? ath_min(vertex_count, 1 << bits) : vertex_count;
}

int ath_parse_polygons(ath_bytes chunk, ath_polygons *shape, ath_bytes *body)
{
    if (chunk.size < 1) return ATH_BAD_CHUNK;
    int32_t flags = chunk.bytes[0] & ~TYPE_BITS;
    memset(shape, 0, sizeof *shape);
    shape->index_type = chunk.bytes[0] & TYPE_BITS;
    shape->is_mixed = (flags & IS_MIXED) != 0;
    shape->is_derived = flags == IS_DERIVED;
    *body = rest_of(chunk, 1);
    if (shape->is_derived) return body->size == 0 ? ATH_OK : ATH_BAD_CHUNK;
    if (flags & ~IS_MIXED || body->size < 8 + (size_t)shape->is_mixed) return ATH_BAD_CHUNK;
    if (shape->is_mixed) {
        shape->count_type = body->bytes[0];
        *body = rest_of(*body, 1);
        if (shape->count_type > TYPE_BITS) return ATH_BAD_CHUNK;
    }
    uint64_t faces = u32_at(body->bytes), corners = u32_at(body->bytes + 4);
    if (!shape->is_mixed) {
        shape->columns = (uint32_t)corners;
        corners = corners * faces;
    }
    *body = rest_of(*body, 8);
    if (faces > MOST_CORNERS || shape->columns > MOST_CORNERS || corners > MOST_CORNERS - faces)
        return ATH_LIMIT_EXCEEDED;
    shape->face_count = (uint32_t)faces;
    shape->corner_count = (uint32_t)corners;
    return ATH_OK;
}

int ath_parse_source_rest(ath_bytes chunk, ath_source_rest_head *head, ath_bytes *body)
{
    if (chunk.size < 1 || chunk.bytes[0] > 1) return ATH_BAD_CHUNK;
    head->exact = chunk.bytes[0];
    head->step = 1.0;
    *body = rest_of(chunk, 1);
    return head->exact ? ATH_OK : ath_parse_stepped(*body, &head->step, body);
}

/* Returns the bytes of the character at the front; 0 if it is not UTF-8 (RFC 3629), or a control character. */
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
            (first == 0xed && second > 0x9f) || (first == 0xf4 && second > 0x8f); /* surrogates; beyond Unicode */
        return overlong || beyond ? 0 : more + 1;
    }
    return 0;
}

int ath_is_text(ath_bytes text, int may_control)
{
    while (text.size > 0) {
        size_t size = may_control && text.bytes[0] < 0x80 ? 1 : character_size(text);
        if (size == 0) return 0;
        text = rest_of(text, size);
    }
    return 1;
}

float ath_seam(const ath_clip_entry *entry, int32_t level) { return f32_at(entry->seams + 4 * level); }

int ath_parse_clip(ath_bytes *chunk, const ath_header *header, ath_clip_entry *entry)
{
    if (chunk->size < 10 || chunk->bytes[8] > 3) return ATH_BAD_CHUNK;
    entry->frames = u32_at(chunk->bytes);
    entry->segments = u32_at(chunk->bytes + 4);
    entry->loop = chunk->bytes[8] & 1;
    entry->periodic = chunk->bytes[8] >> 1;
    entry->name.size = chunk->bytes[9];
    size_t seams = entry->loop ? 4 * (size_t)header->full_level_count : 0;
    *chunk = rest_of(*chunk, 10);
    if (entry->segments < 1 || entry->segments > entry->frames
        || entry->frames > (uint64_t)ATH_SEGMENT_FRAMES * entry->segments || chunk->size < entry->name.size + seams
        || (entry->name.size == 0 && header->clip_count > 1)
        || (entry->periodic && !(entry->loop && entry->segments == 1)))
        return ATH_BAD_CHUNK;
    entry->name.bytes = chunk->bytes;
    entry->seams = chunk->bytes + entry->name.size;
    *chunk = rest_of(*chunk, entry->name.size + seams);
    if (!ath_is_text(entry->name, 0)) return ATH_BAD_CHUNK;
    for (int32_t level = 0; entry->loop && level < header->full_level_count; level++)
        if (!ath_is_finite((double)ath_seam(entry, level)) || ath_seam(entry, level) < 0.0f) return ATH_BAD_CHUNK;
    return ATH_OK;
}

int ath_parse_time(ath_bytes chunk, int32_t clip_count, ath_time_method *method, ath_bytes *body)
{
    if (chunk.size < 1 || chunk.bytes[0] > ATH_TIME_STREAM) return ATH_BAD_CHUNK;
    *method = (ath_time_method)chunk.bytes[0];
    *body = rest_of(chunk, 1);
    size_t of_each = *method == ATH_TIME_RATE ? 2 : 16;
    return *method == ATH_TIME_STREAM || body->size == of_each * (size_t)clip_count ? ATH_OK : ATH_BAD_CHUNK;
}

int ath_parse_steady(ath_bytes body, ath_time_method method, int32_t clip, double *first, double *step)
{
    *first = method == ATH_TIME_RATE ? 0.0 : f64_at(body.bytes + 16 * (size_t)clip);
    *step = method == ATH_TIME_RATE ? (double)u16_at(body.bytes + 2 * (size_t)clip)
                                    : f64_at(body.bytes + 16 * (size_t)clip + 8);
    return is_step(*step) ? ATH_OK : ATH_BAD_CHUNK;
}

int ath_parse_stepped(ath_bytes chunk, double *step, ath_bytes *body)
{
    if (chunk.size < 4) return ATH_BAD_CHUNK;
    *step = (double)f32_at(chunk.bytes);
    *body = rest_of(chunk, 4);
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
    static const double factors[] = {0.0, 1.0, 8.0};
    int32_t rotation = chunk.bytes[4] & 15;
    head->step = (double)f32_at(chunk.bytes);
    if (rotation > 2) return ATH_BAD_CHUNK;
    head->rotation_step_factor = factors[rotation];
    head->turn = chunk.bytes[4] >> 4;
    head->basis_kind = chunk.bytes[5];
    *body = rest_of(chunk, 6);
    if (!is_step(head->step) || head->basis_kind > ATH_BASIS_AS_SAMPLES) return ATH_BAD_CHUNK;
    if (head->basis_kind == ATH_WAVES) return ATH_OK;
    if (body->size < 7) return ATH_BAD_CHUNK;
    head->rank = (int32_t)u16_at(body->bytes);
    head->base = body->bytes[2] == ATH_NO_LEVEL ? -1 : body->bytes[2];
    size_t length = u32_at(body->bytes + 3);
    if (head->rank < 1 || head->rank > frames || length > body->size - 7) return ATH_BAD_CHUNK;
    head->basis = rest_of(*body, 7);
    head->basis.size = length;
    *body = rest_of(*body, 7 + length);
    return ATH_OK;
}
