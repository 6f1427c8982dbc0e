// Driver of one or two Touch devices through HDAPI: opens them and assigns them to tools, exchanges positions and
// forces with the servo, monitors motors and cables, and reopens lost devices.
//
//     servo thread ──force──► TouchLink ──► scheduler callback of the library (1 kHz) ──► motors
//                  ◄─sample──           ◄──
//     any thread   ◄─Trouble()─ mutex ◄── Maintain(), ten times a second: calibrate, open again
//
// The library allows devices to be read and driven in its own scheduler only. The servo has its own thread, whose
// period the bus and the histograms depend on, and exchanges the newest values with the callback without waiting. That
// adds a delay of up to one period in each direction, and each thread keeps running if the other one stops.
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
  Vec3d x_D = Vec3d::UnitX();   ///< Unit vector across the stylus, fixed to it.
  int buttons = 0;              ///< Bit per pressed button.
};

/// Data of one tool that the servo and the scheduler's callback share.
struct TouchLink {
  /// Callback to servo; updated only while the device is calibrated and delivers readings.
  runtime::LatestValue<TouchSample> sample;
  runtime::LatestValue<Vec3d> force_D;  ///< Servo to callback [N].
  // Relaxed order is enough: independent figures, only the newest value of each is used.
  std::atomic<double> motor_heat{-1};  ///< Hottest motor, 0 … 1; negative: not read yet.
  std::atomic<bool> warm{false};       ///< The driver has cut the force within the last second.
};

class TouchDriver {
 public:
  /// Device that is assigned to a tool.
  struct Wanted {
    std::string name;    ///< Name in the Touch's setup program.
    std::string serial;  ///< Empty: any device with that name.
  };
  using WantedByTool = std::array<std::optional<Wanted>, kMaxTools>;

  /// Loads the library and opens the devices. Throws InputError when the library is missing; a missing device is
  /// reported by Trouble() only, because it may be connected later.
  explicit TouchDriver(const WantedByTool& wanted, const std::string& library = "libHD.so");
  ~TouchDriver();
  TouchDriver(const TouchDriver&) = delete;
  TouchDriver& operator=(const TouchDriver&) = delete;

  /// Starts a thread that calls Maintain(). Without it the caller must do so.
  void Start();
  /// Opens devices that are not open. The scheduler is stopped meanwhile, which interrupts a working device, so that is
  /// tried only every ten seconds.
  void Maintain(std::int64_t now_ns);

  [[nodiscard]] TouchLink& link(std::size_t tool) { return links_[tool]; }
  /// Fault of a tool's device and what to check; empty without a fault. Not for real-time threads.
  [[nodiscard]] std::string Trouble(std::size_t tool) const;
  /// Serial number of a tool's device; empty while there is none.
  [[nodiscard]] std::string serial(std::size_t tool) const;
  /// Number of times that a working device was lost.
  [[nodiscard]] std::uint64_t losses() const { return losses_.load(std::memory_order_relaxed); }

 private:
  enum class State { kAbsent, kUncalibrated, kReady, kLost };

  /// A device by its name. Members that the callback reads change only while the scheduler is stopped.
  struct Device {
    std::string name, serial, failure;
    hd::Handle handle = hd::kInvalidHandle;
    double max_force_N = 0;
    int calibration_style = 0;
    TouchLink* link = nullptr;
    std::atomic<State> state{State::kAbsent};
    std::atomic<unsigned> error{0};         ///< Error code of the loss.
    std::atomic<bool> bad_position{false};  ///< The last reading was outside the device's reach.
    std::atomic<unsigned> refusal{0};       ///< Error code of a refused force within the last second; 0: none.
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
  mutable std::mutex mutex_;  ///< Guards handle, serial, failure and link of the devices.
  std::jthread maintenance_;
};

}  // namespace fulcrum::haptics
