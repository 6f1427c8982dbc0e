// What the tools do to the tissue: force over time, grasps that slip, what is lifted.
#pragma once

#include <array>

#include "services/base/core/assessment.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::assessment {

struct ToolForce {
  double force_time_Ns = 0;
  double peak_N = 0;
  double force_N = 0;  ///< Now.
  int slips = 0;
  double lift_m = 0;       ///< Highest that a hold has been raised above where it began, along +z.
  double lift_hold_s = 0;  ///< Longest time without a break at the lift asked for or above, within the force.
};

/// Fed with each ContactModel in order: it tells the tissue's force on the tool, what a grasp can hold, and where it
/// is.
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
    bool closed = false;    ///< The jaws, and not on their way to open, when last heard.
    float grip_N = 0;       ///< What they held then.
    bool slipping = false;  ///< The traction is more than they hold.
    float begin_z = 0;
    double held_s = 0;  ///< At height, so far.
  };
  /// True when a slip begins.
  bool FollowHold(const DeviceContacts& contacts, double force_N, double dt_s, Hold* hold, ToolForce* tool) const;

  AssessmentParams params_;
  float closed_grip_N_;
  std::array<Hold, kMaxTools> holds_;
  std::array<ToolForce, kMaxTools> tools_;
  std::uint64_t epoch_ = 0;
  double last_s_ = -1;
};

}  // namespace fulcrum::assessment
