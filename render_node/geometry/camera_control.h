// Keyboard control of the laparoscope. Pure.
#pragma once

#include <optional>
#include <string_view>

#include "services/base/core/scope.h"

namespace fulcrum::render {

/// Roll [degrees] of `moved`, which looks from where `before` looked with its line of sight turned by `turn`, so that
/// the picture has turned with it. It is the roll of `before` unless "up" of a level picture is another one for the new
/// line of sight (LevelUp): that changes by up to 90 degrees where the line of sight becomes steep.
[[nodiscard]] float CarriedRoll_deg(const RenderParams& before, const RenderParams& moved, const Quatf& turn);

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
