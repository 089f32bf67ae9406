#include "static_data.h"

#include <pxr/tf/diagnostic.h>

#include <dlfcn.h>

#include <algorithm>
#include <cstring>

namespace athusd
{

namespace
{

constexpr uint64_t kMostBytes = uint64_t{1} << 28; // Max_Decoded_Chunk_Bytes

// The three functions of libzstd, whose interface is stable, that this needs: looked up so that a machine without it
// still plays motion.
struct Zstd {
    size_t (*decompress)(void *, size_t, const void *, size_t) = nullptr;
    unsigned (*is_error)(size_t) = nullptr;
    unsigned long long (*content_size)(const void *, size_t) = nullptr;

    Zstd()
    {
        void *library = dlopen("libzstd.so.1", RTLD_NOW | RTLD_LOCAL);
        if (!library) return;
        const auto look_up = [library](auto *function, const char *name) {
            *function = reinterpret_cast<std::remove_pointer_t<decltype(function)>>(dlsym(library, name));
        };
        look_up(&decompress, "ZSTD_decompress");
        look_up(&is_error, "ZSTD_isError");
        look_up(&content_size, "ZSTD_getFrameContentSize");
    }

    bool IsThere() const { return decompress && is_error && content_size; }

    bool Decode(const uint8_t *bytes, size_t size, std::vector<char> *out) const
    {
        const unsigned long long stated = content_size(bytes, size); // errors are numbers above any limit
        if (stated > kMostBytes) return false;
        out->resize(size_t(stated));
        const size_t done = decompress(out->data(), out->size(), bytes, size);
        return !is_error(done) && done == out->size();
    }
};

const Zstd &ZstdOf()
{
    static const Zstd zstd;
    return zstd;
}

void Report(const Motion &motion, const char *what)
{
    TF_RUNTIME_ERROR("%s: %s is damaged; it is left out", motion.Path().c_str(), what);
}

// ---- arrays ----

struct Cursor {
    const uint8_t *at;
    size_t left;

