// What every way of replaying asks of cart and session.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "services/config/cart.h"
#include "services/core/error.h"
#include "services/core/messages.h"
#include "services/core/scene_view.h"

namespace fulcrum::replay {

/// Nominal period by node [s], in whole nanoseconds, as the cyclic thread counts.
[[nodiscard]] inline std::array<double, kNodeCount> NodePeriods(const config::CartConfig& cart) {
  std::array<double, kNodeCount> period_s{};
  for (const NodeId node : {NodeId::kHandleBridge, NodeId::kHaptics, NodeId::kPhysics, NodeId::kThermal}) {
    period_s[static_cast<std::size_t>(node)] = 1e-9 * std::round(1e9 / cart.timing(node).rate_Hz);
  }
  return period_s;
}

/// Throws MismatchError when the session that was recorded is of another scene.
inline void RefuseOtherScene(const std::filesystem::path& recording, const std::optional<SceneManifest>& session,
                             const SceneView& scene) {
  if (!session || session->scene_hash == scene.hash) return;
  throw MismatchError(recording.string() + " was recorded with another scene (\"" + session->scene_name +
                      "\"): give the compiled scene of that session with --scene");
}

}  // namespace fulcrum::replay
