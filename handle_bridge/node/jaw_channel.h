// One handle: bytes in, jaw angle and the state of its link out. Independent of ports and clocks.
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
  /// Sets the calibration of a newly connected unit.
  void SetUnit(const JawChannelSettings& settings) noexcept;
  /// Call after a reconnection: discards the incomplete line and the fault counters of the old connection, keeps the
  /// angle.
  void Reconnected() noexcept;
  /// One tick without connection: the angle is held.
  void Disconnected() noexcept;

  [[nodiscard]] bool present() const noexcept { return estimator_.started(); }
  [[nodiscard]] JawEstimate estimate() const noexcept { return estimator_.estimate(); }
  [[nodiscard]] int code() const noexcept { return code_; }
  [[nodiscard]] float quality() const noexcept { return connected_ ? monitor_.quality() : 0.0f; }
  [[nodiscard]] LinkState state() const noexcept;
  /// Counts of the last tick.
  [[nodiscard]] const LinkCounts& tick_counts() const noexcept { return tick_counts_; }
  /// Counts since the start.
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
  double owed_lines_ = 0;  ///< Sample periods for which no line has arrived yet.
  double blind_s_ = 0;     ///< Time since the last good line [s].
  bool holding_ = false;
  bool connected_ = false;
};

}  // namespace fulcrum::handle_bridge
