// A folder for the files of one run. Internal to services/apps/replayer.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "services/base/core/error.h"

namespace fulcrum::replay {

/// A new, empty folder for temporary files, which is removed with its content at the end of the scope.
class ScratchFolder {
 public:
  /// Makes the folder. Throws InputError when that fails.
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "fulcrum-replay-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw InputError("cannot make a folder " + name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace fulcrum::replay
