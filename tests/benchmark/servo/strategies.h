// Methods to compute a 1 kHz force from 100 Hz physics: this servo, and the methods it is compared with. The latter are
// linked into the benchmark only.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "tests/benchmark/servo/motions.h"

namespace fulcrum::haptics {

struct NamedStrategy {
  const char* name;
  const char* colour;  ///< In plots.
  std::function<std::unique_ptr<ForceStrategy>()> make;
};

/// The whole Servo: Zener local model, replay, correction, coupling, age machine, passivity, output chain.
[[nodiscard]] std::unique_ptr<ForceStrategy> MakeServo();
/// The paper: depth x normal of each physics step, held until the next. Depth is given the stiffness at which it is the
/// true pressure, so the remaining errors are the delay, the steps and the missing friction.
[[nodiscard]] std::unique_ptr<ForceStrategy> MakeHeldForce();

/// Held force, ZOH mesh, god-object, extrapolated mesh, linear local model, this servo: in this order.
[[nodiscard]] std::vector<NamedStrategy> Strategies();

}  // namespace fulcrum::haptics
