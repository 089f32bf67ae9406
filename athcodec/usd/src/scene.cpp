#include "scene.h"
#include "static_data.h"

#include <pxr/gf/half.h>
#include <pxr/gf/vec2d.h>
#include <pxr/gf/vec2f.h>
#include <pxr/gf/vec2h.h>
#include <pxr/gf/vec2i.h>
#include <pxr/gf/vec3d.h>
#include <pxr/gf/vec3h.h>
#include <pxr/gf/vec3i.h>
#include <pxr/gf/vec4d.h>
#include <pxr/gf/vec4f.h>
#include <pxr/gf/vec4h.h>
#include <pxr/gf/vec4i.h>
#include <pxr/sdf/attributeSpec.h>
#include <pxr/sdf/primSpec.h>
#include <pxr/sdf/relationshipSpec.h>
#include <pxr/sdf/schema.h>
#include <pxr/sdf/types.h>
#include <pxr/sdf/variantSetSpec.h>
#include <pxr/sdf/variantSpec.h>
#include <pxr/tf/stringUtils.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <set>

namespace athusd
{

namespace
{

constexpr char kRoot[] = "clip"; // the prim, and the variant set

struct Object {
    std::string name, kind;
    size_t first = 0, count = 0;
    size_t first_face = 0, face_count = 0, first_corner = 0, corner_count = 0;
    std::vector<int> curves;
    JsObject details;
    float margin = 0;
    SdfPrimSpecHandle prim;
};

// ---- names ----

std::string Distinct(const std::string &wanted, std::set<std::string> *taken)
{
    std::string name = wanted;
    for (int number = 2; !taken->insert(name).second; number++) name = TfStringPrintf("%s_%d", wanted.c_str(), number);
    return name;
}

std::string Identifier(const std::string &name, const char *otherwise)
{
    const std::string bare = TfStringTrim(name, "/");
    return TfMakeValidIdentifier(bare.empty() ? otherwise : bare);
}

// ---- objects ----

// Vertices of each curve where runs of neighbouring vertices that edges join make curves of two and more; else none.
std::vector<int> Chains(const Polygons &edges, size_t first, size_t count)
{
    std::vector<char> joined(count, 0);
    for (size_t i = 0; i + 1 < edges.corners.size(); i += 2) {
        const size_t low = size_t(std::min(edges.corners[i], edges.corners[i + 1]));
        const size_t high = size_t(std::max(edges.corners[i], edges.corners[i + 1]));
        if (high == low + 1 && low >= first && high < first + count) joined[high - first] = 1;
    }
    std::vector<int> curves;
    for (size_t i = 0; i < count; i++) {
        if (!joined[i]) curves.push_back(0);
        curves.back()++;
    }
    if (std::any_of(curves.begin(), curves.end(), [](int length) { return length < 2; })) curves.clear();
    return curves;
}

std::string KindOf(const StaticData &data, const Object &object)
{
    const auto is_own = [&](int v) { return size_t(v) >= object.first && size_t(v) < object.first + object.count; };
    if (std::any_of(data.faces.corners.begin(), data.faces.corners.end(), is_own)) return "mesh";
    return Chains(data.edges, object.first, object.count).empty() ? "points" : "curves";
}

// The runs of vertices that the file says are objects, where they fit; else one of all.
std::vector<Object> Division(const StaticData &data, size_t vertices)
{
    const std::vector<std::string> names = Texts(data.metadata, "part_names");
    const std::vector<std::string> kinds = Texts(data.metadata, "part_kinds");
    const auto counts = data.arrays.find("part_vertex_counts");
    std::vector<Object> objects;
    size_t done = 0;
    if (counts != data.arrays.end() && counts->second.IsInteger() && counts->second.shape.size() == 1
        && counts->second.Rows() == names.size())
        for (size_t i = 0; i < names.size(); i++) {
            const int64_t count = counts->second.Integer(i);
            if (count < 0 || size_t(count) > vertices - done) break;
            Object object;
            object.name = names[i];
            object.first = done;
            object.count = size_t(count);
            objects.push_back(object);
            done += size_t(count);
        }
    if (objects.empty() || objects.size() != names.size() || done != vertices) {
        objects.assign(1, Object{});
        objects[0].name = "plant";
        objects[0].count = vertices;
    }
    for (size_t i = 0; i < objects.size(); i++)
        objects[i].kind = kinds.size() == objects.size() ? kinds[i] : KindOf(data, objects[i]);
    return objects;
}

// Gives each object its faces, which are in the order of the objects. False where a face is of several.
bool ShareFaces(const Polygons &faces, std::vector<Object> *objects)
{
    size_t object = 0, corner = 0;
    for (size_t face = 0; face < faces.counts.size(); face++) {
        const size_t end = corner + size_t(faces.counts[face]);
        for (; corner < end; corner++) {
            const size_t vertex = size_t(faces.corners[corner]);
            const bool begins = corner + size_t(faces.counts[face]) == end;
            while (begins && vertex >= (*objects)[object].first + (*objects)[object].count) {
                object++;
                (*objects)[object].first_face = face;
                (*objects)[object].first_corner = corner;
            }
            const Object &own = (*objects)[object];
            if (vertex < own.first || vertex >= own.first + own.count) return false;
        }
        (*objects)[object].face_count = face + 1 - (*objects)[object].first_face;
        (*objects)[object].corner_count = corner - (*objects)[object].first_corner;
    }
    return true;
}

void ShareCurves(const StaticData &data, std::vector<Object> *objects)
{
    const auto said = data.arrays.find("curve_vertex_counts");
    int64_t stated = 0, wanted = 0;
    const bool is_there = said != data.arrays.end() && said->second.IsInteger() && said->second.shape.size() == 1;
    for (size_t i = 0; is_there && i < said->second.Rows(); i++) stated += said->second.Integer(i);
    for (const Object &object : *objects) wanted += object.kind == "curves" ? int64_t(object.count) : 0;
    size_t next = 0;
    for (Object &object : *objects) {
        if (object.kind != "curves") continue;
        int64_t left = int64_t(object.count);
        while (is_there && stated == wanted && left > 0 && next < said->second.Rows()) {
            object.curves.push_back(int(said->second.Integer(next++)));
            left -= object.curves.back();
        }
        if (left == 0) continue;
        object.curves = Chains(data.edges, object.first, object.count);
        if (object.curves.empty()) object.curves.push_back(int(object.count));
    }
}

void ShareDetails(const StaticData &data, std::vector<Object> *objects)
{
    const auto said = data.metadata.find("part_usd");
    if (said == data.metadata.end() || !said->second.IsArrayOf<JsObject>()) return;
    const std::vector<JsObject> details = said->second.GetArrayOf<JsObject>();
    for (size_t i = 0; details.size() == objects->size() && i < details.size(); i++) (*objects)[i].details = details[i];
}

std::vector<Object> ObjectsOf(const StaticData &data, size_t vertices)
{
    std::vector<Object> objects = Division(data, vertices);
    if (!ShareFaces(data.faces, &objects)) {
        objects.assign(1, Object{});
        objects[0].name = "plant";
        objects[0].kind = "mesh";
        objects[0].count = vertices;
        ShareFaces(data.faces, &objects);
    } else {
        ShareDetails(data, &objects);
    }
    ShareCurves(data, &objects);
    return objects;
}

// ---- specs ----

SdfAttributeSpecHandle Attribute(const SdfPrimSpecHandle &prim, const char *name, const SdfValueTypeName &type,
                                 SdfVariability variability = SdfVariabilityVarying)
{
    return SdfAttributeSpec::New(prim, name, type, variability);
}

void Token(const SdfPrimSpecHandle &prim, const char *name, const std::string &value)
{
    Attribute(prim, name, SdfValueTypeNames->Token, SdfVariabilityUniform)->SetDefaultValue(VtValue(TfToken(value)));
}

void Ints(const SdfPrimSpecHandle &prim, const char *name, const std::vector<int> &values)
{
    Attribute(prim, name, SdfValueTypeNames->IntArray)
        ->SetDefaultValue(VtValue(VtIntArray(values.begin(), values.end())));
}

// Every mesh shows both sides, because a file does not say that a surface is closed. Where the file does not state that
// both sides are seen, the attribute is marked as a guess, so that readers do not take it for a statement.
void ShowBothSides(const Object &object)
{
    const auto spec = Attribute(object.prim, "doubleSided", SdfValueTypeNames->Bool, SdfVariabilityUniform);
    spec->SetDefaultValue(VtValue(true));
    if (Text(object.details, "doubleSided") == "true") return;
    const VtDictionary marks{{"guessed", VtValue(true)}};
    spec->SetInfo(SdfFieldKeys->CustomData, VtValue(VtDictionary{{"athcodec", VtValue(marks)}}));
}

void DefineObject(const SdfPrimSpecHandle &root, const std::string &name, const Polygons &faces, Object *object)
{
    if (object->kind == "mesh") {
        object->prim = SdfPrimSpec::New(root, name, SdfSpecifierDef, "Mesh");
        const auto counts = faces.counts.begin() + object->first_face;
        const auto corners = faces.corners.begin() + object->first_corner;
        std::vector<int> own(corners, corners + object->corner_count);
        for (int &vertex : own) vertex -= int(object->first);
        Token(object->prim, "subdivisionScheme", Text(object->details, "subdivisionScheme").value_or("none"));
        Ints(object->prim, "faceVertexCounts", std::vector<int>(counts, counts + object->face_count));
        Ints(object->prim, "faceVertexIndices", own);
        ShowBothSides(*object);
    } else if (object->kind == "curves") {
        object->prim = SdfPrimSpec::New(root, name, SdfSpecifierDef, "BasisCurves");
        Ints(object->prim, "curveVertexCounts", object->curves);
        Token(object->prim, "type", Text(object->details, "type").value_or("linear"));
        Token(object->prim, "wrap", Text(object->details, "wrap").value_or("nonperiodic"));
        if (const auto basis = Text(object->details, "basis")) Token(object->prim, "basis", *basis);
    } else {
        object->prim = SdfPrimSpec::New(root, name, SdfSpecifierDef, "Points");
    }
    Attribute(object->prim, "points", SdfValueTypeNames->Point3fArray);
    Attribute(object->prim, "extent", SdfValueTypeNames->Float3Array);
}

// ---- primvars ----

struct Rows {
    size_t first, count;
};

Rows RowsOf(const std::string &domain, const Object &object)
{
    if (domain == "vertex") return {object.first, object.count};
    if (domain == "face") return {object.first_face, object.face_count};
    if (domain == "corner") return {object.first_corner, object.corner_count};
    return {0, 1};
}

// Returns what the file says if the rows fit it, else what they fit; empty if USD has no place for it.
std::string DomainOf(const StaticData &data, const std::string &name, const StaticArray &array, const ath_info &info)
{
    const std::map<std::string, size_t> rows = {{"vertex", size_t(info.vertex_count)},
                                                {"corner", data.faces.corners.size()},
                                                {"face", data.faces.counts.size()},
                                                {"constant", 1}};
    if (array.shape.empty()) return "";
    const auto domains = data.metadata.find("domains");
    if (domains != data.metadata.end() && domains->second.IsObject()) {
        if (const auto said = Text(domains->second.GetJsObject(), name)) {
            const auto found = rows.find(*said);
            return found != rows.end() && found->second == array.Rows() ? *said : "";
        }
    }
    for (const char *domain : {"vertex", "face"})
        if (array.Rows() == rows.at(domain) && !(array.Rows() == size_t(info.branch_count) && domain[0] == 'f'))
            return domain;
    return "";
}

template <class Stored, class Item> VtValue Values(const StaticArray &array, Rows rows)
{
    const size_t width = sizeof(Item) / sizeof(Stored) == 0 ? 1 : array.Columns();
    VtArray<Item> out;
    if constexpr (sizeof(Item) % sizeof(Stored) == 0 && !std::is_arithmetic_v<Item>) {
        out.resize(rows.count);
    } else {
        out.resize(rows.count * width);
    }
    std::memcpy(static_cast<void *>(out.data()), array.bytes.data() + rows.first * array.Columns() * sizeof(Stored),
                out.size() * sizeof(Item));
    return VtValue(out);
}

// Numbers of other widths become those that USD has.
template <class Item> VtValue Integers(const StaticArray &array, Rows rows)
{
    const size_t columns = array.Columns();
    VtArray<Item> out(rows.count * columns);
    for (size_t i = 0; i < out.size(); i++) out[i] = Item(array.Integer(rows.first * columns + i));
    return VtValue(out);
}

struct Typed {
    SdfValueTypeName type;
    VtValue values;
    int element_size = 1;
};

template <class One, class Two, class Three, class Four>
Typed Floats(const StaticArray &array, Rows rows, const SdfValueTypeName (&types)[4])
{
    const size_t columns = array.Columns();
    if (array.shape.size() == 2 && columns == 2) return {types[1], Values<One, Two>(array, rows)};
    if (array.shape.size() == 2 && columns == 3) return {types[2], Values<One, Three>(array, rows)};
    if (array.shape.size() == 2 && columns == 4) return {types[3], Values<One, Four>(array, rows)};
    return {types[0], Values<One, One>(array, rows), int(columns)};
}

Typed Integral(const StaticArray &array, Rows rows)
{
    const auto &types = *SdfValueTypeNames;
    const int columns = int(array.Columns());
    if (array.kind == 1 && array.item_bytes == 1)
        return {types.UCharArray, Integers<unsigned char>(array, rows), columns};
    if (array.kind == 1 && array.item_bytes == 8) return {types.UInt64Array, Integers<uint64_t>(array, rows), columns};
    if (array.kind == 1 && array.item_bytes == 4)
        return {types.UIntArray, Integers<unsigned int>(array, rows), columns};
    if (array.item_bytes == 8) return {types.Int64Array, Integers<int64_t>(array, rows), columns};
    return {types.IntArray, Integers<int>(array, rows), columns};
}

// The values of an object as an attribute of USD; no type: it has none for them.
Typed TypedValues(const std::string &name, const StaticArray &array, Rows rows)
{
    const auto &types = *SdfValueTypeNames;
    if (array.shape.size() > 2 || array.bytes.empty()) return {};
    if (array.IsInteger()) return Integral(array, rows);
    if (array.kind == 0 && array.shape.size() == 1) return {types.BoolArray, Values<bool, bool>(array, rows)};
    if (array.kind != 3) return {};
    if (array.item_bytes == 2)
        return Floats<GfHalf, GfVec2h, GfVec3h, GfVec4h>(
            array, rows, {types.HalfArray, types.Half2Array, types.Half3Array, types.Half4Array});
    if (array.item_bytes == 8)
        return Floats<double, GfVec2d, GfVec3d, GfVec4d>(
            array, rows, {types.DoubleArray, types.Double2Array, types.Double3Array, types.Double4Array});
    const bool is_uv = name == "uv", is_color = name == "colors", is_normal = name == "normals";
    return Floats<float, GfVec2f, GfVec3f, GfVec4f>(array, rows,
                                                    {types.FloatArray,
                                                     is_uv ? types.TexCoord2fArray : types.Float2Array,
                                                     is_color    ? types.Color3fArray
                                                     : is_normal ? types.Normal3fArray
                                                                 : types.Float3Array,
                                                     types.Float4Array});
}

const char *Interpolation(const std::string &domain)
{
    return domain == "vertex"   ? "vertex"
           : domain == "corner" ? "faceVarying"
           : domain == "face"   ? "uniform"
                                : "constant";
}

// radius: as widths of curves and points.
void Widths(const StaticArray &array, const std::string &domain, Object *object)
{
    VtFloatArray widths = Values<float, float>(array, RowsOf(domain, *object)).Get<VtFloatArray>();
    for (float &width : widths) {
        object->margin = std::max(object->margin, width);
        width *= 2;
    }
    const auto spec = Attribute(object->prim, "widths", SdfValueTypeNames->FloatArray);
    spec->SetDefaultValue(VtValue(widths));
    spec->SetInfo(TfToken("interpolation"), VtValue(TfToken(Interpolation(domain))));
}

bool Primvar(const std::string &name, const StaticArray &array, const std::string &domain, Object *object)
{
    const bool is_radius = name == "radius" && array.kind == 3 && array.item_bytes == 4 && array.shape.size() == 1;
    if (is_radius && object->kind != "mesh" && (domain == "vertex" || domain == "constant")) {
        Widths(array, domain, object);
        return true;
    }
    const Typed typed = TypedValues(name, array, RowsOf(domain, *object));
    if (!typed.type) return false;
    if (RowsOf(domain, *object).count == 0) return true; // without faces there are no values for them
    const std::string own = name == "uv" ? "st" : name == "colors" ? "displayColor" : Identifier(name, "array");
    const auto spec = Attribute(object->prim, ("primvars:" + own).c_str(), typed.type);
    spec->SetDefaultValue(typed.values);
    spec->SetInfo(TfToken("interpolation"), VtValue(TfToken(Interpolation(domain))));
    if (typed.element_size > 1) spec->SetInfo(TfToken("elementSize"), VtValue(typed.element_size));
    return true;
}

// Gives the objects their static arrays, but for those that are `known`. Returns the names of those that USD has no place
// for.
std::vector<std::string> Primvars(const StaticData &data, const ath_info &info, const std::set<std::string> &known,
                                  std::vector<Object> *objects)
{
    std::vector<std::string> left = data.unread;
    for (const auto &[name, array] : data.arrays) {
        if (known.count(name)) continue;
        const std::string domain = DomainOf(data, name, array, info);
        bool is_shown = !domain.empty();
        for (Object &object : *objects) is_shown = is_shown && Primvar(name, array, domain, &object);
        if (!is_shown) left.push_back(name);
    }
    return left;
}

// ---- materials ----

constexpr char kFaceMaterial[] = "face_material";

void BindMaterial(const SdfPrimSpecHandle &prim, const SdfPath &material)
{
    SdfRelationshipSpec::New(prim, "material:binding", false)->GetTargetPathList().GetExplicitItems() = {material};
}

void MarkAsBound(const SdfPrimSpecHandle &prim)
{
    prim->SetInfo(TfToken("apiSchemas"), VtValue(SdfTokenListOp::Create({TfToken("MaterialBindingAPI")})));
}

// Binds the faces of a mesh that have a material. labels: the number of each face's material, none outside 0 to
// materials.size() - 1.
void BindFaces(const Object &object, const std::vector<int64_t> &labels, const std::vector<SdfPath> &materials)
{
    std::map<int64_t, std::vector<int>> faces;
    for (size_t face = 0; face < object.face_count; face++) {
        const int64_t label = labels[object.first_face + face];
        if (label >= 0 && label < int64_t(materials.size())) faces[label].push_back(int(face));
    }
    if (faces.empty()) return;
    MarkAsBound(object.prim);
    if (faces.begin()->second.size() == object.face_count) {
        BindMaterial(object.prim, materials[size_t(faces.begin()->first)]);
        return;
    }
    Token(object.prim, "subsetFamily:materialBind:familyType", "nonOverlapping");
    for (const auto &[label, indices] : faces) {
        const SdfPath &material = materials[size_t(label)];
        const auto subset = SdfPrimSpec::New(object.prim, material.GetName(), SdfSpecifierDef, "GeomSubset");
        MarkAsBound(subset);
        Token(subset, "elementType", "face");
        Token(subset, "familyName", "materialBind");
        Ints(subset, "indices", indices);
        BindMaterial(subset, material);
    }
}

// Defines the materials that the file names, without contents, and binds the faces that have them. Returns whether the
// file says which faces have which material.
bool BindMaterials(const SdfPrimSpecHandle &root, const StaticData &data, const std::vector<Object> &objects,
                   std::set<std::string> *taken)
{
    const auto array = data.arrays.find(kFaceMaterial);
    const std::vector<std::string> names = Texts(data.metadata, "material_names");
    if (array == data.arrays.end() || !array->second.IsInteger() || names.empty()
        || array->second.shape != std::vector<size_t>{data.faces.counts.size()})
        return false;
    const auto scope = SdfPrimSpec::New(root, Distinct("materials", taken), SdfSpecifierDef, "Scope");
    std::set<std::string> identifiers;
    std::vector<SdfPath> materials;
    for (const std::string &name : names) {
        const std::string identifier = Distinct(Identifier(name, "part"), &identifiers);
        const auto material = SdfPrimSpec::New(scope, identifier, SdfSpecifierDef, "Material");
        if (identifier != name) material->SetInfo(SdfFieldKeys->DisplayName, VtValue(name));
        materials.push_back(material->GetPath());
    }
    std::vector<int64_t> labels;
    for (size_t face = 0; face < data.faces.counts.size(); face++) labels.push_back(array->second.Integer(face));
    for (const Object &object : objects)
        if (object.kind == "mesh") BindFaces(object, labels, materials);
    return true;
}

// ---- the layer ----

double MetresPerUnit(const JsObject &metadata)
{
    static const std::map<std::string, double> metres = {{"m", 1.0},       {"meter", 1.0},        {"metre", 1.0},
                                                         {"cm", 0.01},     {"centimeter", 0.01},  {"centimetre", 0.01},
                                                         {"mm", 0.001},    {"millimeter", 0.001}, {"millimetre", 0.001},
                                                         {"km", 1000.0},   {"kilometer", 1000.0}, {"kilometre", 1000.0},
                                                         {"in", 0.0254},   {"inch", 0.0254},      {"ft", 0.3048},
                                                         {"foot", 0.3048}, {"feet", 0.3048}};
    std::string unit = TfStringToLower(Text(metadata, "unit").value_or(""));
    auto found = metres.find(unit);
    if (found == metres.end() && unit.size() > 1 && unit.back() == 's')
        found = metres.find(unit.substr(0, unit.size() - 1));
    return found != metres.end() ? found->second : Number(metadata, "meters_per_unit").value_or(0);
}

// Frames per second: what the metadata state, else the median rate.
double RateOf(const JsObject &metadata, const double *times, int count)
{
    const double stated = Number(metadata, "fps").value_or(0);
    if (stated > 0 && std::isfinite(stated)) return stated;
    if (count < 2) return 30;
    std::vector<double> steps;
    for (int i = 1; i < count; i++) steps.push_back(times[i] - times[i - 1]);
    std::sort(steps.begin(), steps.end());
    const size_t middle = steps.size() / 2;
    return 1 / (steps.size() % 2 ? steps[middle] : (steps[middle - 1] + steps[middle]) / 2);
}

// The numbers of a clip's frames, as athcodec/exporters/timing.py has them; at any rate they ascend.
std::vector<double> CodesOf(const JsObject &metadata, const double *times, int count, double rate)
{
    const double start = Number(metadata, "start_frame").value_or(0);
    std::vector<double> codes;
    for (int i = 0; i < count; i++) {
        double code = start + std::nearbyint(times[i] * rate * 1e6) / 1e6;
        if (i > 0 && code <= codes.back()) code = std::nextafter(codes.back(), INFINITY);
        codes.push_back(code);
    }
    return codes;
}

// Returns the metadata of one clip: its own members replace those of all clips.
JsObject MetadataOf(const JsObject &metadata, const std::string &clip)
{
    JsObject own = metadata;
    const auto clips = metadata.find("clips");
    if (clips == metadata.end() || !clips->second.IsObject()) return own;
    const auto found = clips->second.GetJsObject().find(clip);
    if (found == clips->second.GetJsObject().end() || !found->second.IsObject()) return own;
    for (const auto &[name, value] : found->second.GetJsObject()) own[name] = value;
    return own;
}

void DescribeLayer(const Scene &scene, const JsObject &metadata, double rate, const std::vector<double> &codes)
{
    double first = codes.front(), last = codes.back();
    for (const auto &of_clip : scene.codes)
        if (!of_clip.empty()) first = std::min(first, of_clip.front()), last = std::max(last, of_clip.back());
    scene.layer->SetTimeCodesPerSecond(rate);
    scene.layer->SetFramesPerSecond(rate);
    scene.layer->SetStartTimeCode(first);
    scene.layer->SetEndTimeCode(last);
    const SdfPrimSpecHandle top = scene.layer->GetPseudoRoot();
    if (const double metres = MetresPerUnit(metadata); metres > 0)
        top->SetInfo(TfToken("metersPerUnit"), VtValue(metres));
    const std::string up = TfStringToUpper(Text(metadata, "up_axis").value_or(""));
    if (up == "Y" || up == "Z") top->SetInfo(TfToken("upAxis"), VtValue(TfToken(up)));
}

void AddSeries(Scene *scene, const SdfPath &prim, const Object &object, int clip)
{
    scene->series.push_back({prim.AppendProperty(TfToken("points")), clip, object.first, object.count, 0, false});
    if (object.count == 0) return;
    scene->series.push_back(
        {prim.AppendProperty(TfToken("extent")), clip, object.first, object.count, object.margin, true});
}

// A variant for each clip, in which the objects' points and extents have time samples.
void AddVariants(Scene *scene, const Motion &motion, const SdfPrimSpecHandle &root, const std::vector<Object> &objects)
{
    const auto set = SdfVariantSetSpec::New(root, kRoot);
    root->SetInfo(SdfFieldKeys->VariantSetNames, VtValue(SdfStringListOp::CreateExplicit({kRoot})));
    std::set<std::string> taken;
    for (int clip = 0; clip < motion.Info().clip_count; clip++) {
        const std::string given = ath_clips(motion.File())[clip].name;
        const bool is_valid = SdfSchema::IsValidVariantIdentifier(given);
        const std::string name = Distinct(is_valid ? given : Identifier(given, "clip"), &taken);
        const SdfPrimSpecHandle own = SdfVariantSpec::New(set, name)->GetPrimSpec();
        if (clip == 0) root->SetVariantSelection(kRoot, name);
        for (const Object &object : objects) {
            const auto prim = SdfPrimSpec::New(own, object.prim->GetName(), SdfSpecifierOver);
            Attribute(prim, "points", SdfValueTypeNames->Point3fArray);
            Attribute(prim, "extent", SdfValueTypeNames->Float3Array);
            AddSeries(scene, prim->GetPath(), object, clip);
        }
    }
}

} // namespace

Scene Scene::Of(const Motion &motion, const Choice &choice, bool metadata_only)
{
    Scene scene;
    scene.layer = SdfLayer::CreateAnonymous(".usda");
    const StaticData data = StaticData::Read(motion);
    const ath_info &info = motion.Info();
    const ath_clip *clips = ath_clips(motion.File());
    const double *times = ath_times(motion.File());
    const int shown = std::max(choice.clip, 0);
    const JsObject metadata = MetadataOf(data.metadata, clips[shown].name);
    const double rate = RateOf(metadata, times + clips[shown].first_frame, clips[shown].frame_count);
    scene.codes.resize(size_t(info.clip_count));
    for (int clip = 0; clip < info.clip_count; clip++)
        if (choice.clip < 0 || choice.clip == clip)
            scene.codes[size_t(clip)] = CodesOf(MetadataOf(data.metadata, clips[clip].name),
                                                times + clips[clip].first_frame, clips[clip].frame_count, rate);
    DescribeLayer(scene, metadata, rate, scene.codes[size_t(shown)]);
    scene.layer->SetDefaultPrim(TfToken(kRoot));
    if (metadata_only) return scene;
    const SdfPrimSpecHandle root = SdfPrimSpec::New(scene.layer, kRoot, SdfSpecifierDef, "Xform");
    std::vector<Object> objects = ObjectsOf(data, size_t(info.vertex_count));
    std::set<std::string> taken;
    for (Object &object : objects)
        DefineObject(root, Distinct(Identifier(object.name, "part"), &taken), data.faces, &object);
    std::set<std::string> known = {"part_vertex_counts", "curve_vertex_counts", "face_vertex_counts",
                                   "face_vertex_indices"};
    if (BindMaterials(root, data, objects, &taken)) known.insert(kFaceMaterial);
    const std::vector<std::string> left = Primvars(data, info, known, &objects);
    if (!left.empty())
        scene.layer->SetCustomLayerData({{"athcodec:notShown", VtValue(VtStringArray(left.begin(), left.end()))}});
    if (choice.clip < 0 && info.clip_count > 1) {
        AddVariants(&scene, motion, root, objects);
    } else {
        for (const Object &object : objects) AddSeries(&scene, object.prim->GetPath(), object, shown);
    }
    return scene;
}

} // namespace athusd
