// The newest picture of a session, reported by inotify instead of by repeated reading of the folder.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::console {

class PictureWatch {
 public:
  PictureWatch() = default;
  /// Watches `frames`; when that folder does not exist, there is never a picture.
  explicit PictureWatch(const std::filesystem::path& frames);
  ~PictureWatch();
  PictureWatch(PictureWatch&& other) noexcept;
  PictureWatch& operator=(PictureWatch&& other) noexcept;

  /// Name of the newest picture; empty: there is none yet.
  [[nodiscard]] const std::string& Newest();
  /// Path of a picture of this session; empty when `name` is no valid name of a picture.
  [[nodiscard]] std::filesystem::path FileOf(const std::string& name) const;

 private:
  std::filesystem::path frames_;
  int notify_ = -1;
  std::string newest_;
};

}  // namespace fulcrum::console
