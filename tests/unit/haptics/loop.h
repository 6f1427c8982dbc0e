// Servo, tissue and a physics that reports late, together in simulated time.
#pragma once

#include <cstdint>

#include "haptics_node/servo/servo.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics::testing {

struct Loop {
  Loop(const SceneView& scene, HapticDevice* device, const TissueParameters& parameters)
      : servo(scene, {device, nullptr}), tissue(parameters) {}

  /// Gives each tick, when all of it is done, to `each`.
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

inline constexpr auto kNothing = [](const Tick&) {};

}  // namespace fulcrum::haptics::testing
