// The session of a domain as seen on its bus, started by this console or elsewhere.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "services/base/core/messages.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::console {

/// One sample of the plotted figures.
struct PlotPoint {
  std::uint64_t number = 0;  ///< Grows over all sessions.
  double time_s = 0;         ///< Session time [s].
  double temperature_C = 0;
  double force_N[kMaxTools] = {};  ///< Of the tissue on the tools.
};

/// Name of the figure of physics_node's Health that holds the force of the tissue on a tool.
[[nodiscard]] inline std::string ForceMetric(std::size_t tool) { return "force" + std::to_string(tool) + "_N"; }

class SessionWatch {
 public:
  static constexpr double kPlotSpan_s = 60;

  explicit SessionWatch(int domain) : domain_(domain) {}

  /// Joins the bus when a session begins, leaves it when the session ends, and reads the samples that have arrived.
  void Turn(std::int64_t now_ns);

  /// Secret number of the running session; 0: none.
  [[nodiscard]] std::uint64_t session() const { return seen_ ? seen_->session : 0; }
  /// Its participant, while alive(), for further ports.
  [[nodiscard]] bus::DdsParticipant& participant() { return seen_->view.participant(); }
  /// Called before the bus of a session is left: its ports must be gone after that.
  void OnLeave(std::function<void()> leave) { leave_ = std::move(leave); }

  /// True when a supervisor runs in the domain.
  [[nodiscard]] bool alive() const { return seen_ != nullptr; }
  /// True when SceneManifest was published: the nodes are ready.
  [[nodiscard]] bool begun() const { return alive() && seen_->view.manifest().session_start_ns != 0; }
  /// Reason why the bus could not be joined; empty when it could.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

  // Valid while alive():
  [[nodiscard]] const Health& health(NodeId node) const { return seen_->view.health(node); }
  [[nodiscard]] const SceneManifest& manifest() const { return seen_->view.manifest(); }
  /// True when the supervisor's Health lists this node as part of the session.
  [[nodiscard]] bool expects(NodeId node) const;
  [[nodiscard]] int restarts(NodeId node) const;
  /// Time at which the count of its restarts last grew [ns]; 0: never.
  [[nodiscard]] std::int64_t restarted_ns(NodeId node) const;
  /// Arrival of the last event of that kind [ns]; 0: none.
  [[nodiscard]] std::int64_t event_ns(ThermalEventKind kind) const;

  /// Points of the last minute of the running or last session.
  [[nodiscard]] const std::deque<PlotPoint>& points() const { return points_; }

 private:
  struct Seen {
    explicit Seen(int domain)
        : view(domain, bus::kConsoleIdentity), events(view.participant().MakeInput<ThermalEvent>()) {}
    std::uint64_t session = 0;  ///< Its secret number: another one is another session.
    supervisor::SessionView view;
    std::unique_ptr<bus::Input<ThermalEvent>> events;
    std::map<ThermalEventKind, std::int64_t> event_ns;
    std::array<int, kNodeCount> restarts{};
    std::array<std::int64_t, kNodeCount> restarted_ns{};
    std::int64_t next_point_ns = 0;
  };
  void TakePoint(std::int64_t now_ns);
  void Leave();

  std::function<void()> leave_ = [] {};
  int domain_;
  std::unique_ptr<Seen> seen_;
  std::string trouble_;
  std::deque<PlotPoint> points_;
  std::uint64_t last_number_ = 0;
};

/// Name of a node's restart count in the supervisor's Health, for example "restarts_physics_node".
[[nodiscard]] std::string RestartMetric(NodeId node);

}  // namespace fulcrum::console
