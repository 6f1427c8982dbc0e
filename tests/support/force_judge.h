// Limits of the force on the hand under any fault of the cart, checked for every ToolState of a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "haptics_node/kinematics/trocar.h"
#include "services/base/core/messages.h"

namespace fulcrum::testing {

class ForceJudge {
 public:
  explicit ForceJudge(const haptics::Trocar& trocar, std::size_t tool = 0) : trocar_(trocar), tool_(tool) {}

  /// Adds a sample. Samples must be in order; some may be missing. After a restart of the servo the force starts from
  /// 0, because the devices release it when the old process ends.
  void Add(const ToolState& state);

  [[nodiscard]] double force_N() const { return force_; }
  [[nodiscard]] ServoState state() const { return state_; }
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  /// Smallest and largest force since the last ResetRange() [N].
  [[nodiscard]] double least_N() const { return least_; }
  void ResetRange() { least_ = most_ = force_; }
  [[nodiscard]] double most_N() const { return most_; }
  /// Largest force, and largest change from one millisecond to the next, over all samples [N].
  [[nodiscard]] double peak_N() const { return peak_; }
  [[nodiscard]] double peak_step_N() const { return peak_step_; }
  /// First violation of the limits; empty if there is none.
  [[nodiscard]] const std::string& verdict() const { return verdict_; }

 private:
  void Object(const ToolState& state, const char* what, double value);

  haptics::Trocar trocar_;
  std::size_t tool_;
  std::uint64_t samples_ = 0;
  Stamp last_;
  Vec3d f_A_ = Vec3d::Zero();
  double force_ = 0, least_ = 0, most_ = 0, peak_ = 0, peak_step_ = 0;
  ServoState state_ = ServoState::kOff;
  struct Past {
    std::int64_t stamp_ns = 0;
    double force = 0;
  };
  std::deque<Past> rise_;        ///< The present rise, from the newest sample on that is at least a window old.
  std::int64_t held_up_ns_ = 0;  ///< Time of the last delay of the servo that exceeds kLongestTick_ns.
  std::string verdict_;
};

}  // namespace fulcrum::testing
