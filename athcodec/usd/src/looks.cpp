#include "looks.h"

#include <pxr/gf/half.h>
#include <pxr/gf/vec3d.h>
#include <pxr/tf/stringUtils.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <numeric>
#include <set>

namespace athusd
{

namespace
{

// The area of a piece's holes, over its own, from which on it is open: surface.py's OPEN_SHARE.
constexpr double kOpenShare = 0.25;

enum Kind { kStems, kLeaves, kStalks, kFlowers, kFruits, kPlants, kNoKind };

const GfVec3f kColours[] = {{0.165f, 0.125f, 0.09f},
                            {0.14f, 0.26f, 0.05f},
                            {0.15f, 0.20f, 0.06f},
                            {0.60f, 0.29f, 0.38f},
                            {0.42f, 0.07f, 0.03f}};

struct Word {
    const char *text;
    Kind kind;
};

const Word kWords[] = {
    {"bark", kStems},     {"trunk", kStems},    {"branch", kStems},   {"bough", kStems},     {"twig", kStems},
    {"wood", kStems},     {"stem", kStems},     {"leaf", kLeaves},    {"leaves", kLeaves},   {"foliage", kLeaves},
    {"frond", kLeaves},   {"pinna", kLeaves},   {"blade", kLeaves},   {"needle", kLeaves},   {"lamina", kLeaves},
    {"grass", kLeaves},   {"stalk", kStalks},   {"petiole", kStalks}, {"rachis", kStalks},   {"culm", kStalks},
    {"tendril", kStalks}, {"flower", kFlowers}, {"petal", kFlowers},  {"blossom", kFlowers}, {"fruit", kFruits},
    {"plant", kPlants},   {"tree", kPlants},    {"shrub", kPlants},   {"bush", kPlants},     {"seedling", kPlants},
    {"sapling", kPlants},
};

// Returns the kind that a name means by its last telling word; kNoKind where that is a whole plant, or there is none.
Kind KindOf(const std::string &given)
{
    const std::string name = TfStringToLower(given);
    Kind kind = kNoKind;
    for (size_t at = 0; at < name.size();) {
        const auto is_here = [&](const Word &word) {
            const bool is_system = !std::strcmp(word.text, "stem") && at >= 2 && !name.compare(at - 2, 2, "sy");
            return !is_system && !name.compare(at, std::strlen(word.text), word.text);
        };
        const auto word = std::find_if(std::begin(kWords), std::end(kWords), is_here);
        if (word != std::end(kWords)) kind = word->kind;
        at += word == std::end(kWords) ? 1 : std::strlen(word->text);
    }
    return kind == kPlants ? kNoKind : kind;
}

// ---- open surfaces, as athcodec/exporters/surface.py finds them ----

// Things that are joined: each set is named by its first member.
class Sets
{
  public:
    explicit Sets(size_t count) : _parents(count) { std::iota(_parents.begin(), _parents.end(), size_t{0}); }

    size_t First(size_t member)
    {
        while (_parents[member] != member) member = _parents[member] = _parents[_parents[member]];
        return member;
    }

    void Join(size_t one, size_t other)
    {
        one = First(one);
        other = First(other);
        _parents[std::max(one, other)] = std::min(one, other);
    }

  private:
    std::vector<size_t> _parents;
};

using Pairs = std::vector<std::array<size_t, 2>>;

class Surface
{
  public:
    Surface(const Polygons &faces, const std::vector<double> &rest)
        : _corners(faces.corners), _rest(rest), _next(faces.corners.size())
    {
        for (size_t face = 0; face < faces.counts.size(); face++) {
            const size_t first = _face.size(), count = size_t(faces.counts[face]);
            _first.push_back(first);
            _face.insert(_face.end(), count, face);
            for (size_t i = 0; i < count; i++) _next[first + i] = first + (i + 1) % count;
        }
    }

    std::vector<char> IsOpen() const
    {
        const size_t face_count = _first.size(), vertices = _rest.size() / 3;
        std::vector<size_t> sides(_corners.size()), places(vertices), borders, rims;
        std::iota(sides.begin(), sides.end(), size_t{0});
        std::iota(places.begin(), places.end(), size_t{0});
        const Pairs inner = Shared(places, sides, &borders);
        MergePlaces(borders, &places);
        Pairs seams;
        for (const auto &pair : Shared(places, borders, &rims)) {
            if (Start(places, pair[0]) == End(places, pair[1]))
                seams.push_back(pair);
            else
                rims.insert(rims.end(), pair.begin(), pair.end());
        }
        Sets pieces(face_count);
        for (const Pairs *pairs : {&inner, static_cast<const Pairs *>(&seams)})
            for (const auto &[one, other] : *pairs) pieces.Join(_face[one], _face[other]);
        std::vector<double> holes = Holes(rims, places, &pieces), areas(face_count);
        for (size_t face = 0; face < face_count; face++) areas[pieces.First(face)] += FaceVector(face).GetLength();
        std::vector<char> open(face_count), is_open(face_count);
        for (size_t face = 0; face < face_count; face++) open[face] = holes[face] >= kOpenShare * areas[face];
        for (const auto &[one, other] : inner) // Neighbours that show different sides.
            if (_corners[one] == _corners[other]) open[pieces.First(_face[one])] = 1;
        for (size_t face = 0; face < face_count; face++) is_open[face] = open[pieces.First(face)];
        return is_open;
    }

