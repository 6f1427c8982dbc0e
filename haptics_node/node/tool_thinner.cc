#include "haptics_node/node/tool_thinner.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fulcrum::haptics {
namespace {

constexpr double kShortestDt_s = 4e-3;  // Of physics: below it four samples a step are all ticks.
// The next tick is expected as long after this one as this after the last, and a little later.
constexpr double kLongestTick_s = 2e-3, kLater_s = 5e-5;
constexpr std::int64_t kHalfTick_ns = 500'000;

bool SameKind(const ToolSample& a, const ToolSample& b) {
  return a.kind == b.kind && a.state == b.state && a.buttons == b.buttons;
}

/// The same but for the age of the contact model.
bool Same(const ToolSample& a, const ToolSample& b) {
  return SameKind(a, b) && a.p_WT == b.p_WT && a.q_WT.coeffs() == b.q_WT.coeffs() && a.v_WT == b.v_WT &&
         a.w_WT == b.w_WT && a.f_W == b.f_W;
}

bool Each(const ToolState& a, const ToolState& b, bool (*alike)(const ToolSample&, const ToolSample&)) {
  return std::equal(a.tools.begin(), a.tools.end(), b.tools.begin(), alike);
}

/// Whether `m` lies on the way from `a` to `b`, at the share `u` of it.
bool Between(const ToolSample& a, const ToolSample& m, const ToolSample& b, float u) {
  const Eigen::Vector4f q_b = b.q_WT.coeffs() * (a.q_WT.dot(b.q_WT) < 0 ? -1.0f : 1.0f);
  const Eigen::Vector4f q_m = m.q_WT.coeffs() * (a.q_WT.dot(m.q_WT) < 0 ? -1.0f : 1.0f);
  const Eigen::Vector4f q = a.q_WT.coeffs() + u * (q_b - a.q_WT.coeffs());
  return (m.p_WT - a.p_WT - u * (b.p_WT - a.p_WT)).norm() < ToolThinner::kSamePlace_m &&
         2 * (q_m - q).norm() < ToolThinner::kSameTurn_rad &&
         (m.f_W - a.f_W - u * (b.f_W - a.f_W)).norm() < ToolThinner::kSameForce_N;
}

}  // namespace

bool AreAtRest(const ToolState& a, const ToolState& b) { return Each(a, b, Same); }

ToolThinner::ToolThinner(double physics_dt_s) : dt_s_(std::max(physics_dt_s, kShortestDt_s)) {}

bool ToolThinner::IsAsked(double session_time_s) {
  const double last_s = std::exchange(last_s_, session_time_s);
  const double next_s = session_time_s + std::clamp(session_time_s - last_s, 0.0, kLongestTick_s);
  const auto passes = [](double from_s, double to_s, double grid_s) {
    return std::floor(from_s / grid_s) != std::floor(to_s / grid_s);
  };
  return passes(last_s, session_time_s, 0.5 * dt_s_) || passes(session_time_s, next_s + kLater_s, dt_s_);
}

const ToolThinner::Due& ToolThinner::Add(const ToolState& tools, double session_time_s, bool calm) {
  due_.count = 0;
  const bool asked = IsAsked(session_time_s);
  if (!begun_) {
    begun_ = true;
    Publish(tools);
    return due_;
  }
  const bool rested = rested_;
  if (rested && AreAtRest(tools, published_)) {
    between_[0] = tools;
    count_ = 1;
    ++still_ticks_;
    const std::int64_t since_ns = tools.stamp.stamp_ns - published_.stamp.stamp_ns;
    if (since_ns + kHalfTick_ns >= (calm ? kLongRest_ns : kShortRest_ns)) Publish(tools);
    return due_;
  }
  still_ticks_ = 0;
  // A rest ends with its last tick, a way that is straight with the last tick that lies on it.
  const ToolState newest = count_ > 0 ? between_[count_ - 1] : published_;
  if (count_ > 0 && (rested || !Each(tools, newest, SameKind) || !Fits(tools))) Publish(newest);
  if (asked || !Each(tools, published_, SameKind) || count_ + 1 == kMostTicks) {
    Publish(tools);
  } else {
    between_[count_++] = tools;
    rested_ = false;
  }
  return due_;
}

bool ToolThinner::Fits(const ToolState& end) const {
  const auto time_s = [this](const ToolState& state) {
    return 1e-9f * static_cast<float>(state.stamp.stamp_ns - published_.stamp.stamp_ns);
  };
  return std::all_of(between_.begin(), between_.begin() + static_cast<std::ptrdiff_t>(count_), [&](const ToolState& m) {
    const float u = time_s(m) / time_s(end);
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      if (!Between(published_.tools[i], m.tools[i], end.tools[i], u)) return false;
    }
    return true;
  });
}

void ToolThinner::Publish(const ToolState& tools) {
  due_.states[due_.count++] = tools;
  published_ = tools;
  count_ = 0;
  rested_ = true;
}

}  // namespace fulcrum::haptics
