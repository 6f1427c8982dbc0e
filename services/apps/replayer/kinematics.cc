#include "services/apps/replayer/kinematics.h"

#include <algorithm>

#include "services/base/core/contact_force.h"

namespace fulcrum::replay {
namespace {

constexpr auto kLongest_ns = static_cast<std::int64_t>(1e9 * Kinematics::kLongest_s);

template <class Sample>
bool IsNew(const std::vector<Sample>& samples, const Stamp& stamp) {
  return samples.empty() || stamp.stamp_ns > samples.back().stamp_ns;
}

/// The samples before and after a time, and the share of the second one.
template <class Sample>
struct Around {
  Around(const std::vector<Sample>& samples, std::int64_t stamp_ns) {
    const auto next = std::upper_bound(samples.begin(), samples.end(), stamp_ns,
                                       [](std::int64_t t, const Sample& sample) { return t < sample.stamp_ns; });
    after = next == samples.end() ? &samples.back() : &*next;
    before = next == samples.begin() ? &samples.front() : &*(next - 1);
    const std::int64_t apart_ns = after->stamp_ns - before->stamp_ns;
    if (apart_ns > 0 && apart_ns <= kLongest_ns) {
      share = static_cast<double>(stamp_ns - before->stamp_ns) / static_cast<double>(apart_ns);
    }
  }
  const Sample *before, *after;
  double share = 0;
};

}  // namespace

void Kinematics::Add(const ToolState& tools) {
  if (!IsNew(tools_, tools.stamp)) return;
  Poses& poses = tools_.emplace_back();
  poses.stamp_ns = tools.stamp.stamp_ns;
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    poses.tip_W[k] = tools.tools[k].p_WT.cast<double>();
    poses.q_WT[k] = tools.tools[k].q_WT.cast<double>();
  }
}

void Kinematics::Add(const HandleState& handles) {
  if (!IsNew(handles_, handles.stamp)) return;
  Handles& sample = handles_.emplace_back();
  sample.stamp_ns = handles.stamp.stamp_ns;
  for (std::size_t k = 0; k < kMaxTools; ++k) {
    sample.jaw_rad[k] = static_cast<double>(handles.handles[k].jaw_angle_rad);
  }
  sample.pedals = handles.pedals;
}

void Kinematics::Add(const ContactModel& contacts) {
  if (!IsNew(forces_, contacts.stamp)) return;
  Forces& forces = forces_.emplace_back();
  forces.stamp_ns = contacts.stamp.stamp_ns;
  for (std::size_t k = 0; k < kMaxTools; ++k) forces.force_N[k] = TissueForce(contacts.devices[k]).norm();
}

KinematicState Kinematics::At(std::int64_t stamp_ns) const {
  KinematicState state;
  if (!tools_.empty()) {
    const Around<Poses> at(tools_, stamp_ns);
    for (std::size_t k = 0; k < kMaxTools; ++k) {
      state.tools[k].tip_W = (1 - at.share) * at.before->tip_W[k] + at.share * at.after->tip_W[k];
      state.tools[k].q_WT = at.before->q_WT[k].slerp(at.share, at.after->q_WT[k]).normalized();
    }
  }
  if (!handles_.empty()) {
    const Around<Handles> at(handles_, stamp_ns);
    for (std::size_t k = 0; k < kMaxTools; ++k) {
      state.tools[k].jaw_rad = (1 - at.share) * at.before->jaw_rad[k] + at.share * at.after->jaw_rad[k];
    }
    state.pedals = at.before->pedals;
  }
  if (!forces_.empty()) {
    const Around<Forces> at(forces_, stamp_ns);
    for (std::size_t k = 0; k < kMaxTools; ++k) {
      state.tools[k].force_N = (1 - at.share) * at.before->force_N[k] + at.share * at.after->force_N[k];
    }
  }
  return state;
}

}  // namespace fulcrum::replay
