#include "haptics_node/node/haptics_node.h"

#include <algorithm>
#include <string>
#include <utility>

#include "haptics_node/device/simulated_device.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/quantiles.h"
#include "services/transport/bus/gate.h"

namespace fulcrum::haptics {
namespace {

DeviceArray MakeScriptedDevices(const SceneView& scene, const std::array<bool, kMaxTools>& simulated) {
  DeviceArray devices;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    const ToolDescription& tool = scene.tools[i];
    if (tool.kind == ToolKind::kNone || !simulated[i]) continue;
    devices[i] = MakeScriptedDevice(scene, i, scene.haptics);
  }
  return devices;
}

Servo::Devices Pointers(const DeviceArray& devices) {
  Servo::Devices pointers{};
  std::transform(devices.begin(), devices.end(), pointers.begin(), [](const auto& device) { return device.get(); });
  return pointers;
}

std::array<OperatedDevice*, kMaxTools> OperatedAmong(const DeviceArray& devices) {
  std::array<OperatedDevice*, kMaxTools> operated{};
  std::transform(devices.begin(), devices.end(), operated.begin(),
                 [](const auto& device) { return dynamic_cast<OperatedDevice*>(device.get()); });
  return operated;
}

bool HasContacts(const ContactModel& model) {
  return std::ranges::any_of(model.devices, [](const DeviceContacts& device) { return device.count > 0; });
}

void AddTrouble(Health* health, const std::string& trouble) {
  if (health->state == HealthState::kRunning) health->state = HealthState::kDegraded;
  if (!health->last_error.empty()) health->last_error += "; ";
  health->last_error += trouble;
}

}  // namespace

static_assert(kTicksPerManifest <= bus::kMaxTickTimes, "a manifest must have room for the times of its ticks");

HapticsNode::HapticsNode(const SceneView& scene, const std::array<bool, kMaxTools>& simulated, const Ports& ports,
                         std::int64_t epoch_ns)
    : HapticsNode(scene, MakeScriptedDevices(scene, simulated), ports, epoch_ns) {}

HapticsNode::HapticsNode(const SceneView& scene, DeviceArray devices, const Ports& ports, std::int64_t epoch_ns)
    : ports_(ports),
      devices_(std::move(devices)),
      operated_(OperatedAmong(devices_)),
      servo_(ServoSettingsOf(scene), Pointers(devices_)),
      epoch_(static_cast<std::uint64_t>(epoch_ns)),
      thinner_(static_cast<double>(scene.physics.dt_s)) {
  manifest_.node = NodeId::kHaptics;
  manifest_.consumed.resize(2);
}

void HapticsNode::ServoStep(const Tick& tick) noexcept {
  // Only the newest model is offered: the manifest records the model that a tick took, not the models that a late tick
  // skipped, so a replay could not repeat those.
  bool arrived = false;
  while (to_servo_.TryPop(&arrived_)) arrived = true;
  if (arrived) servo_.OfferModel(arrived_, tick.stamp_ns);
  tick_.input_taken = false;
  while (inputs_to_servo_.TryPop(&input_)) tick_.input_taken = true;
  if (tick_.input_taken) {
    tick_.input_epoch = input_.stamp.epoch;
    tick_.input_sequence = input_.stamp.sequence;
    for (std::size_t i = 0; i < operated_.size(); ++i) {
      if (operated_[i] == nullptr) continue;
      // Released controls move nothing.
      operated_[i]->Follow(input_.claim_ns != 0 ? input_.tools[i] : OperatorTool(), input_.stamp.stamp_ns);
    }
  }
  servo_.Step(tick);
  tick_.servo = servo_.record();
  const ServoFigures& figures = servo_.figures();
  if (figures.contacts_used != contacts_used_) motion_to_force_.Add(figures.motion_to_force_ns);
  contacts_used_ = figures.contacts_used;
  figures_.Store(figures);
  if (!from_servo_.TryPush(tick_)) records_lost_.fetch_add(1, std::memory_order_relaxed);
  stays_ = AreAtRest(last_tools_, tick_.servo.tool);
  if (rests_.load(std::memory_order_relaxed) && !stays_) ports_.bell->Ring();
  last_tools_ = tick_.servo.tool;
}

std::int64_t HapticsNode::ServoRestsUntil() const noexcept {
  const std::int64_t now_ns = last_tools_.stamp.stamp_ns;
  if (!rests_.load(std::memory_order_relaxed) || !stays_ || servo_.creeping()) return now_ns;
  std::int64_t until_ns = now_ns + ToolThinner::kLongRest_ns;
  for (const auto& device : devices_) {
    if (device) until_ns = std::min(until_ns, device->RestsUntil());
  }
  return until_ns;
}

