// PNG frames for the report: search, scaling, encoding for embedding.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace fulcrum::supervisor {

struct Frame {
  std::filesystem::path file;
  double time_s = 0;  ///< Session time [s].
};

/// Frames of a session in the order of time: files frame_<milliseconds>.png in `folder`; empty without that folder.
[[nodiscard]] std::vector<Frame> FindFrames(const std::filesystem::path& folder);

/// At most `count` frames, evenly spread over the time span, with the first and the last.
[[nodiscard]] std::vector<Frame> Spread(const std::vector<Frame>& frames, std::size_t count);

/// "data:image/png;base64,…" of the picture, averaged over blocks of `shrink` x `shrink` pixels. Empty when the file is
/// not a readable PNG.
[[nodiscard]] std::string EmbedPng(const std::filesystem::path& file, unsigned shrink);

[[nodiscard]] std::string Base64(std::span<const std::uint8_t> bytes);

}  // namespace fulcrum::supervisor