  private:
    size_t Start(const std::vector<size_t> &numbers, size_t side) const { return numbers[size_t(_corners[side])]; }
    size_t End(const std::vector<size_t> &numbers, size_t side) const { return numbers[size_t(_corners[_next[side]])]; }

    GfVec3d Point(size_t vertex) const { return GfVec3d(&_rest[3 * vertex]); }

    // Returns pairs of sides that are an edge of two faces; *left gets the other sides.
    Pairs Shared(const std::vector<size_t> &numbers, const std::vector<size_t> &sides, std::vector<size_t> *left) const
    {
        std::map<std::array<size_t, 2>, std::vector<size_t>> edges;
        const auto edge_of = [&](size_t side) {
            const auto ends = std::minmax({Start(numbers, side), End(numbers, side)});
            return std::array<size_t, 2>{ends.first, ends.second};
        };
        for (const size_t side : sides) edges[edge_of(side)].push_back(side);
        Pairs pairs;
        for (const auto &[edge, uses] : edges)
            if (uses.size() == 2 && edge[0] != edge[1]) pairs.push_back({uses[0], uses[1]});
        for (const size_t side : sides) {
            const auto edge = edge_of(side);
            if (edges[edge].size() != 2 || edge[0] == edge[1]) left->push_back(side);
        }
        return pairs;
    }

    // Vertices at the border take the number of the first of those at their place.
    void MergePlaces(const std::vector<size_t> &borders, std::vector<size_t> *places) const
    {
        std::set<size_t> vertices;
        for (const size_t side : borders) {
            vertices.insert(size_t(_corners[side]));
            vertices.insert(size_t(_corners[_next[side]]));
        }
        std::map<std::array<double, 3>, size_t> first;
        for (const size_t vertex : vertices) {
            const double *at = &_rest[3 * vertex];
            (*places)[vertex] = first.emplace(std::array<double, 3>{at[0], at[1], at[2]}, vertex).first->second;
        }
    }

    // Returns for each piece the area of its holes. A rim is a part of the border that hangs together, and its hole as
    // large as the sum of vectors along it says.
    std::vector<double> Holes(const std::vector<size_t> &rims, const std::vector<size_t> &places, Sets *pieces) const
    {
        using Node = std::array<size_t, 2>; // A piece, and a place of it.
        std::map<Node, size_t> nodes;
        for (const size_t side : rims)
            for (const size_t place : {Start(places, side), End(places, side)})
                nodes[{pieces->First(_face[side]), place}] = 0;
        size_t count = 0;
        for (auto &[node, number] : nodes) number = count++;
        Sets joined(count);
        const auto node_of = [&](size_t side, size_t place) { return nodes[{pieces->First(_face[side]), place}]; };
        for (const size_t side : rims)
            joined.Join(node_of(side, Start(places, side)), node_of(side, End(places, side)));
        std::vector<GfVec3d> vectors(count, GfVec3d(0));
        for (const size_t side : rims) {
            const GfVec3d origin = Point(size_t(_corners[_first[pieces->First(_face[side])]]));
            const size_t start = Start(places, side), end = End(places, side);
            vectors[joined.First(node_of(side, start))] += GfCross(Point(start) - origin, Point(end) - origin) / 2;
        }
        std::vector<double> holes(_first.size());
        for (const auto &[node, number] : nodes) holes[node[0]] += vectors[number].GetLength();
        return holes;
    }

    // The normal of a face, as long as the face is large.
    GfVec3d FaceVector(size_t face) const
    {
        GfVec3d sum(0);
        for (size_t side = _first[face]; side < _face.size() && _face[side] == face; side++) {
            const GfVec3d origin = Point(size_t(_corners[_first[face]]));
            sum += GfCross(Point(size_t(_corners[side])) - origin, Point(size_t(_corners[_next[side]])) - origin) / 2;
        }
        return sum;
    }

