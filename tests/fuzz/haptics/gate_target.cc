// Any bytes as patches over contact models, which a servo in contact is offered.
#include "tests/fuzz/haptics/gate_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class HapticsGate final : public Target {
 public:
  Outcome Offer(Input input) override {
    Promise(haptics::testing::Survives(input), "a force out of its limits, or a refused message that had an effect");
    return Outcome::kAccepted;
  }
  std::vector<Seed> Seeds() override { return {{"unchanged", {0}}}; }
};

}  // namespace

std::unique_ptr<Target> MakeHapticsGate() { return std::make_unique<HapticsGate>(); }

}  // namespace fulcrum::fuzz
