// The verdict of a session: what in its record is a fault. Uses no clock and no bus. The rules are in DESIGN.md.
#pragma once

#include <array>
#include <set>
#include <string>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/session/supervisor/session_record.h"

namespace fulcrum::supervisor {

struct Fault {
  double time_s = 0;  ///< Session time at which it was found [s]; negative before time 0.
  std::string text;   ///< One line.
  ExitCode code = ExitCode::kFailure;
};

/// How much less than asked a node may do in a session that is well.
struct NodeLimits {
  double least_rate = 0;   ///< Share of the rate asked for, over kRateWindow_s.
  double most_missed = 1;  ///< Share of the periods of the session that were skipped.
};
[[nodiscard]] NodeLimits LimitsOf(NodeId node);

/// A node whose ticks do not advance for longer is silent or stuck [s]: one second, and two periods of the Health that
/// shows it.
inline constexpr double kLongestGap_s = 1.2;
/// A node of another host is restarted over there, which this supervisor sees as a gap only.
inline constexpr double kLongestRemoteGap_s = 5;
/// ... and of a slow node, in periods.
inline constexpr double kLongestGap_periods = 3;
/// A node that has died must run again, and every node must have begun, within this time [s].
inline constexpr double kLongestAbsence_s = 5;
inline constexpr double kRateWindow_s = 10;
/// A rate over a shorter time is not judged [s]: it is dominated by the start.
inline constexpr double kShortestRate_s = 3;

class Verdict {
 public:
  /// The nodes of the session, and how often each may die and be started again.
  struct Session {
    std::vector<NodeId> nodes;
    std::vector<NodeId> remote;
    int restarts = 3;
  };
  void Begin(Session session) { session_ = std::move(session); }

  /// Adds a fault unless one with the same text is known.
  void Fail(double time_s, ExitCode code, const std::string& text) { Add(text, {time_s, text, code}); }
  /// Stage of the loop: finds the faults that the record shows at session time `time_s`. Each is found once.
  void Watch(double time_s, const SessionRecord& record);
  /// The rates and missed periods of the whole session, after its last Health.
  void Close(double time_s, const SessionRecord& record);

  [[nodiscard]] const std::vector<Fault>& faults() const { return faults_; }
  /// kDone: all well. The code of the first fault with a code of its own, else kFailure.
  [[nodiscard]] ExitCode code() const;

 private:
  /// Ticks of a node since a session time, for its rate.
  struct Window {
    double begin_s = -1;  ///< Negative: the node does not run.
    std::uint64_t ticks = 0;
    int restarts = 0;
  };
  void Add(const std::string& key, const Fault& fault);
  void WatchProgress(NodeId node, double longest_gap_s, double time_s, const NodeFigures& figures);
  void WatchRate(NodeId node, double time_s, const NodeFigures& figures);
  void JudgeRate(NodeId node, double time_s, const NodeFigures& figures);
  void WatchRestarts(NodeId node, double time_s, const SessionRecord& record);
  void WatchRecorder(double time_s, const SessionRecord& record);
  void WatchMetrics(double time_s, const SessionRecord& record);

  Session session_;
  std::array<Window, kNodeCount> windows_{};
  double last_s_ = 0;           ///< Session time of the last Watch.
  double no_gap_before_s_ = 0;  ///< Until this session time no gap is the fault of a node.
  std::set<std::string> known_;
  std::vector<Fault> faults_;
};

}  // namespace fulcrum::supervisor
