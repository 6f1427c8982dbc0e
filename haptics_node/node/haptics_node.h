// The haptics node on ports. It has two threads: the servo thread, which uses no port, and the bus thread, which moves
// messages between the ports and two lock-free rings.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "haptics_node/device/haptic_device.h"
#include "haptics_node/servo/servo.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/tick.h"
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
    bus::Output<ToolState>& tool_state;
    bus::Output<TickManifest>& tick_manifest;
  };

  /// Scene and ports must outlive the node. A tool without a device is not published.
  /// @param epoch_ns CLOCK_MONOTONIC at the start of the process [ns].
  HapticsNode(const SceneView& scene, DeviceArray devices, const Ports& ports, std::int64_t epoch_ns);
  /// The same with simulated devices that follow the scene's script, for the tools that `simulated` marks.
  HapticsNode(const SceneView& scene, const std::array<bool, kMaxTools>& simulated, const Ports& ports,
              std::int64_t epoch_ns);

  /// Servo thread, each millisecond. Does not wait, lock, allocate, log or throw.
  void ServoStep(const Tick& tick) noexcept;

  /// Bus thread, each millisecond: newest contact model in, records of the servo out. In a replay or a test, call it
  /// before and after ServoStep() on one thread.
  void BusStep();

  /// State hash of the servo after the newest tick that BusStep() has published. Bus thread.
  [[nodiscard]] std::uint64_t state_hash() const { return record_.state_hash; }

  /// Any thread.
  void FillHealth(Health* health) const;

 private:
  void Publish(const ServoRecord& record);
  void FillDeviceHealth(Health* health) const;

  Ports ports_;
  DeviceArray devices_;
  Servo servo_;
  const std::uint64_t epoch_;

  // If the servo is delayed for longer than a ring holds, the newest models and records are dropped and counted in
  // Health.
  runtime::SpscRing<ContactModel, 8> to_servo_;
  runtime::SpscRing<ServoRecord, 256> from_servo_;
  runtime::SeqLock<ServoFigures> figures_;
  std::atomic<std::uint64_t> models_not_taken_{0}, records_lost_{0};

  // Servo thread only.
  ContactModel arrived_;
  // Bus thread only.
  ContactModel received_;
  ServoRecord record_;
  TickManifest manifest_;
  std::uint64_t tool_sequence_ = 0, manifest_sequence_ = 0;
  std::uint64_t next_manifest_tick_ = 0;
};

}  // namespace fulcrum::haptics
