// Buttons of haptic devices as jaws and pedals, and in place of lines that are not there.
#include "handle_bridge/node/button_hands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/protocol/pedal_line.h"
#include "handle_bridge/simulation/jaw_firmware.h"
#include "services/transport/bus/in_process.h"
#include "tests/unit/handle/memory_link.h"

namespace fulcrum::handle_bridge {
namespace {

/// A node whose tools 0 and 1 are Touch devices; times are those of the ticks.
class ButtonTest : public ::testing::Test {
 protected:
  void Make(config::LinkKind handle, config::LinkKind pedal) {
    for (std::size_t tool = 0; tool < 2; ++tool) {
      cart_.devices[tool].kind = config::DeviceKind::kTouch;
      cart_.handles[tool].kind = handle;
    }
    cart_.pedal.kind = pedal;
    HandleBridgeNode::Links links;
    const auto link = [](MemoryLink** memory) {
      auto made = std::make_unique<MemoryLink>();
      *memory = made.get();
      return std::make_unique<WatchedLink>(std::move(made), 115200);
    };
    if (handle == config::LinkKind::kSerial) links.handles[0] = link(&line_);
    if (pedal == config::LinkKind::kSerial) links.pedal = link(&pedal_);
    ASSERT_TRUE(NeedsButtons(cart_));
    node_ =
        std::make_unique<HandleBridgeNode>(cart_, CalibrationStore(), std::move(links), output_.get(), 1, tools_.get());
  }
  /// Periods of 2.5 ms; `buttons` of both tools, or no ToolState.
  void Run(int periods, std::optional<std::array<std::uint8_t, 2>> buttons) {
    for (int i = 0; i < periods; ++i) {
      Tick tick;
      tick.index = index_++;
      tick.dt_s = 0.0025;
      tick.stamp_ns = 1'000'000'000 + static_cast<std::int64_t>(index_) * 2'500'000;
      if (buttons) {
        ToolState state;
        state.stamp = {index_, 1, tick.stamp_ns};
        for (std::size_t tool = 0; tool < 2; ++tool) state.tools[tool].buttons = (*buttons)[tool];
        tool_states_->Write(state);
      }
      node_->Step(tick);
      const float before = state_.handles[0].jaw_angle_rad;
      (void)input_->TakeLatest(&state_);
      if (i > 0 || steps_ > 0)
        fastest_ = std::max(fastest_, std::abs(state_.handles[0].jaw_angle_rad - before) / 0.0025f);
      ++steps_;
    }
  }
  std::string Error() const {
    Health health;
    node_->FillHealth(&health);
    return health.last_error;
  }

