#include "services/base/runtime/service_notify.h"

#include <systemd/sd-daemon.h>

#include <cstdlib>

namespace fulcrum::runtime {
namespace {

constexpr std::int64_t kStatusPeriodNs = 1'000'000'000;
// Several notifications per watchdog period, so that one missed because of a long step has no effect.
constexpr std::int64_t kBeatsPerWatchdog = 4;

std::optional<std::int64_t> BeatPeriod() {
  std::uint64_t watchdog_us = 0;
  if (::sd_watchdog_enabled(0, &watchdog_us) <= 0) return std::nullopt;
  return static_cast<std::int64_t>(watchdog_us) * 1000 / kBeatsPerWatchdog;
}

}  // namespace

bool Progress::Advanced(const std::vector<std::uint64_t>& counters) {
  if (counters.size() == last_.size()) {
    for (std::size_t i = 0; i < counters.size(); ++i) {
      if (counters[i] == last_[i]) return false;
    }
  }
  last_ = counters;
  return true;
}

ServiceNotify::ServiceNotify() : enabled_(std::getenv("NOTIFY_SOCKET") != nullptr), beat_period_ns_(BeatPeriod()) {}

void ServiceNotify::Ready() {
  if (enabled_) ::sd_notify(0, "READY=1");
}

void ServiceNotify::Update(std::int64_t now_ns, const std::vector<std::uint64_t>& counters, const std::string& status) {
  if (!enabled_) return;
  if (beat_period_ns_ && now_ns - last_beat_ns_ >= *beat_period_ns_ && progress_.Advanced(counters)) {
    last_beat_ns_ = now_ns;
    ::sd_notify(0, "WATCHDOG=1");
  }
  if (status != status_ && now_ns - last_status_ns_ >= kStatusPeriodNs) {
    last_status_ns_ = now_ns;
    status_ = status;
    ::sd_notify(0, ("STATUS=" + status).c_str());
  }
}

void ServiceNotify::Stopping() {
  if (enabled_) ::sd_notify(0, "STOPPING=1");
}

}  // namespace fulcrum::runtime
