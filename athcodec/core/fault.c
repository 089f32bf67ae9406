/* Why a file was refused: the numbers, and the sentence that is written from them. */
#include "container.h"

const char *ath_result_name(int result)
{
    static const char *const errors[] = {"OK", "INVALID", "NOT_AN_ATH_FILE", "UNSUPPORTED_VERSION", "TRUNCATED",
                                         "BAD_CHECKSUM", "BAD_HEADER", "BAD_CHUNK_TABLE", "UNKNOWN_CHUNK", "BAD_CHUNK",
                                         "LIMIT_EXCEEDED", "TRAILING_BYTES"};
    static const char *const calls[] = {"MORE", "HELD", "MISSING", "NOT_PREPARED", "NO_MEMORY", "BAD_ARGUMENT"};
    if (result >= 0 && result < (int)(sizeof errors / sizeof *errors)) return errors[result];
    int call = result - ATH_MORE;
    return call >= 0 && call < (int)(sizeof calls / sizeof *calls) ? calls[call] : "UNKNOWN";
}

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

int ath_refuse_chunk(ath_fault_info *fault, int code, ath_field field, const ath_chunk *chunk, int32_t index, double found,
                     double least, double most)
{
    ath_refuse(fault, code, field, found, least, most);
    fault->chunk = index;
    fault->kind = chunk->kind;
    fault->level = chunk->level;
    fault->segment = chunk->segment;
    fault->offset = chunk->offset;
    return code;
}

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
    case ATH_STEMS: return "STEMS";
    case ATH_AFFINES: return "AFFINES";
    case ATH_CORRECTIONS: return "CORRECTIONS";
    case ATH_SHAPES: return "SHAPES";
    case ATH_EXACT: return "EXACT";
    case ATH_ATTRIBUTE: return "ATTRIBUTE";
    default: return 0;
    }
}

/* ---- writing ---- */

typedef struct {
    char *text;
    size_t capacity, length; /* the length may go beyond the capacity: what does not fit is only counted */
} writer;

static void put_character(writer *out, char character)
{
    if (out->length + 1 < out->capacity) out->text[out->length] = character;
    out->length++;
}

static void put(writer *out, const char *text)
{
    while (*text) put_character(out, *text++);
}

static void put_integer(writer *out, uint64_t value)
{
    if (value >= 10) put_integer(out, value / 10);
    put_character(out, (char)('0' + value % 10));
}

static void put_hex(writer *out, uint32_t value, int digits)
{
    put(out, "0x");
    while (digits-- > 0) put_character(out, "0123456789abcdef"[value >> 4 * digits & 15]);
}

/* Six digits and an exponent, of a positive number; the last digit may be off by one. */
static void put_scientific(writer *out, double value)
{
    int exponent = 0;
    for (; value >= 10.0; exponent++) value /= 10.0;
    for (; value < 1.0; exponent--) value *= 10.0;
    uint64_t digits = (uint64_t)(value * 1e5 + 0.5);
    if (digits >= 1000000) {
        digits /= 10;
        exponent++;
    }
    put_integer(out, digits / 100000);
    put_character(out, '.');
    for (uint64_t unit = 10000; unit > 0; unit /= 10) put_character(out, (char)('0' + digits / unit % 10));
    put(out, exponent < 0 ? "e-" : "e+");
    put_integer(out, (uint64_t)(exponent < 0 ? -exponent : exponent));
}

static void put_number(writer *out, double value)
{
    if (value != value) {
        put(out, "nan");
        return;
    }
    if (value < 0.0) put_character(out, '-');
    value = value < 0.0 ? -value : value;
    if (!ath_is_finite(value))
        put(out, "inf");
    else if (value < 0x1p53 && value == (double)(uint64_t)value)
        put_integer(out, (uint64_t)value);
    else
        put_scientific(out, value);
}

/* ---- sentences ---- */

typedef enum { NUMBER, HEX, VERSION, NOTHING } number_form;

typedef struct {
    ath_field field;
    number_form form;
    const char *where;        /* of a fault that is about no chunk of the table */
    const char *before, *after; /* of the value found */
    const char *expected;     /* in place of the values allowed; null: these */
} sentence;

