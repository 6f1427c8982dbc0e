// Drops samples of other sessions. Internal to services/transport/bus/dds.
#pragma once

#include <atomic>
#include <cstdint>

namespace fulcrum::bus::dds {

/// The session of a participant, and how many samples of others its inputs have dropped.
struct SessionCheck {
  const std::uint64_t session = 0;
  std::atomic<std::uint64_t> foreign{0};  ///< Relaxed: a count that publishes no other data.

  [[nodiscard]] bool IsForeign(std::uint64_t of_sample) noexcept {
    if (of_sample == session) return false;
    foreign.fetch_add(1, std::memory_order_relaxed);
    return true;
  }
};

}  // namespace fulcrum::bus::dds
