// An opened .ath file: its bytes, its player, and the frames that were decoded last.
#pragma once

#include <pxr/gf/vec3f.h>
#include <pxr/sdf/pxr.h>
#include <pxr/vt/array.h>
#include <pxr/vt/types.h>

#include "ath_player.h"

#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

SDF_NAMESPACE_USING_DIRECTIVE

namespace athusd
{

// Vertices and frames are those of the source, in its order. Any number of threads may ask at once.
class Motion
{
  public:
    // Null where the file cannot be opened: *why says it in a sentence.
    static std::shared_ptr<Motion> Open(const std::string &path, std::string *why);
    // Whether the file begins like an .ath file.
    static bool IsAth(const std::string &path);

    ~Motion();
    Motion(const Motion &) = delete;
    Motion &operator=(const Motion &) = delete;

    const std::string &Path() const { return _path; }
    const ath_file *File() const { return ath_player_file(_player); }
    const ath_info &Info() const { return _info; }

    // Positions of `count` vertices from `first` on, in a frame of a clip. False where its bytes are damaged: that is
    // reported once.
    bool Points(int clip, int frame, int level, size_t first, size_t count, VtVec3fArray *points) const;

  private:
    struct Frame {
        int clip, frame, level;
        VtVec3fArray points;
    };

    Motion() = default;
    bool _Decode(int clip, int frame, int level, VtVec3fArray *points) const;

    std::string _path;
    std::shared_ptr<const char> _bytes;
    size_t _size = 0;
    ath_player *_player = nullptr;
    ath_info _info{};
    mutable std::mutex _mutex;        // Guards all members below, and the player.
    mutable std::list<Frame> _frames; // the one that was asked for last in front
    mutable bool _reported = false;
};

} // namespace athusd
