// Names of recordings.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::recording {

/// `file`, or if it exists `file` with "-2", "-3" … before its extension: a recording is never replaced.
[[nodiscard]] inline std::filesystem::path FreeName(const std::filesystem::path& file) {
  std::filesystem::path free = file;
  for (int number = 2; std::filesystem::exists(free); ++number) {
    free.replace_filename(file.stem().string() + "-" + std::to_string(number) + file.extension().string());
  }
  return free;
}

}  // namespace fulcrum::recording
