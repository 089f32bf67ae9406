// Static data of a file: metadata, polygons, and named arrays.
#pragma once

#include "motion.h"

#include <pxr/js/json.h>
#include <pxr/js/value.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace athusd
{

// A static array: `kind` as ATTRIBUTE has it in FORMAT.md; numbers in the machine's byte order.
struct StaticArray {
    int kind = 0;
    size_t item_bytes = 0;
    std::vector<size_t> shape;
    std::vector<char> bytes;

    size_t Rows() const { return shape.empty() ? 1 : shape[0]; }
    size_t Columns() const;
    bool IsInteger() const { return kind == 1 || kind == 2; }
    int64_t Integer(size_t index) const;
};

struct Polygons {
    std::vector<int> counts, corners;
};

struct StaticData {
    JsObject metadata;
    std::map<std::string, StaticArray> arrays;
    std::vector<std::string> unread; // arrays that need Zstandard where there is none
    Polygons faces, edges;

    // Empty what the file does not have. What is damaged is reported and left out.
    static StaticData Read(const Motion &motion);
};

std::optional<double> Number(const JsObject &object, const std::string &name);
std::optional<std::string> Text(const JsObject &object, const std::string &name);
std::vector<std::string> Texts(const JsObject &object, const std::string &name);

} // namespace athusd
