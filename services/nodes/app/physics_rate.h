// Rate of the cart's physics node against the step of the scene.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>

#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::app {

/// Each period of the physics node simulates one step of the scene, so the tissue moves in real time only where both
/// last equally long. Throws InputError where they do not.
inline void CheckPhysicsRate(const SceneView& scene, const config::CartConfig& cart) {
  constexpr double kRounding = 1e-3;  // Of the period: a rate of 333.3 Hz for steps of 3 ms.
  const double dt_ms = 1e3 * static_cast<double>(scene.physics.dt_s);
  const double rate_Hz = cart.timing(NodeId::kPhysics).rate_Hz;
  if (std::abs(1e-3 * dt_ms * rate_Hz - 1) <= kRounding) return;
  const auto text = [](double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.6g", value);
    return std::string(digits);
  };
  throw InputError("scene \"" + std::string(scene.name) + "\": physics.dt_ms is " + text(dt_ms) +
                   ", but the cart runs physics_node at " + text(rate_Hz) +
                   " Hz, so the tissue would not move in real time: set physics.dt_ms to " + text(1e3 / rate_Hz) +
                   " in the scene, or nodes.physics_node.rate_Hz to " + text(1e3 / dt_ms) + " in the cart file");
}

}  // namespace fulcrum::app
