// The session's pictures as a video.
#pragma once

#include <filesystem>

namespace fulcrum::supervisor {

/// Encodes the pictures in `frames` as `clip` (MP4, at the speed of the session) with the program `ffmpeg`, whose
/// output goes to `log`. False, and no clip, when `ffmpeg` is not installed, fails or takes longer than a minute, or
/// when there are fewer than two pictures.
[[nodiscard]] bool MakeClip(const std::filesystem::path& frames, const std::filesystem::path& clip,
                            const std::filesystem::path& log);

}  // namespace fulcrum::supervisor
