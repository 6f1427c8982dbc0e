// Which ticks of the servo are published as ToolState: as few as readers need that hold the last sample, interpolate
// between two, and ask for the pose at the begin of a physics step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum::haptics {

/// No tool has changed in any way that a reader can see, but for the age of its contact model.
[[nodiscard]] bool AreAtRest(const ToolState& a, const ToolState& b);

class ToolThinner {
 public:
  /// Longest time between two samples [ticks], and [ns] while nothing moves: short, and where no reader waits for one.
  static constexpr std::size_t kMostTicks = 10;
  static constexpr std::int64_t kShortRest_ns = 10'000'000, kLongRest_ns = 40'000'000;
  /// Largest errors of the tip, of the rotation and of the force, at any tick, of a reader that interpolates.
  static constexpr float kSamePlace_m = 5e-6f, kSameTurn_rad = 4e-4f, kSameForce_N = 0.01f;

  /// @param physics_dt_s period of physics, whose steps stand for whole multiples of it: moving tools are published at
  /// the ticks before and after each, and in the middle.
  explicit ToolThinner(double physics_dt_s);

  struct Due {
    std::array<ToolState, 2> states;  ///< Oldest first.
    std::size_t count = 0;
  };
  /// Adds the tools of the next tick. Returns what is to be published now. Stamps keep their time; epoch and sequence
  /// are the publisher's.
  /// @param calm no tool is near tissue: tools at rest are published each kLongRest_ns.
  const Due& Add(const ToolState& tools, double session_time_s, bool calm);
  /// Newest ticks in which nothing has changed.
  [[nodiscard]] std::size_t still_ticks() const { return still_ticks_; }
  /// Stamp of the newest published state [ns].
  [[nodiscard]] std::int64_t published_ns() const { return published_.stamp.stamp_ns; }

 private:
  [[nodiscard]] bool IsAsked(double session_time_s);
  [[nodiscard]] bool Fits(const ToolState& end) const;
  void Publish(const ToolState& tools);

  double dt_s_;
  double last_s_ = 0;   ///< Session time of the newest tick.
  bool begun_ = false;  ///< A state has been published.
  ToolState published_;
  std::array<ToolState, kMostTicks> between_;  ///< Of the ticks since, oldest first; at rest the newest alone.
  std::size_t count_ = 0;                      ///< Of these.
  bool rested_ = true;                         ///< All ticks since are like the published one.
  std::size_t still_ticks_ = 0;
  Due due_;
};

}  // namespace fulcrum::haptics
