// Reports of a SpaceMouse, one after another, each with its length before it: axes stay within their ends, and no
// button beside its own is pressed.
#include <cmath>

#include "render_node/input/space_mouse.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

class SpaceMouse final : public Target {
 public:
  Outcome Offer(Input input) override {
    PadState state;
    bool moved = false;
    while (!input.empty()) {
      const std::size_t length = std::min<std::size_t>(input[0], input.size() - 1);
      const PadState before = state;
      render::TakeSpaceMouseReport(input.subspan(1, length), &state);
      input = input.subspan(1 + length);
      moved = moved || state.axes != before.axes || state.buttons != before.buttons;
      for (std::size_t i = 0; i < kPadAxes; ++i) {
        const bool own = i >= static_cast<std::size_t>(PadAxis::kX);
        Promise(std::abs(state.axes[i]) <= (own ? 1.0f : 0.0f), "an axis beyond its end");
      }
      const auto own = 1u << static_cast<unsigned>(PadButton::kFirst) | 1u << static_cast<unsigned>(PadButton::kSecond);
      Promise((state.buttons & ~own) == 0, "a button that it does not have");
    }
    return moved ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<Seed> Seeds() override {
    return {{"moved_and_turned", {7, 1, 100, 0, 0, 0, 0, 0, 7, 2, 0, 0, 50, 0, 0, 0}},
            {"in_one_report", {13, 1, 94, 1, 0, 0, 0, 0, 0, 0, 0, 0, 162, 254}},
            {"button", {4, 3, 1, 0, 0}}};
  }
};

}  // namespace

std::unique_ptr<Target> MakeSpaceMouse() { return std::make_unique<SpaceMouse>(); }

}  // namespace fulcrum::fuzz
