// One handle: bytes in, jaw angle and the state of its link out. Knows neither ports nor clocks.
#pragma once

#include <span>

#include "handle_bridge/estimator/jaw_estimator.h"
#include "handle_bridge/protocol/jaw_line.h"
#include "handle_bridge/protocol/line_framer.h"
#include "handle_bridge/protocol/link_monitor.h"

namespace fulcrum::handle_bridge {

struct JawChannelSettings {
  JawLineSettings line;
  JawEstimatorSettings estimator;
  JawCalibration calibration;
};

class JawChannel {
 public:
  explicit JawChannel(const JawChannelSettings& settings);

  /// One tick of the open link, `dt_s` after the last one.
  void Tick(std::span<const char> bytes, double dt_s) noexcept;
  /// Another unit, or the first one that is known: from now on its calibration.
  void SetUnit(const JawChannelSettings& settings) noexcept;
  /// A new connection: the half line and the suspicions of the old one are void, the angle stays.
  void Reconnected() noexcept;
  /// One tick without connection: the angle is held.
  void Disconnected() noexcept;

  [[nodiscard]] bool present() const noexcept { return estimator_.started(); }
  [[nodiscard]] JawEstimate estimate() const noexcept { return estimator_.estimate(); }
  [[nodiscard]] int code() const noexcept { return code_; }
  [[nodiscard]] float quality() const noexcept { return connected_ ? monitor_.quality() : 0.0f; }
  [[nodiscard]] LinkState state() const noexcept;
  /// Of the last tick.
  [[nodiscard]] const LinkCounts& tick_counts() const noexcept { return tick_counts_; }
  /// Since the start.
  [[nodiscard]] const LinkCounts& totals() const noexcept { return totals_; }

 private:
  void TakeLine(LineFramer::Event event) noexcept;
  void HoldAngle() noexcept;

  LineFramer framer_;
  JawLineGate gate_;
  WiringMonitor wiring_;
  LinkMonitor monitor_;
  JawEstimator estimator_;
  LinkCounts tick_counts_;
  LinkCounts totals_;
  int code_ = 0;
  double owed_lines_ = 0;  ///< Sample periods that have passed without a line being seen for them.
  double blind_s_ = 0;     ///< Since the last good line.
  bool holding_ = false;
  bool connected_ = false;
};

}  // namespace fulcrum::handle_bridge
