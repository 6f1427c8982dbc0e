// A folder for files of which none may be overwritten. Internal to services/apps/replayer.
#pragma once

#include <filesystem>

#include "services/base/core/error.h"

namespace fulcrum::replay {

/// Throws InputError when the folder exists and has content.
inline void RefuseFilled(const std::filesystem::path& folder) {
  std::error_code error;
  if (std::filesystem::exists(folder) && !std::filesystem::is_empty(folder, error)) {
    throw InputError(folder.string() + ": is not empty; name a new folder");
  }
}

}  // namespace fulcrum::replay
