// The session's pictures as a video.
#pragma once

#include <filesystem>

namespace fulcrum::supervisor {

/// Writes the pictures in `frames` to `clip` (MP4, in the session's own time) by the program `ffmpeg`, whose output
/// goes to `log`. False when that is not installed or fails, takes longer than a minute, or when there are no two
/// pictures: then there is no clip, and nothing else is lost.
[[nodiscard]] bool MakeClip(const std::filesystem::path& frames, const std::filesystem::path& clip,
                            const std::filesystem::path& log);

}  // namespace fulcrum::supervisor
