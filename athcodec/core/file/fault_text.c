/* Text for people: names of results and levels, and the sentence that says why a file is refused. */
#include "file/file.h"

const char *ath_result_name(int result)
{
    static const char *const errors[] = {"OK",
                                         "INVALID",
                                         "NOT_AN_ATH_FILE",
                                         "UNSUPPORTED_VERSION",
                                         "TRUNCATED",
                                         "BAD_CHECKSUM",
                                         "BAD_HEADER",
                                         "BAD_CHUNK_TABLE",
                                         "UNKNOWN_CHUNK",
                                         "BAD_CHUNK",
                                         "LIMIT_EXCEEDED",
                                         "TRAILING_BYTES",
                                         "NEEDS_HOST_MESH",
                                         "WRONG_HOST_MESH",
                                         "UNSUPPORTED_FEATURE"};
    static const char *const calls[] = {"MORE", "HELD", "MISSING", "NOT_PREPARED", "NO_MEMORY", "BAD_ARGUMENT"};
    if (result >= 0 && result < (int)(sizeof errors / sizeof *errors)) return errors[result];
    int call = result - ATH_MORE;
    return call >= 0 && call < (int)(sizeof calls / sizeof *calls) ? calls[call] : "UNKNOWN";
}

typedef struct {
    char *text;
    size_t capacity, length; /* the length also counts characters that do not fit */
} writer;

static void put_character(writer *out, char character)
{
    if (out->length + 1 < out->capacity) out->text[out->length] = character;
    out->length++;
}

static void write_text(writer *out, const char *text)
{
    while (*text) put_character(out, *text++);
}

/* Terminates the text and returns its length. */
static size_t ended(writer *out)
{
    if (out->capacity > 0) out->text[out->length < out->capacity ? out->length : out->capacity - 1] = 0;
    return out->length;
}

static void put_integer(writer *out, uint64_t value)
{
    if (value >= 10) put_integer(out, value / 10);
    put_character(out, (char)('0' + value % 10));
}

static void put_hex(writer *out, uint32_t value, int digits)
{
    write_text(out, "0x");
    while (digits-- > 0) put_character(out, "0123456789abcdef"[value >> 4 * digits & 15]);
}

/* Writes six digits and an exponent of a positive number. The last digit may be off by one. */
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
    write_text(out, exponent < 0 ? "e-" : "e+");
    put_integer(out, (uint64_t)(exponent < 0 ? -exponent : exponent));
}

static void put_number(writer *out, double value)
{
    if (value != value) {
        write_text(out, "nan");
        return;
    }
    if (value < 0.0) put_character(out, '-');
    value = value < 0.0 ? -value : value;
    if (!ath_is_finite(value))
        write_text(out, "inf");
    else if (value < 0x1p53 && value == (double)(uint64_t)value)
        put_integer(out, (uint64_t)value);
    else
        put_scientific(out, value);
}

/* Sentences by field. %f: the value found; %a: the values allowed; %p: the chunk and its place; %k: kind, level and
 * segment; %l: level and segment; %m: the largest value allowed; %c: the smallest one, as a checksum; %n: the file's
 * version and unknown features. */
static const char *const sentences[] = {
    0,
    "file: got first bytes %f%a",
    "file: got format version %f%a",
    "file: got %n; expected features that this decoder has",
    "file: got %f bytes%a",
    "header: got %f bytes%a",
    "front: got %f bytes%a",
    "tables: got %f bytes%a",
    "prelude: got %f bytes%a",
    "header: got Vertex_Count %f%a",
    "header: got Branch_Count %f%a",
    "header: got Frame_Count %f%a",
    "header: got Segment_Count %f%a",
    "header: got Chunk_Count %f%a",
    "header: got Full_Level_Count %f%a",
    "header: got Level_Count %f%a",
    "header: got Clip_Count %f%a",
    "header: got Layer_Count %f%a",
    "header: got Max_Error %f; expected a finite length",
    "front: got checksum %f%a",
    "error table: got an entry%l that is out of range; expected a finite length",
    "front: got a join%l that cannot be; expected at most its frames less two, to a segment before it",
    "front: got a frame %f that repeats the one before its segment; expected repeats within segments",
    "front: got a stream that does not decode; expected a valid one",
    "header: got a need of %f bytes of memory%a",
    "chunk table: got no %k; expected one",
    "%p: got a required kind; expected one that this decoder knows",
    "%p: got %f bytes%a",
    "%p: got level %f%a",
    "%p: got segment %f%a",
    "%p: got entry %f of the chunk table; expected an earlier one, in file order, each chunk once",
    "%p: got a chunk that the hierarchy does not ask for; expected none",
    "%p: got checksum %f%a",
    "%p: got branches %f deep%a",
    "%p: got content that does not decode; expected a valid stream",
    "host mesh: got none; expected the mesh that the file was made for, of %m vertices, checksum %c",
    "host mesh: got %f vertices%a",
    "host mesh: got vertex %f with a number that is not finite; expected finite ones",
    "host mesh: got checksum %f%a",
};

