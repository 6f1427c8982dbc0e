#include "services/session/supervisor/supervisor_health.h"

#include <unistd.h>

#include <utility>

#include "services/base/core/tick.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/schema.h"

namespace fulcrum::supervisor {
namespace {

constexpr std::int64_t kHealthPeriod_ns = kSecond_ns / 10;

}  // namespace

SupervisorHealth::SupervisorHealth(std::unique_ptr<bus::Output<Health>> out, std::uint64_t scene_hash)
    : out_(std::move(out)), scene_hash_(scene_hash), stamper_(runtime::MonotonicNs()) {}

Health SupervisorHealth::Make(HealthState state, std::int64_t now_ns) {
  next_ns_ = now_ns + kHealthPeriod_ns;
  Health health;
  health.stamp = stamper_.Next(now_ns);
  health.node = NodeId::kSupervisor;
  health.state = state;
  health.pid = ::getpid();
  health.schema_hash = bus::SchemaHash();
  health.scene_hash = scene_hash_;
  health.rate_asked_Hz = 1e9f / static_cast<float>(kHealthPeriod_ns);
  health.rate_achieved_Hz = static_cast<float>(rate_.Observe(now_ns, ++ticks_));
  health.ticks = ticks_;
  return health;
}

void SupervisorHealth::Write(Health* health) {
  app::FitToMessage(health);
  out_->Write(*health);
}

}  // namespace fulcrum::supervisor
