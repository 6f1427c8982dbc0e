// The newest picture of a session, told by the kernel instead of by reading the folder again and again.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::console {

class PictureWatch {
 public:
  PictureWatch() = default;
  /// Watches `frames`, which need not be there: then there is never a picture.
  explicit PictureWatch(const std::filesystem::path& frames);
  ~PictureWatch();
  PictureWatch(PictureWatch&& other) noexcept;
  PictureWatch& operator=(PictureWatch&& other) noexcept;

  /// Name of the newest picture; empty: none yet.
  [[nodiscard]] const std::string& Newest();
  /// The file of a picture of this session; empty when `name` is not the name of one.
  [[nodiscard]] std::filesystem::path FileOf(const std::string& name) const;

 private:
  std::filesystem::path frames_;
  int notify_ = -1;
  std::string newest_;
};

}  // namespace fulcrum::console
