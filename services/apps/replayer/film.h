// A recorded session as a film: the picture of any time, drawn when it is asked for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <memory>
#include <span>

#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

class Film {
 public:
  /// `scene` must outlive it. Throws InputError, MismatchError, and std::runtime_error when OpenGL is missing.
  Film(const std::filesystem::path& recording, const SceneView& scene);
  ~Film();
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  /// Session time of the last message [s].
  [[nodiscard]] double end_s() const;

  /// Picture of a session time as a JPEG file; empty: that of the call before still holds. Valid until the next call. A
  /// time before that of the last call begins again at the start of the recording, which takes longer.
  [[nodiscard]] std::span<const std::uint8_t> At(double time_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Shows a recording to a program. Writes "end TIME" and then, for each line with a session time [s] on `in`,
/// "TIME BYTES" and a JPEG file of BYTES bytes (0: the picture has not changed). Returns at the end of `in`. Throws
/// InputError for a line that is no time, and what Film throws.
void ShowFilm(const std::filesystem::path& recording, const SceneView& scene, std::istream& in, std::ostream& out);

}  // namespace fulcrum::replay
