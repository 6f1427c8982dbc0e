// Any bytes as patches over contact models, which a servo in contact is offered.
#include "tests/fuzz/haptics/gate_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

using haptics::testing::GateCheck;

/// Bringing a servo into contact takes a hundred times as long as an input: one servo takes many inputs.
constexpr int kInputsPerServo = 256;
/// File that receives all inputs of a servo as one input when the last of them alone shows no fault.
constexpr const char* kHistory = "haptics_gate_history";

class HapticsGate final : public Target {
 public:
  Outcome Offer(Input input) override {
    constexpr const char* kBroken = "a force out of its limits, or a refused message that had an effect";
    if (inputs_++ % kInputsPerServo == 0) {
      check_ = std::make_unique<GateCheck>();
      history_.clear();
      Promise(haptics::testing::Press(check_.get()), kBroken);
    }
    Remember(input);
    const std::uint64_t refused = check_->refused(), offered = check_->offered();
    if (!haptics::testing::OfferPatches(input, check_.get())) {
      Promise(haptics::testing::Survives(input), kBroken);
      WriteFile(kHistory, history_);
      Promise(false, std::string(kBroken) + "; the inputs that lead there are in " + kHistory);
    }
    return check_->refused() - refused < check_->offered() - offered ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override { return {{"unchanged", {0, 0, 0}}}; }

 private:
  /// Adds the patches of an input; a truncated last patch is shortened to its bytes.
  void Remember(Input input) {
    while (input.size() >= 3) {
      const std::size_t length = std::min<std::size_t>(input[2] % 32u, input.size() - 3);
      history_.insert(history_.end(), {input[0], input[1], static_cast<std::uint8_t>(length)});
      history_.insert(history_.end(), input.begin() + 3, input.begin() + 3 + static_cast<std::ptrdiff_t>(length));
      input = input.subspan(3 + length);
    }
  }

  int inputs_ = 0;
  std::unique_ptr<GateCheck> check_;
  Bytes history_;  ///< Of the present servo.
};

}  // namespace

std::unique_ptr<Target> MakeHapticsGate() { return std::make_unique<HapticsGate>(); }

}  // namespace fulcrum::fuzz
