#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <span>

#include "render_node/input/space_mouse.h"

namespace fulcrum::render {
namespace {

float AxisOf(const PadState& state, PadAxis axis) { return state.axes[static_cast<std::size_t>(axis)]; }

TEST(SpaceMouseReport, NewerModelsSendSixAxesAtOnce) {
  PadState state;
  const std::array<std::uint8_t, 13> report{1, 0, 0, 0, 0, 0, 0, 0xa2, 0xfe, 0, 0, 0xaf, 0};  // turns -350, 0, 175
  TakeSpaceMouseReport(report, &state);
  EXPECT_NEAR(AxisOf(state, PadAxis::kTurnX), -1, 1e-6f);
  EXPECT_NEAR(AxisOf(state, PadAxis::kTurnY), -0.5f, 1e-6f);
  EXPECT_EQ(AxisOf(state, PadAxis::kX), 0);
}

TEST(SpaceMouseReport, ShortAndForeignReportsHaveNoEffect) {
  PadState state;
  for (int kind = 0; kind < 256; ++kind) {
    for (std::size_t size = 0; size <= 6; ++size) {
      if (kind == 3 && size >= 2) continue;
      std::array<std::uint8_t, 6> report;
      report.fill(0xff);
      report[0] = static_cast<std::uint8_t>(kind);
      TakeSpaceMouseReport(std::span(report).first(size), &state);
    }
  }
  EXPECT_EQ(state.buttons, 0u);
  for (const float axis : state.axes) EXPECT_EQ(axis, 0);
}

TEST(SpaceMouseReport, AnyBytesGiveDeflectionsWithinTheWayAndTwoButtons) {
  std::mt19937 random(1);
  PadState state;
  constexpr std::uint32_t kBoth = 3u << static_cast<unsigned>(PadButton::kFirst);
  for (int i = 0; i < 200'000; ++i) {
    std::array<std::uint8_t, 16> report{};
    for (std::uint8_t& byte : report) byte = static_cast<std::uint8_t>(random());
    report[0] = static_cast<std::uint8_t>(random() % 5);
    TakeSpaceMouseReport(std::span(report).first(random() % (report.size() + 1)), &state);
    for (const float axis : state.axes) ASSERT_LE(std::abs(axis), 1);
    ASSERT_EQ(state.buttons & ~kBoth, 0u);
  }
}

}  // namespace
}  // namespace fulcrum::render
