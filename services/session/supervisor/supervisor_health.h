// The supervisor's own Health, at 10 Hz.
#pragma once

#include <cstdint>
#include <memory>

#include "services/base/core/messages.h"
#include "services/nodes/app/health_report.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::supervisor {

class SupervisorHealth {
 public:
  SupervisorHealth(std::unique_ptr<bus::Output<Health>> out, std::uint64_t scene_hash);

  [[nodiscard]] bool IsDue(std::int64_t now_ns) const { return now_ns >= next_ns_; }
  /// Makes the next sample due at once.
  void MakeDue() { next_ns_ = 0; }
  /// The next sample, without metrics and last_error. The sample after it is due one period later.
  [[nodiscard]] Health Make(HealthState state, std::int64_t now_ns);
  /// Truncates `health` to the capacity of the message and publishes it.
  void Write(Health* health);

 private:
  std::unique_ptr<bus::Output<Health>> out_;
  const std::uint64_t scene_hash_;
  bus::Stamper stamper_;
  app::RateMeter rate_;
  std::uint64_t ticks_ = 0;
  std::int64_t next_ns_ = 0;
};

}  // namespace fulcrum::supervisor
