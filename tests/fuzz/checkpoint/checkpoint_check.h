// Properties that must hold for any checkpoint with a valid checksum: either it is refused and the solver is unchanged,
// or it is accepted and the solver continues with values that its readers accept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "services/scene/format/scene_file.h"

namespace fulcrum::testing {

/// How a check ended.
enum class Outcome { kRefused, kTaken, kBroken };

/// Changes a payload according to `input`, a list of: place in four bytes (little endian, modulo the length), length in
/// one, bytes. A length of 255 cuts the payload off there.
void Patch(std::span<const std::uint8_t> input, std::vector<std::byte>* payload);

class CheckpointCheck {
 public:
  virtual ~CheckpointCheck() = default;
  /// Of a solver in the middle of its work.
  [[nodiscard]] const std::vector<std::byte>& good() const { return good_; }
  [[nodiscard]] virtual Outcome Offer(std::span<const std::byte> payload) = 0;

 protected:
  std::vector<std::byte> good_;
};

/// A grasper pulls at the small scene.
[[nodiscard]] std::unique_ptr<CheckpointCheck> MakePhysicsCheck();
/// A hook has cut a sheet above tissue that is warm in depth.
[[nodiscard]] std::unique_ptr<CheckpointCheck> MakeThermalCheck();

}  // namespace fulcrum::testing