    const std::vector<int> &_corners;
    const std::vector<double> &_rest;
    std::vector<size_t> _face, _first,
        _next; // The face of each side, the first side of each face, the side after each.
};

// ---- materials ----

struct Named {
    std::vector<int> labels; // The name of each face, -1 for none.
    std::vector<std::string> names;
};

double FirstColumn(const StaticArray &array, size_t row)
{
    const char *at = array.bytes.data() + row * array.Columns() * array.item_bytes;
    const auto as = [at](auto value) {
        std::memcpy(static_cast<void *>(&value), at, sizeof value);
        return double(value);
    };
    return array.item_bytes == 8 ? as(double()) : array.item_bytes == 4 ? as(float()) : as(GfHalf());
}

// The names of stems and leaves, as texture coordinates tell them apart: those of leaves have a first one above 1.
Named Surfaces(const StaticData &data, const StaticArray *uv, bool uv_is_of_corners)
{
    const std::vector<std::string> names = TfStringSplit(Text(data.metadata, "surfaces").value_or(""), ", ");
    const bool is_known = names.size() == 2 && (names[0] == "bark" || names[0] == "stalks")
                          && (names[1] == "leaves" || names[1] == "blades" || names[1] == "pinnae");
    Named named{std::vector<int>(data.faces.counts.size(), -1), {}};
    if (!is_known || !uv || uv->kind != 3 || uv->shape.size() != 2 || uv->bytes.empty()) return named;
    size_t corner = 0;
    for (size_t face = 0; face < named.labels.size(); face++) {
        double sum = 0;
        for (int i = 0; i < data.faces.counts[face]; i++, corner++)
            sum += FirstColumn(*uv, uv_is_of_corners ? corner : size_t(data.faces.corners[corner]));
        named.labels[face] = sum > data.faces.counts[face];
    }
    named.names = names;
    return named;
}

Named NamedOf(const StaticData &data, const StaticArray *uv, bool uv_is_of_corners)
{
    const auto array = data.arrays.find("face_material");
    const auto names = data.metadata.find("material_names");
    const size_t count = data.faces.counts.size();
    if (array == data.arrays.end() || !array->second.IsInteger() || array->second.shape != std::vector<size_t>{count}
        || names == data.metadata.end() || !names->second.IsArray())
        return Surfaces(data, uv, uv_is_of_corners);
    Named named{std::vector<int>(count, -1), {}};
    for (const JsValue &name : names->second.GetJsArray())
        named.names.push_back(name.IsString() ? name.GetString() : "");
    for (size_t face = 0; face < count; face++) {
        const int64_t label = array->second.Integer(face);
        if (label >= 0 && uint64_t(label) < named.names.size()) named.labels[face] = int(label);
    }
    return named;
}

Kind Commonest(const std::vector<Kind> &kinds, const std::vector<int> &labels, int label)
{
    std::array<size_t, kNoKind> counts{};
    for (size_t face = 0; face < labels.size(); face++) counts[kinds[face]] += labels[face] == label;
    return Kind(std::max_element(counts.begin(), counts.end()) - counts.begin());
}

} // namespace

Looks LooksOf(const StaticData &data, const std::vector<double> &rest, const StaticArray *uv, bool uv_is_of_corners,
              const std::vector<ObjectFaces> &objects)
{
    const size_t count = data.faces.counts.size();
    Looks looks;
    looks.is_open = rest.empty() ? std::vector<char>(count) : Surface(data.faces, rest).IsOpen();
    std::vector<Kind> kinds(count);
    for (size_t face = 0; face < count; face++) kinds[face] = looks.is_open[face] ? kLeaves : kStems;
    std::vector<char> states_sides(count);
    for (const ObjectFaces &object : objects) {
        const Kind kind = KindOf(object.name);
        for (size_t face = object.first; face < object.first + object.count; face++) {
            states_sides[face] = object.is_double_sided;
            if (kind != kNoKind) kinds[face] = kind;
        }
    }
    Named named = NamedOf(data, uv, uv_is_of_corners);
    for (size_t i = 0; i < named.names.size(); i++) {
        const Kind kind = KindOf(named.names[i]);
        looks.colours.push_back(kColours[kind == kNoKind ? Commonest(kinds, named.labels, int(i)) : kind]);
    }
    // Faces without a material get one for each kind, another where both sides are stated.
    std::map<int, int> guessed;
    for (size_t face = 0; face < count; face++)
        if (named.labels[face] < 0) guessed[2 * kinds[face] + states_sides[face]] = 0;
    for (auto &[code, label] : guessed) {
        label = int(looks.colours.size());
        looks.colours.push_back(kColours[code / 2]);
    }
    for (size_t face = 0; face < count; face++)
        if (named.labels[face] < 0) named.labels[face] = guessed[2 * kinds[face] + states_sides[face]];
    looks.materials = std::move(named.labels);
    return looks;
}

GfVec3f LineColour(const std::string &name)
{
    const Kind kind = KindOf(name);
    return kColours[kind == kNoKind ? kStems : kind];
}

} // namespace athusd
