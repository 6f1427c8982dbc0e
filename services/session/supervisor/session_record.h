// The record of a session: figures of each node, curves over session time, events, restarts. The supervisor adds
// samples; summary, table and report read it. It uses no clock and no bus.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/session/supervisor/script_outlook.h"
#include "services/transport/bus/security.h"

namespace fulcrum::supervisor {

struct CurvePoint {
  double time_s;
  double value;
};
/// A figure over session time. When the curve is full, every second point is removed and every second sample skipped
/// from then on.
class Curve {
 public:
  static constexpr std::size_t kMostPoints = 6000;
  void Add(double time_s, double value);
  [[nodiscard]] const std::vector<CurvePoint>& points() const { return points_; }
  [[nodiscard]] double max() const { return max_; }

 private:
  std::vector<CurvePoint> points_;
  double max_ = 0;
  std::size_t stride_ = 1, skipped_ = 0;
};

/// One node over the whole session, restarts included.
struct NodeFigures {
  bool seen = false;
  bool failed = false;  ///< For good.
  std::int32_t pid = 0;
  HealthState state = HealthState::kStarting;
  double rate_asked_Hz = 0;
  double rate_achieved_Hz = 0;  ///< Ticks per second of session time, time while the node was dead included.
  double rate_last_second_Hz = 0;
  TimingSummary step;  ///< p50 and p99 since the last start, max since the first.
  TimingSummary wake;
  std::uint64_t ticks = 0;
  std::uint64_t overruns = 0;
  std::uint64_t drops = 0;  ///< Samples lost, rejected or not written.
  int restarts = 0;
  int crashes = 0;              ///< Restarts after a death that no command asked for.
  double longest_rejoin_s = 0;  ///< From a death to the first Health "running".
  bool begun = false;           ///< It has run in this session.
  bool stepped = false;         ///< Its newest process has completed a step.
  double heard_s = 0;           ///< Session time of the newest Health.
  double progress_s = 0;        ///< ... and of the newest one, running or degraded, with further ticks.
  /// Session time of the death after which no process has run yet; negative: it lives.
  double dead_since_s = -1;
  bool ended_by_command = false;  ///< That death was asked for.
  std::string last_error;
};

struct RestartRecord {
  double time_s = 0;
  NodeId node = NodeId::kSupervisor;
  std::string cause;
  bool asked = false;    ///< By command.
  double rejoin_s = -1;  ///< Negative: did not rejoin.
};

struct EventRecord {
  double time_s = 0;
  ThermalEventKind kind = ThermalEventKind::kContact;
  double temperature_C = 0;
};
/// A participant or endpoint that was refused on the bus.
struct RefusalRecord {
  double time_s = 0;
  std::string what;
};
/// "cut", "steam", "ureter warning", …
[[nodiscard]] const char* EventName(ThermalEventKind kind);

class SessionRecord {
 public:
  void AddHealth(double time_s, const Health& health);
  void AddEvent(const ThermalEvent& event);
  /// @param asked by a command of the operator.
  void AddDeath(double time_s, NodeId node, const std::string& cause, bool for_good, bool asked = false);
  /// @param refusals all since the start; those that are new get `time_s`.
  void AddRefusals(double time_s, const bus::Refusals& refusals);

  [[nodiscard]] const NodeFigures& node(NodeId id) const { return nodes_[static_cast<std::size_t>(id)].figures; }
  /// Curve of a metric, from the node that reports it; empty when none does.
  [[nodiscard]] const Curve& curve(const std::string& metric) const;
  /// Newest value of a metric; 0 when none was reported.
  [[nodiscard]] double last(const std::string& metric) const {
    const auto& points = curve(metric).points();
    return points.empty() ? 0.0 : points.back().value;
  }
  /// Highest value of a metric; 0 when none was reported.
  [[nodiscard]] double peak(const std::string& metric) const { return curve(metric).max(); }
  [[nodiscard]] const std::vector<RestartRecord>& restarts() const { return restarts_; }
  /// The first kMostEvents events.
  [[nodiscard]] const std::vector<EventRecord>& events() const { return events_; }
  [[nodiscard]] const std::map<ThermalEventKind, std::uint64_t>& event_counts() const { return event_counts_; }
  /// Dead surface by solid [m^2], of those that were burnt.
  [[nodiscard]] const std::map<std::uint8_t, double>& burnt_m2() const { return burnt_m2_; }

  [[nodiscard]] const bus::Refusals& refusals() const { return refusals_; }
  [[nodiscard]] const std::vector<RefusalRecord>& refused() const { return refused_; }

  static constexpr std::size_t kMostEvents = 500;

 private:
  struct NodeTrack {
    NodeFigures figures;
    std::uint64_t epoch = 0;
    double first_time_s = 0;
    // Counters of a node start at 0 with each process: `base_` has the sum of earlier processes.
    std::uint64_t base_ticks = 0, base_overruns = 0, base_drops = 0;
    std::uint64_t live_ticks = 0, live_overruns = 0, live_drops = 0;
  };

  std::array<NodeTrack, kNodeCount> nodes_{};
  std::map<std::string, Curve> curves_;
  std::vector<RestartRecord> restarts_;
  std::vector<EventRecord> events_;
  bus::Refusals refusals_;
  std::vector<RefusalRecord> refused_;
  std::map<ThermalEventKind, std::uint64_t> event_counts_;
  std::map<std::uint8_t, double> burnt_m2_;
};

/// Thresholds below which an effect counts as missing: above rounding and relaxation, far below any scripted action.
inline constexpr double kLeastDisplacement_mm = 0.5;
inline constexpr double kLeastCut_mm = 0.5;

/// The first demanded effect that the session does not show, as text; empty when it shows all.
[[nodiscard]] std::string MissingFrom(const SessionRecord& record, const ScriptDemands& demands);

}  // namespace fulcrum::supervisor
