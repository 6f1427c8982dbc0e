#include "services/session/console/session_watch.h"

#include <exception>

namespace fulcrum::console {
namespace {

constexpr std::int64_t kPointPeriod_ns = 200'000'000;

}  // namespace

std::string RestartMetric(NodeId node) { return std::string("restarts_") + NodeName(node); }

void SessionWatch::Turn(std::int64_t now_ns) {
  const std::uint64_t session = supervisor::RunningSession(domain_);
  if (session == 0 || (seen_ && seen_->session != session)) {
    Leave();
    return;
  }
  if (!seen_) {
    try {
      seen_ = std::make_unique<Seen>(domain_);
      seen_->session = session;
      trouble_.clear();
      points_.clear();
    } catch (const std::exception& error) {
      trouble_ = error.what();
      return;
    }
  }
  seen_->view.Update();
  trouble_ = seen_->view.mismatch();
  ThermalEvent event;
  while (seen_->events->TakeNext(&event)) {
    seen_->event_ns[event.kind] = now_ns;
  }
  for (int i = 0; i < kNodeCount; ++i) {
    const auto node = static_cast<NodeId>(i);
    const auto at = static_cast<std::size_t>(i);
    const int count = static_cast<int>(supervisor::MetricOf(health(NodeId::kSupervisor), RestartMetric(node)));
    if (count > seen_->restarts[at]) seen_->restarted_ns[at] = now_ns;
    seen_->restarts[at] = count;
  }
  if (begun() && now_ns >= seen_->next_point_ns) TakePoint(now_ns);
}

void SessionWatch::Leave() {
  if (!seen_) return;
  leave_();
  seen_.reset();
}

void SessionWatch::TakePoint(std::int64_t now_ns) {
  seen_->next_point_ns = now_ns + kPointPeriod_ns;
  const double time_s = 1e-9 * static_cast<double>(now_ns - manifest().session_start_ns);
  const Health& thermal = health(NodeId::kThermal);
  const Health& physics = health(NodeId::kPhysics);
  const auto fresh = [now_ns](const Health& h) {
    return h.pid != 0 && now_ns - h.stamp.stamp_ns < supervisor::kSilence_ns;
  };
  if (time_s < 0 || (!fresh(thermal) && !fresh(physics))) return;
  PlotPoint point;
  point.number = ++last_number_;
  point.time_s = time_s;
  point.temperature_C = supervisor::MetricOf(thermal, "temperature_C");
  for (std::size_t i = 0; i < kMaxTools; ++i) point.force_N[i] = supervisor::MetricOf(physics, ForceMetric(i));
  points_.push_back(point);
  while (points_.front().time_s < time_s - kPlotSpan_s) points_.pop_front();
}

bool SessionWatch::expects(NodeId node) const {
  return health(node).pid != 0 || supervisor::MetricOf(health(NodeId::kSupervisor), RestartMetric(node), -1) >= 0;
}

int SessionWatch::restarts(NodeId node) const { return seen_->restarts[static_cast<std::size_t>(node)]; }

std::int64_t SessionWatch::restarted_ns(NodeId node) const {
  return seen_->restarted_ns[static_cast<std::size_t>(node)];
}

std::int64_t SessionWatch::event_ns(ThermalEventKind kind) const {
  const auto found = seen_->event_ns.find(kind);
  return found == seen_->event_ns.end() ? 0 : found->second;
}

}  // namespace fulcrum::console
