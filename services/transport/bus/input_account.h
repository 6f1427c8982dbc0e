// Counters of one input: received, refused and missing samples. Shared by all backends, so that a test in one process
// counts exactly as the cart does.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>

#include "services/base/core/messages.h"
#include "services/transport/bus/port.h"

namespace fulcrum::bus {

/// Written by the reading thread, readable from any thread (the health thread reads the stats).
class InputAccount {
 public:
  /// @param one_owner of several epochs only the latest is accepted.
  explicit InputAccount(bool gap_is_loss, bool one_owner = false) : gap_is_loss_(gap_is_loss), one_owner_(one_owner) {}

  /// Whether the sample is of the present owner, as far as is known, and not of a process that has been replaced.
  /// Reading thread only.
  /// @param now_ns present time; an epoch later than this belongs to no process and is refused, because one such sample
  /// would shut out all later ones [ns].
  [[nodiscard]] bool IsOfOwner(const Stamp& stamp,
                               std::int64_t now_ns = std::numeric_limits<std::int64_t>::max()) noexcept {
    if (!one_owner_) return true;
    if (stamp.epoch < owner_epoch_ || stamp.epoch > static_cast<std::uint64_t>(now_ns)) return false;
    owner_epoch_ = stamp.epoch;
    return true;
  }

  /// Counts a sample that passed the gate.
  void Accept(const Stamp& stamp) noexcept {
    received_.fetch_add(1, std::memory_order_relaxed);
    Follow(stamp);
    // Newest by arrival, not by value: after a replay starts over, stamps may go back.
    newest_stamp_ns_.store(stamp.stamp_ns, std::memory_order_relaxed);
  }

  /// Counts a sample that did not pass the gate.
  void Reject() noexcept { rejected_.fetch_add(1, std::memory_order_relaxed); }

  /// Counts a refused sample whose place in the sequence is known: it is rejected, but not lost.
  void Reject(const Stamp& stamp) noexcept {
    Reject();
    if (stamp.sequence != 0) Follow(stamp);  // 0: the bytes could not be decoded.
  }

  [[nodiscard]] InputStats stats(bool matched) const noexcept {
    InputStats s;
    s.matched = matched;
    s.received = received_.load(std::memory_order_relaxed);
    s.lost = lost_.load(std::memory_order_relaxed);
    s.rejected = rejected_.load(std::memory_order_relaxed);
    s.newest_stamp_ns = newest_stamp_ns_.load(std::memory_order_relaxed);
    return s;
  }

 private:
  /// Counts the gap to the previous sample of the same epoch. A new epoch is a restarted or another writer: the samples
  /// that it sent before this reader existed are not losses.
  void Follow(const Stamp& stamp) noexcept {
    Writer* writer = nullptr;
    for (Writer& w : writers_) {
      if (w.last_sequence != 0 && w.epoch == stamp.epoch) writer = &w;
    }
    if (writer == nullptr) {
      writer = &writers_[next_victim_];
      next_victim_ = (next_victim_ + 1) % writers_.size();
      *writer = {stamp.epoch, stamp.sequence};
      return;
    }
    if (gap_is_loss_ && stamp.sequence > writer->last_sequence + 1) {
      lost_.fetch_add(stamp.sequence - writer->last_sequence - 1, std::memory_order_relaxed);
    }
    writer->last_sequence = stamp.sequence;
  }

  struct Writer {
    std::uint64_t epoch = 0;
    std::uint64_t last_sequence = 0;  ///< 0: entry unused.
  };

  const bool gap_is_loss_, one_owner_;
  std::uint64_t owner_epoch_ = 0;
  std::array<Writer, 16> writers_{};  ///< More entries than a cart has nodes; a new writer replaces the oldest entry.
  std::size_t next_victim_ = 0;
  // Relaxed: each counter is independent and publishes no other data.
  std::atomic<std::uint64_t> received_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<std::uint64_t> rejected_{0};
  std::atomic<std::int64_t> newest_stamp_ns_{0};
};

/// Stamps the samples of one output. The epoch is the time at which the writer was made, so it grows with each restart.
class Stamper {
 public:
  /// `epoch_ns`: CLOCK_MONOTONIC now [ns].
  explicit Stamper(std::int64_t epoch_ns) : epoch_(static_cast<std::uint64_t>(epoch_ns)) {}
  [[nodiscard]] Stamp Next(std::int64_t stamp_ns) { return {++sequence_, epoch_, stamp_ns}; }

 private:
  std::uint64_t epoch_;
  std::uint64_t sequence_ = 0;
};

}  // namespace fulcrum::bus
