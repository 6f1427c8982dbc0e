// When contacts are published while nothing changes.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum::physics {

/// While the tissue sleeps and tools neither move nor are near it, contacts say the same in each tick. They are then
/// published with each new ToolState, whose time dates a ContactModel, and at least each tenth tick. The first change
/// is published in its own tick.
class ContactRest {
 public:
  /// Notes the samples around the time of a tick: whether a tool moves.
  void Follow(const ToolState& before, const ToolState& after);
  /// Decides for this tick, after Follow().
  /// @param calm the tissue sleeps and no tool is near it.
  void Decide(bool calm, std::uint64_t tick_index);
  /// False: readers know already what this tick would tell them.
  [[nodiscard]] bool due() const { return due_; }

 private:
  /// Ticks that are published after the last change, so that a lost sample is repeated, and longest silence after them.
  static constexpr std::uint64_t kRepeats = 10, kLongestSilence = 10;

  ToolState last_;
  bool moves_ = true;  ///< In this tick.
  bool fresh_ = true;  ///< `before` is another sample than in the last tick.
  std::uint64_t calm_ticks_ = 0, due_index_ = 0;
  bool due_ = true;
};

}  // namespace fulcrum::physics
