#include "haptics_node/servo/local_model.h"

#include <algorithm>
#include <utility>

namespace fulcrum::haptics {
namespace {

// Bounds of a replay's step [s]. Steps follow the stamps of the ring; a gap (the servo was delayed) is bridged in one
// step of at most kMaxReplayStep_s.
constexpr double kMaxReplayStep_s = 0.02;
constexpr double kMinReplayStep_s = 1e-5;

double Smootherstep(double u) noexcept {
  const double c = std::clamp(u, 0.0, 1.0);
  return c * c * c * (c * (6.0 * c - 15.0) + 10.0);
}

Contact Scaled(Contact contact, double scale) noexcept {
  const auto factor = static_cast<float>(scale);
  for (float* value : {&contact.k1, &contact.k3, &contact.kt, &contact.k_body, &contact.b_body}) *value *= factor;
  return contact;
}

double Seconds(std::int64_t ns) noexcept { return 1e-9 * static_cast<double>(ns); }

}  // namespace

double LocalModel::CouplingFor(const Contact& contact, std::uint32_t count, const HandMapping& hand) const noexcept {
  // A tip stiffness K is felt at the hand as J^T K J. For a surface that is the skin stiffness along the measured
  // normal and kt across it; for a grasp its stiffness in the least favourable direction. The contacts of a device act
  // in parallel and share the stiffness limit.
  const auto needed = [&](double stiffness, double lever) {
    if (stiffness <= 0.0) return 0.0;
    const double compliance = hand.force_scale * lever * lever * count / kMaxHandStiffness_N_m;
    return std::max(0.0, compliance - 1.0 / stiffness);
  };
  const double stretch = SkinStretch(contact.k1, contact.k3, contact.f_ref.cast<double>().norm());
  const double skin = contact.k1 + 3.0 * contact.k3 * stretch * stretch;
  const double worst = LargestLever(hand.pose);
  const bool grasp = contact.kind == ContactKind::kGrasp;
  const double straight = grasp ? worst : ForceAtAttachPoint(hand.pose, contact.n.cast<double>()).norm();
  double coupling = std::max(needed(skin, straight), grasp ? 0.0 : needed(contact.kt, worst));
  // A coupling that stiffens during contact would add energy, so its compliance never decreases in a contact.
  const ContactSet& set = sets_[current_];
  for (std::uint32_t i = 0; i < set.count; ++i) {
    if (set.laws[i].id == contact.id && set.laws[i].kind == contact.kind) {
      coupling = std::max(coupling, set.laws[i].coupling);
    }
  }
  return coupling;
}

void LocalModel::Learn(const DeviceContacts& contacts, std::int64_t t_s_ns) noexcept {
  const ContactSet& set = sets_[current_];
  Vec3d reported = Vec3d::Zero();
  Vec3d pressure = Vec3d::Zero();
  bool same = contacts.count == set.count;
  bool grasp = false;
  for (std::uint32_t i = 0; i < contacts.count; ++i) {
    const Contact& contact = contacts.contacts[i];
    reported += contact.f_ref.cast<double>();
    pressure += contact.n.cast<double>();
    grasp = grasp || contact.kind == ContactKind::kGrasp;
    same = same && set.laws[i].id == contact.id && set.laws[i].kind == contact.kind;
  }
  const auto* const end = predictions_.data() + prediction_count_;
  const auto* const then =
      std::find_if(std::as_const(predictions_).data(), end, [=](const Prediction& p) { return p.stamp_ns == t_s_ns; });
  if (same && then != end) {
    // For a surface only the normal force is evaluated: sliding friction is proportional to it for any stiffness.
    const Vec3d direction = (grasp ? Vec3d(then->f_W - reference_f_W_) : pressure).stableNormalized();
    correction_.Learn(direction.dot(reference_f_W_), direction.dot(then->f_W), direction.dot(reported));
  } else if (!same) {
    correction_.ResetVariance();
  }
  reference_f_W_ = reported;
  prediction_count_ = 0;
}

void LocalModel::AddPrediction(std::int64_t stamp_ns, const Vec3d& f_W) noexcept {
  if (prediction_count_ < predictions_.size()) predictions_[prediction_count_++] = {stamp_ns, f_W};
}

void LocalModel::Accept(const DeviceContacts& contacts, std::int64_t t_s_ns, std::int64_t now_ns,
                        const HandMapping& hand, const PoseRing& ring) noexcept {
  Learn(contacts, t_s_ns);
  ContactSet& set = sets_[1 - current_];
  set.t_s_ns = t_s_ns;
  set.count = contacts.count;
  set.force_cap_N = contacts.force_cap_N;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const Contact contact = Scaled(contacts.contacts[i], correction_.scale());
    const double coupling = CouplingFor(contact, set.count, hand);
    set.laws[i] = MakeContactLaw(contact, coupling, &set.states[i]);
  }
  // The newest entry of the ring belongs to this tick and is evaluated by Step().
  std::int64_t previous_ns = t_s_ns;
  for (std::size_t age = set.count > 0 ? ring.CountAfter(t_s_ns) : 0; age > 1; --age) {
    const TimedTip& tip = ring.Newest(age - 1);
    const double dt = std::clamp(Seconds(tip.stamp_ns - previous_ns), kMinReplayStep_s, kMaxReplayStep_s);
    AddPrediction(tip.stamp_ns, StepSet(&set, tip.x, tip.stamp_ns, dt).f_W);
    previous_ns = tip.stamp_ns;
  }
  current_ = 1 - current_;
  fade_start_ns_ = now_ns;
}

