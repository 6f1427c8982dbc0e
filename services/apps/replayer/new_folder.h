// A folder for files of which none may be overwritten. Internal to services/apps/replayer.
#pragma once

#include <filesystem>
#include <system_error>

#include "services/base/core/error.h"

namespace fulcrum::replay {

/// Throws InputError when the folder exists and has content, or cannot be looked into.
inline void RefuseFilled(const std::filesystem::path& folder) {
  std::error_code error;
  const bool is_there = std::filesystem::exists(folder, error);
  const bool is_filled = !error && is_there && !std::filesystem::is_empty(folder, error);
  if (error) {
    throw InputError(folder.string() + ": cannot be read (" + error.message() +
                     "); name a folder in which you may read and write");
  }
  if (is_filled) {
    throw InputError(folder.string() + ": is not empty; name a new folder");
  }
}

}  // namespace fulcrum::replay
