// Finds the speed at which a link's lines are valid: what tells a wrong baud rate from garbage, and mends it.
#pragma once

#include <array>
#include <cstddef>

#include "handle_bridge/protocol/link_monitor.h"

namespace fulcrum::handle_bridge {

/// Usual speeds of serial lines [baud], most usual first.
inline constexpr std::array kUsualBauds = {115200, 57600, 38400, 230400, 19200, 9600, 460800, 921600};

/// When bytes come but no valid line, the other usual speeds are tried, a quarter of a second each. Every other try is
/// at the speed that is known (the cart's, or the last that worked), so that a link that was only disturbed is back
/// within half a second of the end of the disturbance.
class BaudSearch {
 public:
  static constexpr double kDisturbed_s = 1.0;   ///< Without a valid line, after there were some.
  static constexpr double kTry_s = 0.25;        ///< 12 lines of a pedal, 100 of a handle.
  static constexpr std::size_t kMinBytes = 16;  ///< Half a line before a pause is no garbage.

  /// @param baud the cart's.
  explicit BaudSearch(int baud) : cart_baud_(baud), known_baud_(baud), baud_(baud) {}

  /// One tick of the open link at baud(). True when baud() has changed: the link is to be opened anew.
  bool Add(const LinkCounts& counts, double dt_s) noexcept;

  /// Speed to be used now.
  [[nodiscard]] int baud() const noexcept { return baud_; }
  /// No valid line at the known speed, and none at another one yet.
  [[nodiscard]] bool searching() const noexcept { return searching_; }
  /// Valid lines came last at another speed than the cart's.
  [[nodiscard]] bool found_other() const noexcept { return known_baud_ != cart_baud_; }
  /// A new connection: the time without valid lines begins anew.
  void Reconnected() noexcept;

 private:
  int cart_baud_, known_baud_, baud_;
  std::size_t next_ = 0;   ///< Into kUsualBauds.
  std::size_t bytes_ = 0;  ///< Since the last valid line or change of speed.
  double blind_s_ = 0;     ///< The same as time.
  bool settled_ = false;   ///< Valid lines have come on this connection at this speed.
  bool searching_ = false;
};

}  // namespace fulcrum::handle_bridge
