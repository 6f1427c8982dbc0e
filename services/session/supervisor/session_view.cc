#include "services/session/supervisor/session_view.h"

#include <algorithm>
#include <cstdio>

#include "services/base/runtime/cyclic_thread.h"
#include "services/nodes/app/health_report.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/outcome.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::supervisor {
namespace {

std::string Milliseconds(float us) { return Fixed(1e-3 * static_cast<double>(us), 2); }

/// Age of the oldest input that has a writer, as "ToolState 3 ms".
std::string OldestInput(const Health& health) {
  const InputHealth* oldest = nullptr;
  for (const InputHealth& input : health.inputs) {
    if (input.matched && input.age_ms >= 0 && (oldest == nullptr || input.age_ms > oldest->age_ms)) {
      oldest = &input;
    }
  }
  if (oldest == nullptr) {
    return "–";
  }
  return std::string(bus::TopicLabel(oldest->topic)) + " " + Fixed(static_cast<double>(oldest->age_ms), 0) + " ms";
}

/// "\nlink: …" where some nodes run on another host.
std::string LinkFigures(const Health& supervisor) {
  std::string text;
  for (const Metric& metric : supervisor.metrics) {
    constexpr std::string_view kLink = "link_";
    if (!metric.name.starts_with(kLink)) continue;
    text += text.empty() ? "\nlink: " : " · ";
    text += metric.name.substr(kLink.size()) + " " + Fixed(metric.value, 2);
  }
  if (!text.empty() && !supervisor.last_error.empty() && MetricOf(supervisor, "faults") == 0)
    text += "\n      └ " + supervisor.last_error;
  return text;
}

}  // namespace

std::uint64_t RunningSession(int domain) {
  return DomainGuard::IsHeld(domain) ? bus::AnnouncedSession(bus::SharedMemoryDirectory(domain)) : 0;
}

double MetricOf(const Health& health, std::string_view name, double missing) {
  for (const Metric& metric : health.metrics) {
    if (metric.name == name) {
      return metric.value;
    }
  }
  return missing;
}

std::uint64_t DropsOf(const Health& health) {
  std::uint64_t drops = health.write_failures;
  for (const InputHealth& input : health.inputs) {
    drops += input.lost + input.rejected;
  }
  return drops;
}

SessionView::SessionView(int domain, std::string_view identity)
    : participant_(bus::ToolSettings(domain, identity)),
      healths_(participant_.MakeInput<Health>()),
      manifests_(participant_.MakeInput<SceneManifest>()) {}

void SessionView::Update() {
  Health health;
  while (healths_->TakeNext(&health)) {
    Health& newest = newest_[static_cast<std::size_t>(health.node)];
    // Of a standby pair, the process that leads is shown.
    const bool follows = health.state == HealthState::kWaiting && newest.pid != health.pid &&
                         newest.state == HealthState::kRunning &&
                         health.stamp.stamp_ns - newest.stamp.stamp_ns < kSilence_ns;
    if (health.stamp.stamp_ns >= newest.stamp.stamp_ns && !follows) {
      newest = health;
    }
    has_supervisor_ |= health.node == NodeId::kSupervisor;
  }
  (void)manifests_->TakeLatest(&manifest_);
}

int SessionView::heard() const {
  return static_cast<int>(std::ranges::count_if(newest_, [](const Health& health) { return health.pid != 0; }));
}

std::string SessionView::Text() const {
  const Health& supervisor = newest_[static_cast<std::size_t>(NodeId::kSupervisor)];
  const double refused = MetricOf(supervisor, "refused");
  const std::int64_t now = runtime::MonotonicNs();
  std::string text;
  if (manifest_.session_start_ns == 0) {
    text = "session is starting\n";
  } else {
    const double end_s = MetricOf(supervisor, "session_end_s");
    text = "scene \"" + manifest_.scene_name + "\", session " + manifest_.session_id + ", " +
           Fixed(1e-9 * static_cast<double>(now - manifest_.session_start_ns), 1) +
           (end_s > 0 ? " of " + Fixed(end_s, 1) : std::string()) + " s\n";
  }
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), "\n%-14s %7s  %-9s %15s %24s %9s %6s %8s  %s\n", "node", "pid", "state",
                "rate / asked Hz", "step p50/p99/max ms", "overruns", "drops", "restarts", "oldest input");
  text += line.data();
  std::string figures = LinkFigures(supervisor);
  for (const Health& health : newest_) {
    if (health.pid == 0 || health.node == NodeId::kSupervisor) {
      continue;
    }
    const std::uint64_t drops = DropsOf(health);
    const bool stale = now - health.stamp.stamp_ns > kSilence_ns;
    const std::string rate = Fixed(static_cast<double>(health.rate_achieved_Hz), 1) + " / " +
                             Fixed(static_cast<double>(health.rate_asked_Hz), 0);
    const std::string step = Milliseconds(health.step.p50_us) + "/" + Milliseconds(health.step.p99_us) + "/" +
                             Milliseconds(health.step.max_us);
    const double restarts = MetricOf(supervisor, std::string("restarts_") + NodeName(health.node));
    std::snprintf(line.data(), line.size(), "%-14s %7d  %-9s %15s %24s %9llu %6llu %8.0f  %s\n", NodeName(health.node),
                  health.pid, stale ? "silent" : app::StateName(health.state), rate.c_str(), step.c_str(),
                  static_cast<unsigned long long>(health.overruns), static_cast<unsigned long long>(drops), restarts,
                  OldestInput(health).c_str());
    text += line.data();
    if (!health.last_error.empty()) {
      text += "               └ " + health.last_error + "\n";
    }
    std::string own;
    for (const Metric& metric : health.metrics) {
      own += own.empty() ? std::string("\n") + NodeName(health.node) + ": " : " · ";
      own += metric.name + " " + Fixed(metric.value, 2);
    }
    figures += own;
  }
  const double faults = MetricOf(supervisor, "faults");
  if (faults > 0) {
    text += "\nnot well: " + Fixed(faults, 0) + " faults; newest: " + supervisor.last_error + "\n";
  }
  if (refused > 0) {
    text += "\nrefused on the bus: " + Fixed(refused, 0) +
            (faults > 0 ? std::string() : "; newest: " + supervisor.last_error) + "\n";
  }
  return text + figures + "\n";
}

}  // namespace fulcrum::supervisor
