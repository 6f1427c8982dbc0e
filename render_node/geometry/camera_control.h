// Keyboard control of the laparoscope. Pure.
#pragma once

#include <optional>
#include <string_view>

#include "services/base/core/scope.h"

namespace fulcrum::render {

enum class CameraKey { kLeft, kRight, kUp, kDown, kNearer, kFarther, kRollLeft, kRollRight, kReset };

class CameraControl {
 public:
  explicit CameraControl(const RenderParams& scene) : scene_(scene), now_(scene) {}

  /// Turns the tip about the target by 3 degrees, moves it by a twentieth of the distance, or rolls the horizon by 5
  /// degrees.
  void Press(CameraKey key);
  /// The picture is that of a held scope: keys have no effect from then on. @param sight line of sight from `eye` [m].
  void Hold(const Vec3f& eye, const Sight& sight, float zoom);
  [[nodiscard]] bool held() const { return held_; }
  /// Moves the camera's target to this point [m]; without a call the target stays.
  void Follow(const Vec3f& p_W);
  [[nodiscard]] const RenderParams& params() const { return now_; }

 private:
  RenderParams scene_;
  RenderParams now_;
  bool held_ = false;
};

}  // namespace fulcrum::render