  config::CartConfig cart_;
  bus::InProcessTopic<HandleState> topic_;
  bus::InProcessTopic<ToolState> tool_topic_;
  std::unique_ptr<bus::Input<HandleState>> input_ = topic_.MakeInput();
  std::unique_ptr<bus::Output<HandleState>> output_ = topic_.MakeOutput();
  std::unique_ptr<bus::Input<ToolState>> tools_ = tool_topic_.MakeInput();
  std::unique_ptr<bus::Output<ToolState>> tool_states_ = tool_topic_.MakeOutput();
  std::unique_ptr<HandleBridgeNode> node_;
  MemoryLink *line_ = nullptr, *pedal_ = nullptr;
  JawFirmware firmware_{{}, 5};
  std::uint64_t index_ = 0;
  HandleState state_;
  float fastest_ = 0;
  int steps_ = 0;
};

TEST_F(ButtonTest, CloseJawsAndPressPedals) {
  Make(config::LinkKind::kButtons, config::LinkKind::kButtons);
  Run(100, std::array<std::uint8_t, 2>{0, 0});
  EXPECT_TRUE(state_.handles[0].present);
  EXPECT_NEAR(state_.handles[0].jaw_angle_rad, 0.7f, 1e-4f);
  EXPECT_EQ(state_.pedals, kPedalNone);
  Run(20, std::array<std::uint8_t, 2>{1, 0});
  EXPECT_GT(state_.handles[0].jaw_angle_rad, 0.4f) << "at a finite rate";
  Run(60, std::array<std::uint8_t, 2>{1, 2});
  EXPECT_EQ(state_.handles[0].jaw_angle_rad, 0);
  EXPECT_NEAR(state_.handles[1].jaw_angle_rad, 0.7f, 1e-4f);
  EXPECT_EQ(state_.pedals, kPedalCut);
  Run(1, std::array<std::uint8_t, 2>{3, 0});
  EXPECT_EQ(state_.pedals, kPedalCoag);
  EXPECT_LT(fastest_, 5);
  EXPECT_EQ(Error(), "");
}

TEST_F(ButtonTest, ASilentServoLiftsThePedalsAndLetsNothingGo) {
  Make(config::LinkKind::kButtons, config::LinkKind::kButtons);
  Run(200, std::array<std::uint8_t, 2>{1, 2});
  ASSERT_EQ(state_.pedals, kPedalCut);
  Run(39, std::nullopt);
  EXPECT_EQ(state_.pedals, kPedalCut) << "97 ms";
  Run(2, std::nullopt);
  EXPECT_EQ(state_.pedals, kPedalNone) << "102 ms";
  Run(400, std::nullopt);
  EXPECT_EQ(state_.handles[0].jaw_angle_rad, 0) << "what the jaw holds is kept";
  EXPECT_EQ(state_.handles[0].quality, 0);
}

TEST_F(ButtonTest, StandInForAHandleThatIsNotThere) {
  Make(config::LinkKind::kSerial, config::LinkKind::kSerial);
  line_->phase = pedal_->phase = LinkPhase::kReconnecting;
  Run(200, std::array<std::uint8_t, 2>{1, 2});
  EXPECT_EQ(state_.handles[0].jaw_angle_rad, 0);
  EXPECT_EQ(state_.pedals, kPedalCut);
  EXPECT_NE(Error().find("; meanwhile button 1 of its haptic device closes the jaw"), std::string::npos) << Error();
  EXPECT_NE(Error().find("; meanwhile buttons of the haptic devices are the pedals"), std::string::npos) << Error();
  // Both are plugged in: the handle at 40 degrees, the pedal up.
  line_->phase = pedal_->phase = LinkPhase::kOpen;
  line_->fresh = pedal_->fresh = true;
  fastest_ = 0;
  for (int i = 0; i < 1200; ++i) {
    const auto text = firmware_.Line(40);
    line_->bytes.append(text.data(), text.size());
    const auto pedal = FormatPedals(kPedalNone);
    pedal_->bytes.append(pedal.data(), pedal.size());
    Run(1, std::array<std::uint8_t, 2>{1, 2});
  }
  EXPECT_NEAR(state_.handles[0].jaw_angle_rad, 0.698f, 0.03f) << "the handle's, though the button is held";
  EXPECT_EQ(state_.pedals, kPedalNone);
  EXPECT_LT(fastest_, 5) << "no jump of the jaw";
  EXPECT_EQ(Error(), "");
}

TEST_F(ButtonTest, GiveWayToLinesAtAnotherSpeedThanTheCarts) {
  Make(config::LinkKind::kSerial, config::LinkKind::kSerial);
  for (int i = 0; i < 800; ++i) {
    if (line_->baud == 57600) {
      const auto text = firmware_.Line(20);
      line_->bytes.append(text.data(), text.size());
    } else {
      line_->bytes.append("\xf8\x80\x78\xf8\x78\x80");
    }
    if (pedal_->baud == 57600) {
      const auto pedal = FormatPedals(kPedalCut);
      pedal_->bytes.append(pedal.data(), pedal.size());
    } else {
      pedal_->bytes.append("\xf8\x80\x78\xf8\x78\x80");
    }
    Run(1, std::array<std::uint8_t, 2>{1, 0});
  }
  EXPECT_EQ(Error().rfind("handle 0: wrong-baud", 0), 0u) << Error();
  EXPECT_NE(Error().find("pedal: wrong-baud"), std::string::npos) << Error();
  EXPECT_EQ(Error().find("meanwhile"), std::string::npos) << Error();
  EXPECT_EQ(state_.pedals, kPedalCut);
  EXPECT_NEAR(state_.handles[0].jaw_angle_rad, 0.349f, 0.03f) << "the handle's, though the button is held";
}

}  // namespace
}  // namespace fulcrum::handle_bridge
