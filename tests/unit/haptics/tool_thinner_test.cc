#include "haptics_node/node/tool_thinner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/unit/haptics/rig.h"

namespace fulcrum::haptics {
namespace {

using testing::TickAt;

constexpr double kDt_s = 0.01;

struct Thinned {
  std::vector<ToolState> ticks, published;

  Thinned(int count, const std::function<void(double, ToolSample*)>& move, bool calm = false) {
    ToolThinner thinner(kDt_s);
    for (int i = 0; i < count; ++i) {
      const Tick tick = TickAt(static_cast<std::uint64_t>(i));
      ToolState state;
      state.stamp.stamp_ns = tick.stamp_ns;
      state.tools[0].kind = ToolKind::kGrasper;
      move(tick.session_time_s, &state.tools[0]);
      ticks.push_back(state);
      const ToolThinner::Due& due = thinner.Add(state, tick.session_time_s, calm);
      for (std::size_t k = 0; k < due.count; ++k) published.push_back(due.states[k]);
    }
  }

  /// Largest distance of a tick's tip from that between the samples around it [m].
  [[nodiscard]] float PlaceError() const {
    return Worst([](const ToolSample& tool) { return tool.p_WT; });
  }
  [[nodiscard]] float ForceError() const {
    return Worst([](const ToolSample& tool) { return tool.f_W; });
  }

 private:
  template <class Value>
  [[nodiscard]] float Worst(const Value& value) const {
    float worst = 0;
    std::size_t k = 0;
    for (const ToolState& tick : ticks) {
      while (k + 1 < published.size() && published[k + 1].stamp.stamp_ns <= tick.stamp.stamp_ns) ++k;
      const ToolState &a = published[k], &b = published[std::min(k + 1, published.size() - 1)];
      const auto way = static_cast<float>(b.stamp.stamp_ns - a.stamp.stamp_ns);
      const float u = way > 0 ? static_cast<float>(tick.stamp.stamp_ns - a.stamp.stamp_ns) / way : 0;
      if (&a == &published.back()) break;  // What follows is not published yet.
      const Vec3f between = value(a.tools[0]) + u * (value(b.tools[0]) - value(a.tools[0]));
      worst = std::max(worst, (value(tick.tools[0]) - between).norm());
    }
    return worst;
  }
};

TEST(ToolThinner, AToolAtRestIsPublishedEachTenthTickAndTheLastOneBeforeItMoves) {
  const Thinned thinned(1000, [](double time_s, ToolSample* tool) {
    tool->p_WT.x() = time_s < 0.5 ? 0 : 0.05f * static_cast<float>(time_s - 0.5);
  });
  const auto moves =
      std::ranges::find_if(thinned.published, [](const ToolState& s) { return s.tools[0].p_WT.x() > 0; });
  ASSERT_NE(moves, thinned.published.end());
  EXPECT_NEAR(static_cast<double>(std::distance(thinned.published.begin(), moves)), 51, 2);
  EXPECT_LE(thinned.PlaceError(), ToolThinner::kSamePlace_m);
}

TEST(ToolThinner, FarFromTissueAToolAtRestIsPublishedEach40MsAndItsFirstMotionAtOnce) {
  const auto move = [](double time_s, ToolSample* tool) {
    tool->p_WT.x() = time_s < 0.5 ? 0 : 0.05f * static_cast<float>(time_s - 0.5);
  };
  const Thinned calm(1000, move, true), near(1000, move, false);
  const auto first_moved = [](const Thinned& thinned) {
    return std::ranges::find_if(thinned.published, [](const ToolState& s) { return s.tools[0].p_WT.x() > 0; });
  };
  const auto moves = first_moved(calm);
  ASSERT_NE(moves, calm.published.end());
  EXPECT_NEAR(static_cast<double>(std::distance(calm.published.begin(), moves)), 13.5, 2);
  EXPECT_EQ(moves->stamp.stamp_ns, first_moved(near)->stamp.stamp_ns);
  EXPECT_EQ(moves->stamp.stamp_ns - std::prev(moves)->stamp.stamp_ns,
            first_moved(near)->stamp.stamp_ns - std::prev(first_moved(near))->stamp.stamp_ns);
  EXPECT_LE(calm.PlaceError(), ToolThinner::kSamePlace_m);
}

TEST(ToolThinner, BetweenTheSamplesEachTickIsWhereAReaderInterpolates) {
  // A hand that swings by 2 cm at 1.5 Hz and trembles by 0.1 mm at 10 Hz, with a force that touches down each second.
  const auto move = [](double time_s, ToolSample* tool) {
    const auto x = 0.02 * std::sin(2 * M_PI * 1.5 * time_s) + 1e-4 * std::sin(2 * M_PI * 10 * time_s);
    tool->p_WT = Vec3f(static_cast<float>(x), 0, 0);
    tool->q_WT = Quatf(Eigen::AngleAxisf(static_cast<float>(5 * x), Vec3f::UnitY()));
    tool->f_W.z() = std::fmod(time_s, 1) > 0.5 ? static_cast<float>(0.5 + 20 * x) : 0;
  };
  const Thinned thinned(5000, move);
  EXPECT_LE(thinned.PlaceError(), ToolThinner::kSamePlace_m);
  EXPECT_LE(thinned.ForceError(), ToolThinner::kSameForce_N);
  EXPECT_LT(thinned.published.size(), 2000u) << "of 5,000 ticks";
  EXPECT_TRUE(std::ranges::is_sorted(thinned.published, {}, [](const ToolState& s) { return s.stamp.stamp_ns; }));
}

TEST(ToolThinner, AStepOfPhysicsFindsTheTicksAroundItsTime) {
  const Thinned thinned(1000,
                        [](double time_s, ToolSample* tool) { tool->p_WT.x() = 0.1f * static_cast<float>(time_s); });
  for (double step_s = 2 * kDt_s; step_s < 0.98; step_s += kDt_s) {
    const std::int64_t ns = TickAt(0).stamp_ns + std::llround(1e9 * (step_s - TickAt(0).session_time_s));
    const auto after =
        std::ranges::lower_bound(thinned.published, ns, {}, [](const ToolState& s) { return s.stamp.stamp_ns; });
    ASSERT_NE(after, thinned.published.end());
    EXPECT_LT(after->stamp.stamp_ns - ns, 1'000'000);
    EXPECT_LE(ns - std::prev(after)->stamp.stamp_ns, 1'000'000);
  }
  EXPECT_LT(thinned.published.size(), 400u);
}

TEST(ToolThinner, APressedButtonAndAnotherStateComeAtOnce) {
  const Thinned thinned(1000, [](double time_s, ToolSample* tool) {
    tool->buttons = time_s >= 0.3333 ? 1 : 0;
    tool->state = time_s >= 0.6667 ? ServoState::kHold : ServoState::kNormal;
  });
  const auto first = [&](auto holds) {
    const auto of = [&](const std::vector<ToolState>& states) {
      return std::ranges::find_if(states, [&](const ToolState& s) { return holds(s.tools[0]); })->stamp.stamp_ns;
    };
    return of(thinned.published) - of(thinned.ticks);
  };
  EXPECT_EQ(first([](const ToolSample& tool) { return tool.buttons == 1; }), 0);
  EXPECT_EQ(first([](const ToolSample& tool) { return tool.state == ServoState::kHold; }), 0);
}

}  // namespace
}  // namespace fulcrum::haptics
