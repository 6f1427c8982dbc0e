// One or two Touch devices behind HDAPI: opens and pairs them, exchanges positions and forces with the servo, watches
// over motors and cables, and opens again what was lost.
//
//     servo thread ──force──► TouchLink ──► scheduler callback of the library (1 kHz) ──► motors
//                  ◄─sample──           ◄──
//     any thread   ◄─Trouble()─ mutex ◄── Maintain(), ten times a second: calibrate, open again
//
// The library insists that devices are read and driven in its own scheduler. The servo keeps its own thread, which also
// serves the bus's clock and the histograms, and exchanges the newest values with the callback without waiting: that
// costs up to a period each way and leaves both running when the other one stops.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "haptics_node/device/hdapi.h"
#include "services/base/core/messages.h"
#include "services/base/core/types.h"
#include "services/base/runtime/latest_value.h"

namespace fulcrum::haptics {

/// One reading, in the frame D of the device: x to the right, y up, z towards the operator.
struct TouchSample {
  Vec3d p_D = Vec3d::Zero();    ///< Attach point [m].
  Vec3d d_D = -Vec3d::UnitZ();  ///< Unit vector along the tool, towards its tip: -z of the stylus.
  int buttons = 0;              ///< Bit per button that is down.
};

/// What the servo and the scheduler's callback share of one tool.
struct TouchLink {
  runtime::LatestValue<TouchSample> sample;  ///< Callback to servo; only while the device is calibrated and talks.
  runtime::LatestValue<Vec3d> force_D;       ///< Servo to callback [N].
  // Relaxed: figures of which only the newest matters.
  std::atomic<double> motor_heat{-1};  ///< Hottest motor, 0 … 1; negative: not read yet.
  std::atomic<bool> warm{false};       ///< The driver has cut the force within the last second.
};

class TouchDriver {
 public:
  /// Which device works a tool.
  struct Wanted {
    std::string name;    ///< As in the Touch's setup program.
    std::string serial;  ///< Empty: whatever device has that name.
  };
  using WantedByTool = std::array<std::optional<Wanted>, kMaxTools>;

  /// Loads the library and opens the devices. Throws InputError when the library is missing; a missing device is no
  /// error but trouble, since it may be plugged in later.
  explicit TouchDriver(const WantedByTool& wanted, const std::string& library = "libHD.so");
  ~TouchDriver();
  TouchDriver(const TouchDriver&) = delete;
  TouchDriver& operator=(const TouchDriver&) = delete;

  /// Calls Maintain() from a thread of its own. Without it, call that yourself.
  void Start();
  /// Opens again what is not open. That stops the scheduler for as long as the library takes, so another device that
  /// works is disturbed only each ten seconds.
  void Maintain(std::int64_t now_ns);

  [[nodiscard]] TouchLink& link(std::size_t tool) { return links_[tool]; }
  /// What is wrong with the device of a tool and what to check; empty when all is well. Not for real-time threads.
  [[nodiscard]] std::string Trouble(std::size_t tool) const;
  /// Serial number of the device that works a tool; empty while there is none.
  [[nodiscard]] std::string serial(std::size_t tool) const;
  /// Times that a device that worked was lost.
  [[nodiscard]] std::uint64_t losses() const { return losses_.load(std::memory_order_relaxed); }

 private:
  enum class State { kAbsent, kUncalibrated, kReady, kLost };

  /// A device by its name. What the callback uses changes only while the scheduler stands still.
  struct Device {
    std::string name, serial, failure;
    hd::Handle handle = hd::kInvalidHandle;
    double max_force_N = 0;
    int calibration_style = 0;
    TouchLink* link = nullptr;
    std::atomic<State> state{State::kAbsent};
    std::atomic<unsigned> error{0};         ///< That it was lost with.
    std::atomic<bool> bad_position{false};  ///< The last reading was no place that a device can be in.
    std::atomic<unsigned> refusal{0};       ///< Of a force, within the last second; 0: none.
    // Callback only.
    std::uint64_t frames = 0;
    int frames_without_force = 0, warm_frames = 0, refusal_frames = 0;
    Vec3d force_D = Vec3d::Zero();
  };

  static unsigned OnSchedulerTick(void* self) noexcept;
  void Frame(Device* device) noexcept;
  void CheckCalibration(Device* device) noexcept;
  void Read(Device* device, bool slow) noexcept;
  [[nodiscard]] Vec3d ForceToSend(Device* device) noexcept;
  void TakeErrors(Device* current) noexcept;

  void OpenDevices();
  void Open(Device* device);
  void Pair();
  void StartScheduler();
  void StopScheduler();
  [[nodiscard]] std::string Describe(unsigned error) const;
  [[nodiscard]] const Device* DeviceOf(std::size_t tool) const;

  const hd::Api api_;
  const WantedByTool wanted_;
  std::array<TouchLink, kMaxTools> links_;
  std::array<Device, kMaxTools> devices_;
  std::size_t device_count_ = 0;
  bool scheduled_ = false;
  hd::SchedulerHandle schedule_ = 0;
  std::atomic<std::uint64_t> ticks_{0}, losses_{0};
  std::uint64_t ticks_seen_ = 0;
  std::int64_t ticks_seen_ns_ = 0, retry_ns_ = 0;
  mutable std::mutex mutex_;  ///< For handle, serial, failure and link of the devices.
  std::jthread maintenance_;
};

}  // namespace fulcrum::haptics
