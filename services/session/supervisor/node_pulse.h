// Whether a node works, by its Health: one without Health is silent, one whose ticks stand still is stuck. Reads no
// clock: the caller passes the time.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum::supervisor {

class NodePulse {
 public:
  /// A process was started.
  void Start(std::int64_t now_ns);
  void Add(const Health& health, std::int64_t now_ns);
  /// Finds nothing wrong before `until_ns`, because the supervisor itself was suspended.
  void ResetTimeouts(std::int64_t until_ns);

  /// Why the node must be killed, as text; nullptr: it works, or has time left.
  /// @param has_spare another process can take its place at once.
  [[nodiscard]] const char* Complaint(bool has_spare, std::int64_t now_ns) const;
  [[nodiscard]] bool has_reported() const { return has_reported_; }
  /// Its newest Health says that it runs.
  [[nodiscard]] bool steps() const { return steps_; }

 private:
  std::int64_t timeouts_reset_ns_ = 0;  ///< No complaint before this time.
  std::int64_t started_ns_ = 0, health_ns_ = 0, progress_ns_ = 0;
  std::int64_t period_ns_ = 0;
  std::uint64_t ticks_ = 0;
  bool has_reported_ = false;
  bool steps_ = false;
  bool waits_for_disk_ = false;  ///< In its steps.
};

}  // namespace fulcrum::supervisor
