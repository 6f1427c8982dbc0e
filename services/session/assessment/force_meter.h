// Mechanical load of the tissue by the tools: force over time, slips of the grasp, height of a lift.
#pragma once

#include <array>

#include "services/base/core/assessment.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::assessment {

struct ToolForce {
  double force_time_Ns = 0;
  double peak_N = 0;
  double force_N = 0;  ///< Present force.
  int slips = 0;
  double lift_m = 0;       ///< Largest rise of a hold above its first place, along +z.
  double lift_hold_s = 0;  ///< Longest uninterrupted time at the demanded lift or above, within the force limit.
};

/// Takes each ContactModel in order, which contains the tissue's force on the tool, the grip force and the place of a
/// grasp.
class ForceMeter {
 public:
  ForceMeter(const AssessmentParams& params, const PhysicsParams& physics);

  struct Finding {
    bool too_high = false, slips = false;
  };
  Finding Add(double time_s, const ContactModel& model);

  [[nodiscard]] const ToolForce& tool(int i) const { return tools_[static_cast<std::size_t>(i)]; }

 private:
  struct Hold {
    bool holding = false;
    bool closed = false;    ///< In the last message the jaws were closed and not opening.
    float grip_N = 0;       ///< Grip force in the last message.
    bool slipping = false;  ///< The traction exceeds the grip force.
    float begin_z = 0;
    double held_s = 0;         ///< Present uninterrupted time at the demanded lift.
    double kept_until_s = -1;  ///< After a break: until this time a message without a grasp does not end the hold.
  };
  /// Updates a hold; true when a slip begins.
  bool FollowHold(const DeviceContacts& contacts, double force_N, double time_s, double dt_s, Hold* hold,
                  ToolForce* tool) const;

  AssessmentParams params_;
  float closed_grip_N_;
  std::array<Hold, kMaxTools> holds_;
  std::array<ToolForce, kMaxTools> tools_;
  std::uint64_t epoch_ = 0;
  double last_s_ = -1;
};

}  // namespace fulcrum::assessment