    bool Take(void *to, size_t size)
    {
        if (left < size) return false;
        std::memcpy(to, at, size);
        at += size;
        left -= size;
        return true;
    }
};

std::vector<char> Unshuffled(const std::vector<char> &planes, size_t items, size_t item_bytes)
{
    std::vector<char> out(planes.size());
    for (size_t plane = 0; plane < item_bytes; plane++)
        for (size_t item = 0; item < items; item++) out[item * item_bytes + plane] = planes[plane * items + item];
    return out;
}

// Whether elements of a kind may be of so many bytes.
bool IsType(int kind, size_t item_bytes)
{
    const bool is_power = item_bytes == 1 || item_bytes == 2 || item_bytes == 4 || item_bytes == 8;
    switch (kind) {
    case 0: return item_bytes == 1;
    case 1:
    case 2: return is_power;
    case 3: return is_power && item_bytes > 1;
    default: return kind == 4 && item_bytes >= 1 && item_bytes <= 1u << 20;
    }
}

enum class Read { Done, Damaged, NeedsZstd };

Read ReadArray(const ath_chunk &chunk, std::string *name, StaticArray *array)
{
    Cursor cursor{chunk.bytes, chunk.length};
    uint8_t type, dimensions;
    uint16_t name_length;
    uint32_t item_bytes;
    if (!cursor.Take(&type, 1) || !cursor.Take(&dimensions, 1) || !cursor.Take(&name_length, 2)
        || !cursor.Take(&item_bytes, 4) || dimensions > 32 || !IsType(type, item_bytes))
        return Read::Damaged;
    array->kind = type;
    array->item_bytes = item_bytes;
    uint64_t items = 1;
    for (int i = 0; i < dimensions; i++) {
        uint32_t extent;
        if (!cursor.Take(&extent, 4)) return Read::Damaged;
        array->shape.push_back(extent);
        items *= extent;
        if (items * item_bytes > kMostBytes) return Read::Damaged;
    }
    name->resize(name_length);
    if (!cursor.Take(name->data(), name_length)) return Read::Damaged;
    if (items == 0) return Read::Done;
    if (!ZstdOf().IsThere()) return Read::NeedsZstd;
    std::vector<char> planes;
    if (!ZstdOf().Decode(cursor.at, cursor.left, &planes) || planes.size() != items * item_bytes) return Read::Damaged;
    array->bytes = Unshuffled(planes, size_t(items), item_bytes);
    return Read::Done;
}

void ReadMetadata(const Motion &motion, const ath_chunk &chunk, StaticData *data)
{
    if (chunk.length < 1) return Report(motion, "METADATA");
    std::string text(reinterpret_cast<const char *>(chunk.bytes) + 1, chunk.length - 1);
    if (chunk.bytes[0] == 1) {
        std::vector<char> decoded;
        if (!ZstdOf().IsThere()) return data->unread.push_back("metadata");
        if (!ZstdOf().Decode(chunk.bytes + 1, chunk.length - 1, &decoded)) return Report(motion, "METADATA");
        text.assign(decoded.begin(), decoded.end());
    }
    const JsValue value = JsParseString(text);
    if (!value.IsObject()) return Report(motion, "METADATA");
    data->metadata = value.GetJsObject();
}

void ReadChunk(const Motion &motion, int index, StaticData *data)
{
    const ath_chunk &chunk = ath_chunks(motion.File())[index];
    if ((chunk.kind != ATH_METADATA && chunk.kind != ATH_ATTRIBUTE) || !chunk.bytes) return;
    if (ath_check_chunk(motion.File(), index, nullptr) != ATH_OK) return Report(motion, ath_kind_name(chunk.kind));
    if (chunk.kind == ATH_METADATA) return ReadMetadata(motion, chunk, data);
    std::string name;
    StaticArray array;
    switch (ReadArray(chunk, &name, &array)) {
    case Read::Done: data->arrays[name] = std::move(array); break;
    case Read::Damaged: Report(motion, "ATTRIBUTE"); break;
    case Read::NeedsZstd: data->unread.push_back(name); break;
    }
}

// ---- polygons ----

// One from each vertex but the first of a root to the one before it on its stem, or else to the attach vertex.
Polygons StemEdges(const Motion &motion)
{
    const ath_branch *branches = ath_branches(motion.File());
    const int32_t *source = ath_vertex_source(motion.File());
    Polygons edges;
    for (int b = 0; b < motion.Info().branch_count; b++) {
        const ath_branch &branch = branches[b];
        for (int i = 0; i < branch.count; i++) {
            if (i == 0 && branch.parent < 0) continue;
            const int before = i > 0 ? branch.first + i - 1 : branches[branch.parent].first + branch.attach;
            edges.corners.push_back(source[before]);
            edges.corners.push_back(source[branch.first + i]);
        }
    }
    edges.counts.assign(edges.corners.size() / 2, 2);
    return edges;
}

Polygons ReadPolygons(const Motion &motion, int kind)
{
    ath_polygons shape;
    Polygons out;
    const int result = ath_polygons_of(motion.File(), kind, &shape, nullptr);
    if (result == ATH_BAD_ARGUMENT) return out;
    if (result == ATH_OK && shape.is_derived) return StemEdges(motion);
    if (result == ATH_OK) {
        const size_t size = ath_polygons_size(motion.File());
        std::vector<std::max_align_t> memory(size / sizeof(std::max_align_t) + 1);
        std::vector<uint32_t> counts(shape.is_mixed ? shape.face_count : 0);
        out.corners.resize(shape.corner_count);
        if (ath_read_polygons(motion.File(), kind, memory.data(), size, shape.is_mixed ? counts.data() : nullptr,
                              out.corners.data(), nullptr)
            == ATH_OK) {
            if (shape.is_mixed)
                out.counts.assign(counts.begin(), counts.end());
            else
                out.counts.assign(shape.face_count, int(shape.columns));
            return out;
        }
    }
    Report(motion, ath_kind_name(kind));
    return Polygons{};
}

} // namespace

size_t StaticArray::Columns() const
{
    size_t columns = 1;
    for (size_t i = 1; i < shape.size(); i++) columns *= shape[i];
    return columns;
}

int64_t StaticArray::Integer(size_t index) const
{
    const char *at = bytes.data() + index * item_bytes;
    int64_t value = 0;
    std::memcpy(&value, at, std::min<size_t>(item_bytes, 8));
    const int unused = 64 - 8 * int(item_bytes);
    return kind == 2 && unused > 0 ? int64_t(uint64_t(value) << unused) >> unused : value;
}

StaticData StaticData::Read(const Motion &motion)
{
    StaticData data;
    for (int i = 0; i < motion.Info().chunk_count; i++) ReadChunk(motion, i, &data);
    data.faces = ReadPolygons(motion, ATH_FACES);
    data.edges = ReadPolygons(motion, ATH_EDGES);
    return data;
}

std::optional<double> Number(const JsObject &object, const std::string &name)
{
    const auto found = object.find(name);
    if (found == object.end()) return std::nullopt;
    if (found->second.IsInt()) return double(found->second.GetInt64());
    if (found->second.IsReal()) return found->second.GetReal();
    return std::nullopt;
}

std::optional<std::string> Text(const JsObject &object, const std::string &name)
{
    const auto found = object.find(name);
    if (found == object.end() || !found->second.IsString()) return std::nullopt;
    return found->second.GetString();
}

std::vector<std::string> Texts(const JsObject &object, const std::string &name)
{
    const auto found = object.find(name);
    if (found == object.end() || !found->second.IsArrayOf<std::string>()) return {};
    return found->second.GetArrayOf<std::string>();
}

} // namespace athusd