static const sentence sentences[] = {
    {ATH_FIELD_MAGIC, HEX, "file", "first bytes ", "", 0},
    {ATH_FIELD_VERSION, VERSION, "file", "format version ", "", 0},
    {ATH_FIELD_FILE_SIZE, NUMBER, "file", "", " bytes", 0},
    {ATH_FIELD_HEADER_SIZE, NUMBER, "header", "", " bytes", 0},
    {ATH_FIELD_TABLE_SIZE, NUMBER, "chunk table", "", " bytes", 0},
    {ATH_FIELD_PRELUDE_SIZE, NUMBER, "prelude", "", " bytes", 0},
    {ATH_FIELD_VERTEX_COUNT, NUMBER, "header", "Vertex_Count ", "", 0},
    {ATH_FIELD_BRANCH_COUNT, NUMBER, "header", "Branch_Count ", "", 0},
    {ATH_FIELD_FRAME_COUNT, NUMBER, "header", "Frame_Count ", "", 0},
    {ATH_FIELD_SEGMENT_COUNT, NUMBER, "header", "Segment_Count ", "", 0},
    {ATH_FIELD_CHUNK_COUNT, NUMBER, "header", "Chunk_Count ", "", 0},
    {ATH_FIELD_FULL_LEVEL_COUNT, NUMBER, "header", "Full_Level_Count ", "", 0},
    {ATH_FIELD_LEVEL_COUNT, NUMBER, "header", "Level_Count ", "", 0},
    {ATH_FIELD_CLIP_COUNT, NUMBER, "header", "Clip_Count ", "", 0},
    {ATH_FIELD_FLAGS, NUMBER, "header", "Flags ", "", 0},
    {ATH_FIELD_RESERVED, NUMBER, "header", "Reserved ", "", 0},
    {ATH_FIELD_MAX_ERROR, NUMBER, "header", "Max_Error ", "", "a finite length"},
    {ATH_FIELD_FRONT_CHECKSUM, HEX, "header and chunk table", "checksum ", "", 0},
    {ATH_FIELD_ERROR, NUMBER, "error table", "", "", "a finite length"},
    {ATH_FIELD_FILE_LENGTH, NUMBER, "chunk table", "chunks that end at byte ", "", 0},
    {ATH_FIELD_MEMORY, NUMBER, "header", "a need of ", " bytes of memory", 0},
    {ATH_FIELD_MISSING_CHUNK, NOTHING, "chunk table", "no ", "", "one"},
    {ATH_FIELD_CHUNK_KIND, NOTHING, "", "a required kind", "", "one that this decoder knows"},
    {ATH_FIELD_CHUNK_SIZE, NUMBER, "", "", " bytes", 0},
    {ATH_FIELD_CHUNK_RESERVED, NUMBER, "", "Reserved ", "", 0},
    {ATH_FIELD_CHUNK_LEVEL, NUMBER, "", "level ", "", 0},
    {ATH_FIELD_CHUNK_SEGMENT, NUMBER, "", "segment ", "", 0},
    {ATH_FIELD_CHUNK_PLACE, NUMBER, "", "entry ", " of the chunk table", "an earlier one, in file order, each chunk once"},
    {ATH_FIELD_UNEXPECTED_CHUNK, NOTHING, "", "a chunk that the hierarchy does not ask for", "", "none"},
    {ATH_FIELD_CHUNK_CHECKSUM, HEX, "", "checksum ", "", 0},
    {ATH_FIELD_HIERARCHY_DEPTH, NUMBER, "", "branches ", " deep", 0},
    {ATH_FIELD_CONTENT, NOTHING, "", "content that does not decode", "", "a valid stream"},
};

static void put_value(writer *out, number_form form, double value)
{
    if (form == HEX) put_hex(out, (uint32_t)value, 8);
    if (form == NUMBER) put_number(out, value);
    if (form != VERSION) return;
    put_integer(out, (uint64_t)value >> 16);
    put_character(out, '.');
    put_integer(out, (uint64_t)value & 0xffff);
}

static void put_level(writer *out, const ath_fault_info *fault)
{
    if (fault->level == ATH_NO_LEVEL) return;
    put(out, " of level ");
    put_integer(out, fault->level);
    put(out, ", segment ");
    put_integer(out, fault->segment);
}

static void put_kind(writer *out, const ath_fault_info *fault)
{
    const char *name = ath_kind_name(fault->kind);
    put(out, name ? name : "kind ");
    if (!name) put_hex(out, fault->kind, 4);
    put_level(out, fault);
}

static void put_place(writer *out, const ath_fault_info *fault, const sentence *s)
{
    if (fault->chunk < 0) {
        put(out, s->where);
        return;
    }
    put(out, "chunk ");
    put_kind(out, fault);
    put(out, " at byte ");
    put_integer(out, fault->offset);
}

static void put_found(writer *out, const ath_fault_info *fault, const sentence *s)
{
    put(out, ": got ");
    put(out, s->before);
    put_value(out, s->form, fault->found);
    put(out, s->after);
    if (s->field == ATH_FIELD_MISSING_CHUNK) put_kind(out, fault);
    if (s->field == ATH_FIELD_ERROR) put_level(out, fault);
}

static void put_allowed(writer *out, const ath_fault_info *fault, const sentence *s)
{
    int is_limit = fault->code == ATH_LIMIT_EXCEEDED;
    put(out, is_limit ? "; the limit is " : "; expected ");
    if (s->expected) {
        put(out, s->expected);
        return;
    }
    if (!is_limit && fault->least < fault->most) {
        put_value(out, s->form, fault->least);
        put(out, " to ");
    }
    put_value(out, s->form, fault->most);
}

size_t ath_fault_text(const ath_fault_info *fault, char *text, size_t capacity)
{
    writer out = {text, capacity, 0};
    const sentence *s = 0;
    for (size_t i = 0; i < sizeof sentences / sizeof *sentences; i++)
        if ((int32_t)sentences[i].field == fault->field) s = sentences + i;
    if (s) {
        put_place(&out, fault, s);
        put_found(&out, fault, s);
        put_allowed(&out, fault, s);
    } else {
        put(&out, ath_result_name(fault->code));
    }
    if (capacity > 0) text[out.length < capacity ? out.length : capacity - 1] = 0;
    return out.length;
}
