// Delays and limits of the restarts of a dead node. Reads no clock: the caller passes the time.
#pragma once

#include <cstdint>
#include <optional>

namespace fulcrum::supervisor {

struct RestartSettings {
  /// A node that ran for this long was healthy [ns]: its next death is the first of a new row.
  std::int64_t healthy_ns = 5'000'000'000;
  /// Delay of the second quick restart [ns]; doubles with each further one.
  std::int64_t first_delay_ns = 200'000'000;
  std::int64_t longest_delay_ns = 2'000'000'000;
  int most_quick_deaths = 5;  ///< The node has failed for good with this many deaths in a row.
};

class RestartPolicy {
 public:
  explicit RestartPolicy(const RestartSettings& settings = {}) : settings_(settings) {}

  /// Delay of the next start [ns]: 0 after a long run, longer with each death of a crash loop. nullopt: no further
  /// start.
  [[nodiscard]] std::optional<std::int64_t> OnDeath(std::int64_t lived_ns);

 private:
  RestartSettings settings_;
  int quick_deaths_ = 0;
};

}  // namespace fulcrum::supervisor