void HapticsNode::BusStep() {
  if (ports_.contact_model.TakeLatest(&received_)) {
    if (!to_servo_.TryPush(received_)) models_not_taken_.fetch_add(1, std::memory_order_relaxed);
    if (HasContacts(received_)) servo_bell_.Ring();
  }
  while (ports_.operator_input.TakeNext(&received_input_)) {
    if (operator_.Add(received_input_) && !inputs_to_servo_.TryPush(received_input_)) {
      inputs_not_taken_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  while (from_servo_.TryPop(&record_)) Publish(record_);
  rests_.store(IsAtRest(), std::memory_order_relaxed);
}

void HapticsNode::BusTurn() {
  constexpr int kMostRests = 5;  // Then the thread looks whether it is to end.
  BusStep();
  for (int i = 0; i < kMostRests && rests(); ++i) {
    Rest();
    BusStep();
  }
}

bool HapticsNode::IsAtRest() const {
  constexpr std::size_t kSettled_ticks = 100;
  return thinner_.still_ticks() >= kSettled_ticks && !HasContacts(received_);
}

void HapticsNode::Rest() {
  // A record is pushed within this time of the begin of its tick, or is taken the next time.
  constexpr std::int64_t kServoStep_ns = 500'000;
  const std::int64_t due_ns = thinner_.published_ns() + ToolThinner::kLongRest_ns + kServoStep_ns;
  // A tick that came early has published nothing: the servo rests for as long as that again.
  const bool passed = due_ns <= runtime::MonotonicNs();
  ports_.bell->WaitUntil(passed ? record_.servo.tool.stamp.stamp_ns + ToolThinner::kLongRest_ns + kServoStep_ns
                                : due_ns);
}

void HapticsNode::Publish(const TickRecord& tick) {
  const ServoRecord& record = tick.servo;
  const ToolThinner::Due& due =
      thinner_.Add(record.tool, record.session_time_s, rests_.load(std::memory_order_relaxed));
  for (std::size_t i = 0; i < due.count; ++i) {
    ToolState tool = due.states[i];
    tool.stamp = {++tool_sequence_, epoch_, tool.stamp.stamp_ns};
    ports_.tool_state.Write(tool);
  }
  manifest_.tick_times_ns.push_back(record.tool.stamp.stamp_ns);
  if (!record.model_taken && !tick.input_taken && record.tick < next_manifest_tick_) return;
  next_manifest_tick_ = record.tick + kTicksPerManifest;
  manifest_.stamp = {++manifest_sequence_, epoch_, record.tool.stamp.stamp_ns};
  manifest_.tick = record.tick;
  manifest_.session_time_s = record.session_time_s;
  manifest_.state_hash = record.state_hash;
  manifest_.consumed[0] = {TopicId::kContactModel, record.model_epoch, record.model_sequence};
  manifest_.consumed[1] = {TopicId::kOperatorInput, tick.input_epoch, tick.input_sequence};
  if (ports_.tick_manifest.has_readers()) ports_.tick_manifest.Write(manifest_);
  manifest_.tick_times_ns.clear();
}

void HapticsNode::FillHealth(Health* health) const {
  const ServoFigures figures = figures_.Load();
  const auto metric = [&](const std::string& name, double value) { health->metrics.push_back({name, value}); };
  metric("peak_hand_force_N", figures.peak_force_N);
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (devices_[i]) metric("hand_force" + std::to_string(i) + "_N", figures.force_N[i]);
  }
  metric("model_age_ms", 1e3 * figures.model_age_s);
  runtime::AddQuantiles("motion_to_force", motion_to_force_.snapshot(), health);
  metric("models_dropped", static_cast<double>(figures.models_dropped));
  metric("models_not_taken", static_cast<double>(models_not_taken_.load(std::memory_order_relaxed)));
  metric("inputs_not_taken", static_cast<double>(inputs_not_taken_.load(std::memory_order_relaxed)));
  metric("operated_tools", static_cast<double>(operated_.size() - static_cast<std::size_t>(std::count(
                                                                      operated_.begin(), operated_.end(), nullptr))));
  metric("records_lost", static_cast<double>(records_lost_.load(std::memory_order_relaxed)));
  metric("forces_not_finite", static_cast<double>(figures.not_finite));
  FillDeviceHealth(health);
  // Before the first model there is no age to report.
  if (figures.model_age_s > 1e-9 * static_cast<double>(kHoldAge_ns)) {
    AddTrouble(health, "no contact model for " + std::to_string(static_cast<int>(1e3 * figures.model_age_s)) +
                           " ms: forces are off until physics_node publishes again");
  }
}

void HapticsNode::FillDeviceHealth(Health* health) const {
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (!devices_[i]) continue;
    const DeviceHealth device = devices_[i]->Describe();
    const std::string tool = std::to_string(i);
    if (device.motor_heat >= 0) {
      health->metrics.push_back({"motor" + tool + "_heat_pct", 100 * device.motor_heat});
      health->metrics.push_back({"device" + tool + "_gain_pct", 100 * device.gain});
    }
    if (!device.trouble.empty()) AddTrouble(health, "tool " + tool + ": " + device.trouble);
  }
}

}  // namespace fulcrum::haptics
