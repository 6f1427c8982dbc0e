// Servo, tissue and physics with delayed reports in closed loop, in simulated time.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "haptics_node/servo/servo.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics::testing {

struct Loop {
  Loop(const SceneView& scene, HapticDevice* device, const TissueParameters& parameters)
      : servo(ServoSettingsOf(scene), {device, nullptr}), tissue(parameters) {}

  /// Calls `each` at the end of each tick.
  template <class Each>
  void Run(int ticks, const Each& each) {
    for (int i = 0; i < ticks; ++i) {
      const Tick tick = TickAt(millisecond++);
      ContactModel model;
      if (physics.Step(tissue, tick.stamp_ns - 1'000'000, &model)) servo.OfferModel(model, tick.stamp_ns);
      servo.Step(tick);
      tissue.Step(servo.record().tool.tools[0].p_WT.cast<double>(), tick.dt_s);
      each(tick);
    }
  }

  Servo servo;
  TestTissue tissue;
  LatePhysics physics;
  std::uint64_t millisecond = 0;
};

/// A hand that moves from 10 mm above the surface to 4 mm beneath it.
inline const std::array<ScriptKey, 2> kIntoTheWall{
    {{0.0f, 0, Vec3f(0, 0, 0.01f), 0, 0, 0}, {0.8f, 0, Vec3f(0, 0, -0.004f), 0, 0, 0}}};

/// Runs this motion for three seconds; returns the peak-to-peak amplitude of `height` in the last half.
template <class Height>
double UnrestAtTheWall(Loop* loop, const Height& height) {
  double lowest = 1, highest = -1;
  loop->Run(3000, [&](const Tick& tick) {
    if (tick.session_time_s < 2.5) return;
    const double z = height(tick);
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  });
  return highest - lowest;
}

inline constexpr auto kNothing = [](const Tick&) {};

}  // namespace fulcrum::haptics::testing
