// When a dead node is started again, and when no longer. Pure: the caller gives the time.
#pragma once

#include <cstdint>
#include <optional>

namespace fulcrum::supervisor {

struct RestartSettings {
  /// A node that lived this long was healthy: its next death starts the count anew.
  std::int64_t healthy_ns = 5'000'000'000;
  std::int64_t first_delay_ns = 200'000'000;  ///< Before the second quick restart; doubles with each further one.
  std::int64_t longest_delay_ns = 2'000'000'000;
  int most_quick_deaths = 5;  ///< The node has failed for good with this many deaths in a row.
};

class RestartPolicy {
 public:
  explicit RestartPolicy(const RestartSettings& settings = {}) : settings_(settings) {}

  /// How long to wait before the next start: nothing after a long life, ever longer in a crash loop. nullopt: give up.
  [[nodiscard]] std::optional<std::int64_t> OnDeath(std::int64_t lived_ns);

 private:
  RestartSettings settings_;
  int quick_deaths_ = 0;
};

}  // namespace fulcrum::supervisor
