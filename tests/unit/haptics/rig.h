// A servo without a device: one tool straight down through its trocar, time in exact milliseconds.
#pragma once

#include <functional>
#include <utility>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/servo/servo.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::haptics::testing {

/// A device whose position is a function of session time, independent of the force.
class GuidedDevice final : public HapticDevice {
 public:
  GuidedDevice(const Trocar& trocar, std::function<Vec3d(double)> tip) : trocar_(trocar), tip_(std::move(tip)) {}
  [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override {
    return AttachPointForTip(trocar_, tip_(tick.session_time_s));
  }
  void WriteForce(const Vec3d& f_W) noexcept override { force = f_W; }

  Vec3d force = Vec3d::Zero();

 private:
  Trocar trocar_;
  std::function<Vec3d(double)> tip_;
};

/// Tool 0: grasper, pivot 200 mm above the origin, shaft 400 mm: straight down on the origin the lever is 1.
inline SceneView BenchScene(double force_scale) {
  SceneView scene;
  scene.haptics.force_scale = static_cast<float>(force_scale);
  scene.tools[0].kind = ToolKind::kGrasper;
  scene.tools[0].p_WP = Vec3f(0, 0, 0.2f);
  scene.tools[0].shaft_length_m = 0.4f;
  return scene;
}
inline Trocar BenchTrocar() {
  const SceneView scene = BenchScene(1);
  return {scene.tools[0].p_WP.cast<double>(), scene.tools[0].shaft_length_m};
}

/// Session time starts at 0 on the first tick; the clock at one second.
inline Tick TickAt(std::uint64_t millisecond) {
  Tick tick;
  tick.index = millisecond;
  tick.dt_s = 1e-3;
  tick.session_time_s = 1e-3 * static_cast<double>(millisecond);
  tick.stamp_ns = 1'000'000'000 + static_cast<std::int64_t>(millisecond) * 1'000'000;
  return tick;
}

/// Published force on tool 0, at the tip [N].
inline Vec3d SentForce(const Servo& servo) { return servo.record().tool.tools[0].f_W.cast<double>(); }

}  // namespace fulcrum::haptics::testing
