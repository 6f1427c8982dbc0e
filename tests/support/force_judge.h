// What the hand may feel, whatever happens to the rest of the cart: judged on every ToolState of a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "haptics_node/kinematics/trocar.h"
#include "services/base/core/messages.h"

namespace fulcrum::testing {

class ForceJudge {
 public:
  explicit ForceJudge(const haptics::Trocar& trocar, std::size_t tool = 0) : trocar_(trocar), tool_(tool) {}

  /// Samples in order; some may be missing. A new servo begins without force: the devices let go when the old one
  /// ended.
  void Add(const ToolState& state);

  [[nodiscard]] double force_N() const { return force_; }
  [[nodiscard]] ServoState state() const { return state_; }
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  /// Least and most force since the last ResetRange() [N].
  [[nodiscard]] double least_N() const { return least_; }
  void ResetRange() { least_ = most_ = force_; }
  [[nodiscard]] double most_N() const { return most_; }
  /// Over all samples: force [N], and the largest change from one millisecond to the next [N].
  [[nodiscard]] double peak_N() const { return peak_; }
  [[nodiscard]] double peak_step_N() const { return peak_step_; }
  /// Empty, or the first thing that the hand should not have felt.
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
  // Where the present rise was a few ticks ago.
  static constexpr std::uint64_t kWindow = 5;
  struct Past {
    std::uint64_t sequence = 0;
    double force = 0;
    bool rising = false;
  };
  Past past_[kWindow];
  std::int64_t held_up_ns_ = 0;  ///< When the servo last came late by more than it makes good.
  std::string verdict_;
};

}  // namespace fulcrum::testing
