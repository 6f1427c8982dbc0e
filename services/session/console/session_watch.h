// The session of a domain as it is seen on its bus, whoever started it.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>

#include "services/base/core/messages.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::console {

/// One moment of what is plotted.
struct PlotPoint {
  std::uint64_t number = 0;  ///< Counts on over sessions.
  double time_s = 0;         ///< Session time.
  double temperature_C = 0;
  double force_N[kMaxTools] = {0, 0};
};

class SessionWatch {
 public:
  static constexpr double kPlotSpan_s = 60;

  explicit SessionWatch(int domain) : domain_(domain) {}

  /// Joins the bus when a session begins, leaves it when that ends, takes what has come.
  void Turn(std::int64_t now_ns);

  /// A supervisor runs in the domain.
  [[nodiscard]] bool alive() const { return seen_ != nullptr; }
  /// The session has been announced: its nodes were ready.
  [[nodiscard]] bool begun() const { return alive() && seen_->view.manifest().session_start_ns != 0; }
  /// Why the bus could not be joined; empty when it could.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

  // While alive:
  [[nodiscard]] const Health& health(NodeId node) const { return seen_->view.health(node); }
  [[nodiscard]] const SceneManifest& manifest() const { return seen_->view.manifest(); }
  /// The supervisor said that this node belongs to the session.
  [[nodiscard]] bool expects(NodeId node) const;
  [[nodiscard]] int restarts(NodeId node) const;
  /// When the number of its restarts last grew; 0: it has not.
  [[nodiscard]] std::int64_t restarted_ns(NodeId node) const;
  /// When an event of that kind last came; 0: none.
  [[nodiscard]] std::int64_t event_ns(ThermalEventKind kind) const;

  /// Those of the last minute, of the session that runs or ended last.
  [[nodiscard]] const std::deque<PlotPoint>& points() const { return points_; }

 private:
  struct Seen {
    explicit Seen(int domain) : view(domain), events(view.participant().MakeInput<ThermalEvent>()) {}
    supervisor::SessionView view;
    std::unique_ptr<bus::Input<ThermalEvent>> events;
    std::map<ThermalEventKind, std::int64_t> event_ns;
    std::array<int, kNodeCount> restarts{};
    std::array<std::int64_t, kNodeCount> restarted_ns{};
    std::int64_t next_point_ns = 0;
  };
  void TakePoint(std::int64_t now_ns);

  int domain_;
  std::unique_ptr<Seen> seen_;
  std::string trouble_;
  std::deque<PlotPoint> points_;
  std::uint64_t last_number_ = 0;
};

/// "restarts_physics_node": what the supervisor calls a node's count in its Health.
[[nodiscard]] std::string RestartMetric(NodeId node);

}  // namespace fulcrum::console
