// The haptics node on ports. It has two threads: the servo thread, which uses no port, and the bus thread, which moves
// messages between the ports and two lock-free rings.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/device/operated_device.h"
#include "haptics_node/node/tool_thinner.h"
#include "haptics_node/servo/servo.h"
#include "services/base/core/messages.h"
#include "services/base/core/operator_choice.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/bell.h"
#include "services/base/runtime/histogram.h"
#include "services/base/runtime/seqlock.h"
#include "services/base/runtime/spsc_ring.h"
#include "services/transport/bus/port.h"

namespace fulcrum::haptics {

/// A manifest is published for each tick that admits a contact model, and at least every this many ticks.
inline constexpr std::uint64_t kTicksPerManifest = 10;

class HapticsNode {
 public:
  struct Ports {
    bus::Input<ContactModel>& contact_model;
    bus::Input<OperatorInput>& operator_input;
    bus::Output<ToolState>& tool_state;
    bus::Output<TickManifest>& tick_manifest;
    std::shared_ptr<runtime::Bell> bell =
        std::make_shared<runtime::Bell>();  ///< To be rung when a message has arrived.
  };

  /// Scene and ports must outlive the node. A tool without a device is not published.
  /// @param epoch_ns CLOCK_MONOTONIC at the start of the process [ns].
  HapticsNode(const SceneView& scene, DeviceArray devices, const Ports& ports, std::int64_t epoch_ns);
  /// The same with simulated devices that follow the scene's script, for the tools that `simulated` marks.
  HapticsNode(const SceneView& scene, const std::array<bool, kMaxTools>& simulated, const Ports& ports,
              std::int64_t epoch_ns);

  /// Servo thread, each millisecond. Does not wait, lock, allocate, log or throw.
  void ServoStep(const Tick& tick) noexcept;
  /// After ServoStep: time until which further steps would find nothing new [CLOCK_MONOTONIC, ns]: at most
  /// ToolThinner::kLongRest_ns after that step, less before a simulated hand moves; its time while a tool is operated,
  /// moves or is near tissue. Under the same conditions.
  [[nodiscard]] std::int64_t ServoRestsUntil() const noexcept;
  /// Rung when a contact model has contacts.
  [[nodiscard]] runtime::Bell* servo_bell() { return &servo_bell_; }

  /// Bus thread, each millisecond, at rest after Rest(): newest contact model in, records of the servo out. In a replay
  /// or a test, call it before and after ServoStep() on one thread.
  void BusStep();

  /// BusStep(), and while the node rests, for at most 0.2 s, Rest() and BusStep() in turn. Bus thread.
  void BusTurn();

  /// No tool has moved for a tenth of a second and none is near tissue. Bus thread.
  [[nodiscard]] bool rests() const { return rests_.load(std::memory_order_relaxed); }
  /// The same, for any thread.
  [[nodiscard]] const std::atomic<bool>* resting() const { return &rests_; }
  /// While the node rests: waits until the next sample is due, at most ToolThinner::kLongRest_ns; less if a tool moves
  /// or the bell rings. BusStep() is to follow. Bus thread.
  void Rest();

  /// State hash of the servo after the newest tick that BusStep() has published. Bus thread.
  [[nodiscard]] std::uint64_t state_hash() const { return record_.servo.state_hash; }

  /// Any thread.
  void FillHealth(Health* health) const;

 private:
  /// What a tick did, for the bus thread.
  struct TickRecord {
    ServoRecord servo;
    std::uint64_t input_epoch = 0, input_sequence = 0;  ///< Newest OperatorInput followed; sequence 0: none yet.
    bool input_taken = false;                           ///< Followed since the last tick.
  };

  [[nodiscard]] bool IsAtRest() const;
  void Publish(const TickRecord& record);
  void FillDeviceHealth(Health* health) const;

  Ports ports_;
  DeviceArray devices_;
  std::array<OperatedDevice*, kMaxTools> operated_;  ///< Those of devices_; null: of another kind.
  Servo servo_;
  const std::uint64_t epoch_;

  // If the servo is delayed for longer than a ring holds, the newest models, inputs and records are dropped and counted
  // in Health.
  runtime::SpscRing<ContactModel, 8> to_servo_;
  runtime::SpscRing<OperatorInput, 8> inputs_to_servo_;
  runtime::SpscRing<TickRecord, 256> from_servo_;
  runtime::SeqLock<ServoFigures> figures_;
  runtime::Histogram motion_to_force_;
  std::atomic<std::uint64_t> models_not_taken_{0}, inputs_not_taken_{0}, records_lost_{0};

  runtime::Bell servo_bell_;
  std::atomic<bool> rests_{false};  ///< Relaxed: a tick that misses a change is followed by one that does not.

  // Servo thread only.
  ToolState last_tools_;
  bool stays_ = false;  ///< No tool has changed in the newest tick.
  ContactModel arrived_;
  OperatorInput input_;
  TickRecord tick_;
  std::uint64_t contacts_used_ = 0;
  // Bus thread only.
  ContactModel received_;
  OperatorInput received_input_;
  OperatorChoice operator_;
  TickRecord record_;
  ToolThinner thinner_;
  TickManifest manifest_;
  std::uint64_t tool_sequence_ = 0, manifest_sequence_ = 0;
  std::uint64_t next_manifest_tick_ = 0;
};

}  // namespace fulcrum::haptics
