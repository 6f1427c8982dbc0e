// SpaceMice (SpaceNavigator, SpaceMouse, SpacePilot) of 3Dconnexion, read from /dev/hidraw* without a daemon. Their
// reports say zero when the cap is let go, which the kernel's input events leave out for relative axes.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "render_node/input/gamepads.h"
#include "services/base/core/pad_hands.h"

namespace fulcrum::render {

/// Takes one report into the state; others than those of motion and buttons have no effect.
void TakeSpaceMouseReport(std::span<const std::uint8_t> report, PadState* state);

/// Use by one thread at a time.
class SpaceMice {
 public:
  struct Mouse {
    InputDevice device;
    std::string problem;  ///< Not empty: it cannot be read, and why.
    PadState state;
  };

  /// @param sys folder with an entry per HID device. @param dev folder of their files.
  explicit SpaceMice(std::filesystem::path sys = "/sys/class/hidraw", std::filesystem::path dev = "/dev");
  ~SpaceMice();
  SpaceMice(const SpaceMice&) = delete;
  SpaceMice& operator=(const SpaceMice&) = delete;

  /// Reads what has arrived, without waiting; looks for devices once a second.
  void Update();
  /// As of the last Update().
  [[nodiscard]] const std::vector<Mouse>& mice() const { return mice_; }
  /// The first that can be read; null: none.
  [[nodiscard]] const PadState* first() const;
  /// Readable when a report of that one has arrived; -1: there is none.
  [[nodiscard]] int descriptor() const;

 private:
  void Find();
  /// False: it is not there any more.
  static bool Read(int descriptor, PadState* state);

  std::filesystem::path sys_, dev_;
  std::chrono::steady_clock::time_point find_at_;
  std::int64_t devices_ = 0;  ///< Found so far.
  std::vector<Mouse> mice_;
  std::vector<int> descriptors_;  ///< Of mice_, in the same order; -1: cannot be read.
};

}  // namespace fulcrum::render
