// What faces, curves and points look like, as athcodec/exporters/looks.py guesses it: their colours, and which faces are
// seen from both sides.
#pragma once

#include "static_data.h"

#include <pxr/gf/vec3f.h>

#include <string>
#include <vector>

namespace athusd
{

// The faces of an object. is_double_sided: the file states that they are seen from both sides.
struct ObjectFaces {
    std::string name;
    size_t first, count;
    bool is_double_sided;
};

struct Looks {
    std::vector<GfVec3f> colours; // For each material, linear.
    std::vector<int> materials;   // The material of each face.
    std::vector<char> is_open;    // Whether each face is part of an open surface, whose back is seen.
};

// rest: x, y and z of each vertex, scene units; empty where it cannot be read, and then no face is open.
// uv: the texture coordinates of vertices, or of corners; null if there are none.
Looks LooksOf(const StaticData &data, const std::vector<double> &rest, const StaticArray *uv, bool uv_is_of_corners,
              const std::vector<ObjectFaces> &objects);

// The colour of an object of edges or points.
GfVec3f LineColour(const std::string &name);

} // namespace athusd