ModelForce LocalModel::StepSet(ContactSet* set, const Vec3d& x, std::int64_t now_ns, double dt) noexcept {
  ModelForce total;
  total.touching = set->count > 0;
  double weight = 0;
  const double t = Seconds(now_ns - set->t_s_ns);
  for (std::uint32_t i = 0; i < set->count; ++i) {
    const ContactForce force = StepContact(set->laws[i], x, t, dt, &set->states[i]);
    total.f_W += force.f_W;
    total.stored_J += force.stored_J;
    // Each contact has its own proxy; the tool's proxy is their mean, weighted by force.
    const double size = force.f_W.norm();
    total.offset += size * set->laws[i].coupling * force.f_W;
    weight += size;
  }
  if (weight > 0.0) total.offset /= weight;
  const double size = total.f_W.norm();
  if (set->force_cap_N > 0.0 && size > set->force_cap_N) total.f_W *= set->force_cap_N / size;
  return total;
}

ModelForce LocalModel::Step(const Vec3d& x, std::int64_t now_ns, double dt) noexcept {
  ModelForce force = StepSet(&sets_[current_], x, now_ns, dt);
  AddPrediction(now_ns, force.f_W);
  if (ready(now_ns)) return force;
  const ModelForce old = StepSet(&sets_[1 - current_], x, now_ns, dt);
  const double w = Smootherstep(Seconds(now_ns - fade_start_ns_) / Seconds(kCrossFade_ns));
  force.f_W = old.f_W + w * (force.f_W - old.f_W);
  force.offset = old.offset + w * (force.offset - old.offset);
  force.stored_J = old.stored_J + w * (force.stored_J - old.stored_J);
  return force;
}

void LocalModel::AddTo(Hash64* hash) const noexcept {
  const ContactSet& set = sets_[current_];
  hash->AddValue(set.t_s_ns);
  hash->AddValue(correction_.scale());
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const ContactState& state = set.states[i];
    hash->AddValue(set.laws[i].id);
    hash->AddValue(state.q);
    hash->Add(std::as_bytes(std::span(state.q_t.data(), 3)));
    hash->Add(std::as_bytes(std::span(state.anchor.data(), 3)));
  }
}

}  // namespace fulcrum::haptics