static void put_version(writer *out, uint32_t version)
{
    put_integer(out, version >> 8);
    put_character(out, '.');
    put_integer(out, version & 0xff);
}

/* Writes "format 1.3 with feature 2, 5". */
static void put_features(writer *out, const ath_fault_info *fault)
{
    const char *before = " with feature ";
    write_text(out, "format ");
    put_version(out, (uint32_t)fault->most);
    for (uint32_t bit = 0; bit < 16; bit++) {
        if (((uint32_t)fault->found >> bit & 1) == 0) continue;
        write_text(out, before);
        put_integer(out, bit);
        before = ", ";
    }
}

static void put_value(writer *out, int32_t field, double value)
{
    if (field == ATH_FIELD_VERSION) {
        put_version(out, (uint32_t)value);
    } else if (field == ATH_FIELD_MAGIC || field == ATH_FIELD_FRONT_CHECKSUM || field == ATH_FIELD_CHUNK_CHECKSUM
               || field == ATH_FIELD_HOST_CHECKSUM) {
        put_hex(out, (uint32_t)value, 8);
    } else {
        put_number(out, value);
    }
}

static void put_allowed(writer *out, const ath_fault_info *fault)
{
    int is_limit = fault->code == ATH_LIMIT_EXCEEDED;
    write_text(out, is_limit ? "; the limit is " : "; expected ");
    if (!is_limit && fault->least < fault->most) {
        put_value(out, fault->field, fault->least);
        write_text(out, " to ");
    }
    put_value(out, fault->field, fault->most);
}

static void put_level(writer *out, const ath_fault_info *fault)
{
    if (fault->level == ATH_NO_LEVEL) return;
    write_text(out, " of level ");
    put_integer(out, fault->level);
    write_text(out, ", segment ");
    put_integer(out, fault->segment);
}

static void put_kind(writer *out, const ath_fault_info *fault)
{
    const char *name = ath_kind_name(fault->kind);
    write_text(out, name ? name : "kind ");
    if (!name) put_hex(out, fault->kind, 4);
    put_level(out, fault);
}

static void put_place(writer *out, const ath_fault_info *fault)
{
    write_text(out, "chunk ");
    put_kind(out, fault);
    write_text(out, " at byte ");
    put_integer(out, fault->offset);
}

static void put_sentence(writer *out, const ath_fault_info *fault, const char *sentence)
{
    for (; *sentence; sentence++) {
        if (*sentence != '%') {
            put_character(out, *sentence);
            continue;
        }
        switch (*++sentence) {
        case 'f': put_value(out, fault->field, fault->found); break;
        case 'a': put_allowed(out, fault); break;
        case 'p': put_place(out, fault); break;
        case 'k': put_kind(out, fault); break;
        case 'm': put_value(out, fault->field, fault->most); break;
        case 'n': put_features(out, fault); break;
        case 'c': put_hex(out, (uint32_t)fault->least, 8); break;
        default: put_level(out, fault);
        }
    }
}

size_t ath_fault_text(const ath_fault_info *fault, char *text, size_t capacity)
{
    writer out = {text, capacity, 0};
    int known = fault->field > ATH_FIELD_NONE && fault->field < (int32_t)(sizeof sentences / sizeof *sentences);
    put_sentence(&out, fault, known ? sentences[fault->field] : ath_result_name(fault->code));
    return ended(&out);
}

size_t ath_level_name(const ath_file *file, int32_t level, char *text, size_t capacity)
{
    writer out = {text, capacity, 0};
    int32_t layers = (int32_t)file->header.layer_count;
    level = ath_file_stage(file, level);
    if (level <= file->plan.height) {
        write_text(&out, "depth ");
        put_integer(&out, (uint64_t)level);
    } else if (level >= ath_lossy_stages(file)) {
        write_text(&out, "lossless");
    } else if (layers == 1) {
        write_text(&out, "all branches");
    } else {
        write_text(&out, "layer ");
        put_integer(&out, (uint64_t)ath_layer_of(file, level) + 1);
        write_text(&out, " of ");
        put_integer(&out, (uint64_t)layers);
    }
    return ended(&out);
}
