// Controls of the stand-in for libHD.so: a real shared library with the driver's symbols, devices in memory, errors on
// demand. Not thread-safe unless stated: configure it before the scheduler runs.
#pragma once

#include <array>
#include <atomic>
#include <string>
#include <vector>

namespace fulcrum::haptics::testing {

struct StandInDevice {
  std::string name;  ///< As in the driver's setup program.
  std::string serial;
  std::atomic<bool> plugged{
      true};  ///< May be set by any thread. Unplugged: init fails, a frame reports a communication error.
  std::array<double, 3> position_mm{};
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  int buttons = 0;
  std::array<double, 6> heat{};  ///< At 1 the force is cut and each frame reports warm motors.
  unsigned calibration = 0x5000;
  int calibration_updates = 0;
  double max_force_N = 3.3;
  unsigned error = 0;  ///< Reported once, by the next frame.

  bool open = false;
  bool force_enabled = false;
  std::array<double, 3> force_N{};  ///< Present force of the motors.
  std::vector<std::array<double, 3>>
      forces;  ///< Force of each frame; the newest at the end; capacity is never exceeded.
};

struct StandIn {
  std::array<StandInDevice, 2> devices;
  std::atomic<bool> threaded{
      false};  ///< A thread makes the callbacks at 1 kHz, as in the real library; else Tick() does.
  std::atomic<bool> stalled{false};  ///< The scheduler makes no callbacks.
  unsigned long rate_Hz = 0;
  int inits = 0;
  /// Calls that the manual forbids: outside of a frame, on a device that is not open, on a running scheduler.
  std::vector<std::string> misuse;
};

/// Symbols of the library in addition to the driver's: `hd_stand_in_reset` returns the controls in their initial state;
/// `hd_stand_in_tick` is one period of the scheduler.
using StandInReset = StandIn* (*)();
using StandInTick = void (*)();

}  // namespace fulcrum::haptics::testing
