#include "haptics_node/servo/servo.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/base/core/scope.h"
#include "services/base/core/tool_roll.h"

namespace fulcrum::haptics {
namespace {

// Velocities are differences of positions, low-pass filtered with this time constant: a few ticks, well below the time
// scale of hand motion.
constexpr double kVelocityFilter_s = 0.003;
// Bounds of the time between two ticks [s]: below, a difference quotient is mostly noise; above, the servo was delayed.
constexpr double kMinDt_s = 1e-4;
constexpr double kMaxDt_s = 0.02;

}  // namespace

ServoSettings ServoSettingsOf(const SceneView& scene) {
  return {scene.haptics, scene.tools, FieldCentre(scene), LevelUp(scene.render)};
}

Servo::Servo(const ServoSettings& settings, const Devices& devices) : force_scale_(settings.params.force_scale) {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    const ToolDescription& tool = settings.tools[i];
    if (tool.kind == ToolKind::kNone) continue;
    if (!(tool.shaft_length_m > 2 * kMinShaftPart_m)) {
      throw InputError("scene: tool " + std::to_string(i) + ": shaft length " + std::to_string(tool.shaft_length_m) +
                       " m; valid: more than " + std::to_string(2 * kMinShaftPart_m) + " m");
    }
    channel.device = devices[i];
    channel.kind = tool.kind;
    channel.trocar = {tool.p_WP.cast<double>(), tool.shaft_length_m};
    channel.roll_reference = RollReference(tool, settings.field_centre, settings.level_up);
    channel.output.limit_N = settings.params.force_limit_N;
    channel.output.slew_N_per_ms = settings.params.slew_N_per_ms;
  }
}

void Servo::OfferModel(const ContactModel& model, std::int64_t now_ns) noexcept {
  if (!gate_.Admit(model, now_ns)) return;
  age_.OnModel(model.tool_stamp_ns, now_ns);
  pending_ = model;  // Replaces an older model that is still pending.
  has_pending_ = true;
  record_.model_epoch = model.stamp.epoch;
  record_.model_sequence = model.stamp.sequence;
  model_offered_ = true;
}

void Servo::Step(const Tick& tick) noexcept {
  if (last_stamp_ns_ != 0) {
    dt_ = std::clamp(1e-9 * static_cast<double>(tick.stamp_ns - last_stamp_ns_), kMinDt_s, kMaxDt_s);
  }
  last_stamp_ns_ = tick.stamp_ns;
  for (Channel& channel : channels_) ReadDevice(&channel, tick);
  TakePendingModel(tick.stamp_ns);
  age_.Step(model_time_ns_, model_contacts_, tick.stamp_ns, dt_);
  for (Channel& channel : channels_) Render(&channel, tick);
  FillRecord(tick);
}

void Servo::ReadDevice(Channel* channel, const Tick& tick) const noexcept {
  if (channel->device == nullptr) return;
  const Vec3d read = channel->device->ReadPosition(tick);
  // A reading that is not finite would remain in every filter, so the last valid one is used instead.
  const Vec3d p_WA = read.allFinite() ? read : channel->p_WA;
  channel->moved = channel->started ? Vec3d(p_WA - channel->p_WA) : Vec3d(Vec3d::Zero());
  channel->p_WA = p_WA;
  channel->v_WA += dt_ / (dt_ + kVelocityFilter_s) * (channel->moved / dt_ - channel->v_WA);
  channel->pose = PoseFromAttachPoint(channel->trocar, p_WA);
  if (const float roll = channel->device->ReadRoll(); std::isfinite(roll)) channel->roll = roll;
  channel->buttons = channel->device->ReadButtons();
  channel->ring.Push(tick.stamp_ns, channel->pose.p_WT);
}

void Servo::TakePendingModel(std::int64_t now_ns) noexcept {
  // All channels cross-fade at the same time, so checking the first one is enough.
  if (!has_pending_ || !channels_.front().model.ready(now_ns)) return;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    channel.model.Accept(pending_.devices[i], pending_.tool_stamp_ns, now_ns, {force_scale_, channel.pose},
                         channel.ring);
    channel.external_W = pending_.devices[i].p_ext_W;
  }
  model_time_ns_ = pending_.tool_stamp_ns;
  model_contacts_ = std::any_of(pending_.devices.begin(), pending_.devices.end(),
                                [](const auto& device) { return device.count > 0; });
  if (model_contacts_) {
    figures_.motion_to_force_ns = now_ns - pending_.tool_stamp_ns;
    ++figures_.contacts_used;
  }
  has_pending_ = false;
}

