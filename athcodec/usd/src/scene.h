// The prims of a file: one Mesh, BasisCurves or Points for each of its objects under an Xform, as
// athcodec/exporters/usd.py writes them.
#pragma once

#include "motion.h"

#include <pxr/sdf/data.h>
#include <pxr/sdf/layer.h>
#include <pxr/sdf/path.h>

#include <string>
#include <vector>

namespace athusd
{

// The part of a file that a layer shows.
struct Choice {
    int clip = -1;  // -1: all, as variants
    int level = -1; // -1: the deepest
};

// An attribute with time samples: points, or with is_extent the box around them.
struct Series {
    SdfPath path;
    int clip;
    size_t first, count; // vertices
    float margin;        // Margin of an extent around the points: half of the largest width.
    bool is_extent;
};

struct Scene {
    SdfLayerRefPtr layer; // all but time samples
    std::vector<Series> series;
    std::vector<std::vector<double>> codes; // For each clip: the time codes of its frames.

    // With `metadata_only` the layer has no more than its own metadata.
    static Scene Of(const Motion &motion, const Choice &choice, bool metadata_only);
};

} // namespace athusd
