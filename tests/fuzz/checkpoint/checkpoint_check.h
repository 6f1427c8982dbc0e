// Properties that must hold for any checkpoint with a valid checksum: either it is refused and the solver is unchanged,
// or it is accepted and the solver continues with values that its readers accept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::testing {

/// Result of a check.
enum class Outcome { kRefused, kTaken, kBroken };

class CheckpointCheck {
 public:
  virtual ~CheckpointCheck() = default;
  /// A valid checkpoint of a solver during its work.
  [[nodiscard]] const std::vector<std::byte>& good() const { return good_; }
  /// @param steps steps of the solver after an accepted payload.
  [[nodiscard]] virtual Outcome Offer(std::span<const std::byte> payload, int steps = 4) = 0;

 protected:
  std::vector<std::byte> good_;
};

/// A grasper pulls at a procedural scene.
[[nodiscard]] std::unique_ptr<CheckpointCheck> MakePhysicsCheck(const scene::SceneSettings& scene = scene::Small());
/// A hook has cut a sheet above tissue that is warm in depth.
[[nodiscard]] std::unique_ptr<CheckpointCheck> MakeThermalCheck(float cell_m = 1e-4f);
/// A hook has burnt the surface of a solid.
[[nodiscard]] std::unique_ptr<CheckpointCheck> MakeSolidCheck();

}  // namespace fulcrum::testing
