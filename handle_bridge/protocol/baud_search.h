// Finds the baud rate at which a link's lines are valid. So a wrong baud rate is distinguished from garbage, and
// corrected.
#pragma once

#include <array>
#include <cstddef>

#include "handle_bridge/protocol/link_monitor.h"

namespace fulcrum::handle_bridge {

/// Common speeds of serial lines [baud], most common first.
inline constexpr std::array kUsualBauds = {115200, 57600, 38400, 230400, 19200, 9600, 460800, 921600};

/// If bytes arrive but no valid line, the other common speeds are tried for a quarter of a second each. Every second
/// try is at the known speed (the cart's, or the last one with valid lines), so that a link that was only disturbed
/// works again within half a second after the disturbance.
class BaudSearch {
 public:
  /// Time without a valid line that starts a search, on a link that had valid lines.
  static constexpr double kDisturbed_s = 1.0;
  static constexpr double kTry_s = 0.25;  ///< Duration of a try: 12 lines of a pedal, 100 of a handle.
  /// Fewer bytes, such as half a line before a pause, do not count as garbage.
  static constexpr std::size_t kMinBytes = 16;

  /// @param baud baud rate of the cart file.
  explicit BaudSearch(int baud) : cart_baud_(baud), known_baud_(baud), baud_(baud) {}

  /// Evaluates one tick of the open link at baud(). Returns true if baud() has changed; the link must then be reopened.
  bool Add(const LinkCounts& counts, double dt_s) noexcept;

  /// Speed to use.
  [[nodiscard]] int baud() const noexcept { return baud_; }
  /// True while there is no valid line at the known speed and none yet at another one.
  [[nodiscard]] bool searching() const noexcept { return searching_; }
  /// True if the last valid lines had another speed than the cart's.
  [[nodiscard]] bool found_other() const noexcept { return known_baud_ != cart_baud_; }
  /// Call after a reconnection: resets the time without valid lines.
  void Reconnected() noexcept;

 private:
  int cart_baud_, known_baud_, baud_;
  std::size_t next_ = 0;   ///< Index of the next speed in kUsualBauds.
  std::size_t bytes_ = 0;  ///< Bytes since the last valid line or change of speed.
  double blind_s_ = 0;     ///< Time since then [s].
  bool settled_ = false;   ///< Valid lines have arrived on this connection at this speed.
  bool searching_ = false;
};

}  // namespace fulcrum::handle_bridge
