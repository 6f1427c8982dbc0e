// The payload of a checkpoint with a valid checksum: any bytes as patches over a good one (Patch).
#include "services/base/core/hash.h"
#include "tests/fuzz/checkpoint/checkpoint_check.h"
#include "tests/fuzz/scene/tiny_scene.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

/// Five times as wide as in a scene, to have few cells.
constexpr float kCell_m = 5e-4f;

constexpr std::uint64_t kContinued = 16;

class Payload final : public Target {
 public:
  explicit Payload(std::unique_ptr<testing::CheckpointCheck> check) : check_(std::move(check)) {}
  Outcome Offer(Input input) override {
    std::vector<std::byte> payload = check_->good();
    Patch(input, &payload);
    // A step takes as long as some twenty payloads, so only a part of them, selected by a hash, is continued.
    Hash64 hash;
    hash.Add(std::span<const std::byte>(payload));
    const testing::Outcome outcome = check_->Offer(payload, hash.value() % kContinued == 0 ? 1 : 0);
    Promise(outcome != testing::Outcome::kBroken, "refused and yet changed, or accepted and gone wrong");
    return outcome == testing::Outcome::kTaken ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override { return {{"unchanged", {0}}}; }

 private:
  const std::unique_ptr<testing::CheckpointCheck> check_;
};

}  // namespace

std::unique_ptr<Target> MakeCheckpointPhysics() {
  return std::make_unique<Payload>(testing::MakePhysicsCheck(TinyScene()));
}
std::unique_ptr<Target> MakeCheckpointThermal() {
  return std::make_unique<Payload>(testing::MakeThermalCheck(kCell_m));
}

}  // namespace fulcrum::fuzz
