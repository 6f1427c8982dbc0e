#include "services/session/assessment/force_meter.h"

#include <algorithm>

#include "services/base/core/contact_force.h"
#include "services/session/assessment/gap.h"

namespace fulcrum::assessment {
namespace {

/// A slip ends when the traction has fallen to this share of the grip force.
constexpr double kHeldAgain = 0.9;
/// When jaws open, the grip force falls below this share of its previous value from one message to the next; the noise
/// of a handle is a third of that step.
constexpr float kSteadyGrip = 0.985f;
/// Longest time in which a restarted physics_node publishes contacts before it has restored its grasps [s].
constexpr double kRestored_s = 0.5;

const Contact* GraspOf(const DeviceContacts& contacts) {
  const auto end = contacts.contacts.begin() + std::min<std::uint32_t>(contacts.count, kMaxContacts);
  const auto* grasp = std::find_if(contacts.contacts.begin(), end,
                                   [](const Contact& contact) { return contact.kind == ContactKind::kGrasp; });
  return grasp == end ? nullptr : grasp;
}

}  // namespace

ForceMeter::ForceMeter(const AssessmentParams& params, const PhysicsParams& physics)
    : params_(params),
      // Grip force of jaws at the angle of closing; a smaller one means that they are opening.
      closed_grip_N_(physics.grip_force_N * (1 - physics.grasp_close_rad / physics.grasp_open_rad)) {}

ForceMeter::Finding ForceMeter::Add(double time_s, const ContactModel& model) {
  Finding finding;
  if (time_s <= last_s_) return finding;
  // A restarted physics_node restores its grasp from its checkpoint, which is no slip and no new hold.
  const bool continues = model.stamp.epoch == epoch_ && time_s - last_s_ <= kGap_s;
  epoch_ = model.stamp.epoch;
  const double dt_s = continues ? time_s - last_s_ : 0;
  last_s_ = time_s;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    ToolForce& tool = tools_[i];
    const double force_N = TissueForce(model.devices[i]).norm();
    tool.force_time_Ns += 0.5 * dt_s * (tool.force_N + force_N);
    tool.force_N = force_N;
    tool.peak_N = std::max(tool.peak_N, force_N);
    finding.too_high |= force_N > static_cast<double>(params_.limit[static_cast<std::size_t>(Measure::kPeakForce)]);
    if (Hold& hold = holds_[i]; !continues && hold.holding) {
      hold = {.holding = true, .begin_z = hold.begin_z, .held_s = hold.held_s, .kept_until_s = time_s + kRestored_s};
    }
    finding.slips |= FollowHold(model.devices[i], force_N, time_s, dt_s, &holds_[i], &tool);
  }
  return finding;
}

bool ForceMeter::FollowHold(const DeviceContacts& contacts, double force_N, double time_s, double dt_s, Hold* hold,
                            ToolForce* tool) const {
  const Contact* grasp = GraspOf(contacts);
  if (grasp == nullptr) {
    if (time_s < hold->kept_until_s) return false;
    const bool lost = hold->holding && hold->closed && !hold->slipping;
    *hold = {};
    tool->slips += lost ? 1 : 0;
    return lost;
  }
  hold->kept_until_s = -1;
  if (!hold->holding) {
    hold->holding = true;
    hold->begin_z = grasp->x_ref.z();
  }
  // Opening jaws release the tissue on purpose, which is no slip.
  const bool opens = grasp->slip_force < kSteadyGrip * hold->grip_N;
  hold->grip_N = grasp->slip_force;
  hold->closed = grasp->slip_force > closed_grip_N_ && !opens;
  const bool was_slipping = hold->slipping;
  const auto grip_N = static_cast<double>(grasp->slip_force);
  hold->slipping = hold->closed && force_N > (was_slipping ? kHeldAgain * grip_N : grip_N);
  const double lift_m = static_cast<double>(grasp->x_ref.z() - hold->begin_z);
  tool->lift_m = std::max(tool->lift_m, lift_m);
  const auto limit = [&](Measure measure) {
    return static_cast<double>(params_.limit[static_cast<std::size_t>(measure)]);
  };
  const bool held = 1e3 * lift_m >= limit(Measure::kLift) && force_N <= limit(Measure::kPeakForce);
  hold->held_s = held ? hold->held_s + dt_s : 0;
  tool->lift_hold_s = std::max(tool->lift_hold_s, hold->held_s);
  const bool begins = hold->slipping && !was_slipping;
  tool->slips += begins ? 1 : 0;
  return begins;
}

}  // namespace fulcrum::assessment
