#define ATH_PLAYER_IMPLEMENTATION
#include "motion.h"

#include <pxr/ar/asset.h>
#include <pxr/ar/resolvedPath.h>
#include <pxr/ar/resolver.h>
#include <pxr/tf/diagnostic.h>

#include <cmath>
#include <cstddef>
#include <cstring>

namespace athusd
{

namespace
{

// Frames that are kept: enough for the two that a time lies between, in a stage whose prims look at several times.
constexpr size_t kCachedBytes = size_t{32} << 20;
constexpr size_t kFewestFrames = 4;

std::string FaultText(const ath_fault_info &fault, int result)
{
    char text[512];
    if (fault.code == ATH_OK) return ath_result_name(result);
    ath_fault_text(&fault, text, sizeof text);
    return text;
}

} // namespace

bool Motion::IsAth(const std::string &path)
{
    static const char magic[8] = {'\x89', 'A', 'T', 'H', '\r', '\n', '\x1a', '\n'};
    char begin[sizeof magic];
    const std::shared_ptr<ArAsset> asset = ArGetResolver().OpenAsset(ArResolvedPath(path));
    return asset && asset->Read(begin, sizeof begin, 0) == sizeof begin && !std::memcmp(begin, magic, sizeof magic);
}

std::shared_ptr<Motion> Motion::Open(const std::string &path, std::string *why)
{
    const std::shared_ptr<ArAsset> asset = ArGetResolver().OpenAsset(ArResolvedPath(path));
    std::shared_ptr<Motion> motion(new Motion);
    motion->_path = path;
    if (asset) {
        motion->_bytes = asset->GetBuffer();
        motion->_size = asset->GetSize();
    }
    if (!motion->_bytes) {
        *why = "cannot be read";
        return nullptr;
    }
    ath_fault_info fault{};
    const int result = ath_player_open(&motion->_player, reinterpret_cast<const uint8_t *>(motion->_bytes.get()),
                                       motion->_size, nullptr, &fault);
    if (result == ATH_NEEDS_HOST_MESH) {
        *why = "holds motion without a rest pose, of a mesh that the host has; expected a file with its rest pose "
               "(athcodec decode --host-mesh makes one)";
        return nullptr;
    }
    if (result != ATH_OK) {
        *why = FaultText(fault, result);
        return nullptr;
    }
    ath_player_set_budget(motion->_player, ATH_PLAYER_EXACT);
    ath_get_info(motion->File(), &motion->_info);
    return motion;
}

Motion::~Motion() { ath_player_close(_player); }

bool Motion::Points(int clip, int frame, int level, size_t first, size_t count, VtVec3fArray *points) const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    auto found = _frames.begin();
    while (found != _frames.end() && (found->clip != clip || found->frame != frame || found->level != level)) ++found;
    if (found == _frames.end()) {
        VtVec3fArray all;
        if (!_Decode(clip, frame, level, &all)) return false;
        const size_t bytes = all.size() * sizeof(GfVec3f);
        while (_frames.size() >= kFewestFrames && (_frames.size() + 1) * bytes > kCachedBytes) _frames.pop_back();
        _frames.push_front({clip, frame, level, std::move(all)});
    } else {
        _frames.splice(_frames.begin(), _frames, found);
    }
    const VtVec3fArray &all = _frames.front().points;
    *points = count == all.size() ? all : VtVec3fArray(all.cbegin() + first, all.cbegin() + first + count);
    return true;
}

bool Motion::_Decode(int clip, int frame, int level, VtVec3fArray *points) const
{
    const ath_clip &of = ath_clips(File())[clip];
    const double *times = ath_times(File()) + of.first_frame;
    ath_player_moment moment;
    int result = ath_player_show(_player, clip, times[frame] - times[0], ATH_CLAMP, level, &moment);
    if (result == ATH_OK) {
        points->resize(size_t(_info.vertex_count));
        // the frame itself, whatever rounding its seconds have seen
        result = ath_positions(File(), moment.segments, moment.segment_count, std::nearbyint(moment.frame),
                               ATH_SOURCE_ORDER, points->data()->data(), sizeof(GfVec3f));
    }
    if (result != ATH_OK && !_reported) {
        _reported = true;
        TF_RUNTIME_ERROR("%s: frame %d of clip %d: %s", _path.c_str(), frame, clip,
                         FaultText(*ath_player_fault(_player), result).c_str());
    }
    return result == ATH_OK;
}

} // namespace athusd