void Servo::Render(Channel* channel, const Tick& tick) const noexcept {
  if (channel->device == nullptr) return;
  const ModelForce model = channel->model.Step(channel->pose.p_WT, tick.stamp_ns, dt_);
  const double gain = force_scale_ * age_.gain();
  Vec3d f_A = ForceAtAttachPoint(channel->pose, gain * model.f_W);
  if (model.touching) f_A -= age_.damping() * channel->v_WA;
  if (age_.creeping()) channel->passivity.Refill(gain * model.stored_J);
  f_A = channel->passivity.Step(f_A, channel->output.sent, channel->moved, gain * model.stored_J, channel->external_W,
                                dt_);
  channel->device->WriteForce(channel->output.Step(f_A, age_.creeping(), tick.dt_s));
  TrackProxy(channel, model.offset, !channel->started);
  channel->started = true;
}

void Servo::TrackProxy(Channel* channel, const Vec3d& offset, bool first) const noexcept {
  const Vec3d p_WT = channel->pose.p_WT + offset;
  Eigen::Quaterniond q_WT = LevelOrientation(channel->kind, channel->pose.d_W, channel->roll_reference);
  if (channel->roll != 0) q_WT = q_WT * Eigen::AngleAxisd(static_cast<double>(channel->roll), Vec3d::UnitZ());
  if (!first) {
    const double blend = dt_ / (dt_ + kVelocityFilter_s);
    const Eigen::Quaterniond turn = q_WT * channel->q_WT.conjugate();
    // Twice the vector part is the rotation vector of a small rotation; the sign selects the shorter direction.
    const Vec3d w = std::copysign(2.0, turn.w()) / dt_ * turn.vec();
    channel->v_WT += blend * ((p_WT - channel->p_WT) / dt_ - channel->v_WT);
    channel->w_WT += blend * (w - channel->w_WT);
  }
  channel->p_WT = p_WT;
  channel->q_WT = q_WT;
}

void Servo::FillRecord(const Tick& tick) noexcept {
  const double age = model_time_ns_ == 0 ? -1.0 : 1e-9 * static_cast<double>(tick.stamp_ns - model_time_ns_);
  Hash64 hash;
  figures_.not_finite = 0;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const Channel& channel = channels_[i];
    ToolSample& sample = record_.tool.tools[i];
    if (channel.device == nullptr) continue;
    const Vec3d& sent = channel.output.sent;
    sample.kind = channel.kind;
    sample.state = age_.state();
    sample.p_WT = channel.p_WT.cast<float>();
    sample.q_WT = channel.q_WT.cast<float>();
    sample.v_WT = channel.v_WT.cast<float>();
    sample.w_WT = channel.w_WT.cast<float>();
    sample.f_W = ForceAtTip(channel.pose, sent).cast<float>();
    sample.model_age_s = static_cast<float>(std::max(0.0, age));
    sample.buttons = channel.buttons;
    figures_.force_N[i] = sent.norm();
    figures_.peak_force_N = std::max(figures_.peak_force_N, figures_.force_N[i]);
    figures_.not_finite += channel.output.not_finite;
    hash.Add(std::as_bytes(std::span(channel.p_WA.data(), 3)));
    hash.Add(std::as_bytes(std::span(sent.data(), 3)));
    channel.model.AddTo(&hash);
    if (channel.roll != 0) hash.AddValue(channel.roll);
  }
  hash.AddValue(age_.gain());
  figures_.state = age_.state();
  figures_.model_age_s = age;
  figures_.models_dropped = gate_.dropped();
  record_.tool.stamp.stamp_ns = tick.stamp_ns;
  record_.tick = tick.index;
  record_.session_time_s = tick.session_time_s;
  record_.state_hash = hash.value();
  record_.model_taken = model_offered_;
  model_offered_ = false;
}

}  // namespace fulcrum::haptics
