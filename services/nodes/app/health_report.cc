#include "services/nodes/app/health_report.h"

#include <algorithm>
#include <cmath>

#include "services/transport/bus/gate.h"

namespace fulcrum::app {
namespace {

constexpr std::int64_t kRateWindowNs = 1'000'000'000;

}  // namespace

double RateMeter::Observe(std::int64_t now_ns, std::uint64_t count) {
  // Keeps one observation older than the window, so that the window is a full second.
  while (recent_.size() >= 2 && now_ns - recent_[1].time_ns >= kRateWindowNs) {
    recent_.erase(recent_.begin());
  }
  recent_.push_back({now_ns, count});
  const Observation& oldest = recent_.front();
  if (now_ns <= oldest.time_ns) {
    return 0;
  }
  return 1e9 * static_cast<double>(count - oldest.count) / static_cast<double>(now_ns - oldest.time_ns);
}

TimingSummary Summarise(const runtime::HistogramSnapshot& histogram) {
  const auto us = [](std::int64_t ns) { return 1e-3f * static_cast<float>(ns); };
  return {us(histogram.Quantile(0.5)), us(histogram.Quantile(0.99)), us(histogram.max_ns)};
}

HealthReport::HealthReport(NodeId node, std::int64_t period_ns, std::uint64_t schema_hash, std::uint64_t scene_hash,
                           std::int32_t pid) {
  base_.node = node;
  base_.pid = pid;
  base_.schema_hash = schema_hash;
  base_.scene_hash = scene_hash;
  base_.rate_asked_Hz = 1e9f / static_cast<float>(period_ns);
}

Health HealthReport::Make(std::int64_t now_ns, HealthState state, const runtime::CyclicStats& thread,
                          const std::vector<InputWatch>& inputs, const std::vector<OutputWatch>& outputs) {
  Health health = base_;
  health.state = state;
  health.ticks = thread.ticks;
  health.overruns = thread.overruns;
  health.rate_achieved_Hz = static_cast<float>(rate_.Observe(now_ns, thread.ticks));
  health.step = Summarise(thread.step);
  health.wake = Summarise(thread.wake);
  for (const auto& [topic, stats_of] : inputs) {
    const bus::InputStats stats = stats_of();
    const float age_ms =
        stats.newest_stamp_ns == 0 ? -1.0f : 1e-6f * static_cast<float>(now_ns - stats.newest_stamp_ns);
    health.inputs.push_back({topic, stats.matched, age_ms, stats.received, stats.lost, stats.rejected});
  }
  for (const auto& stats_of : outputs) {
    health.write_failures += stats_of().failed;
  }
  return health;
}

const char* StateName(HealthState state) {
  switch (state) {
    case HealthState::kStarting:
      return "starting";
    case HealthState::kWaiting:
      return "waiting";
    case HealthState::kRunning:
      return "running";
    case HealthState::kDegraded:
      return "degraded";
    case HealthState::kStopping:
      return "ended";
  }
  return "unknown";
}

void FitToMessage(Health* health) {
  health->inputs.resize(std::min(health->inputs.size(), bus::kMaxInputHealths));
  health->metrics.resize(std::min(health->metrics.size(), bus::kMaxMetrics));
  for (Metric& metric : health->metrics) {
    metric.name.resize(std::min(metric.name.size(), bus::kMaxMetricName));
    if (!std::isfinite(metric.value)) {
      metric.value = 0;
    }
  }
  health->last_error.resize(std::min(health->last_error.size(), bus::kMaxErrorText));
}

}  // namespace fulcrum::app
