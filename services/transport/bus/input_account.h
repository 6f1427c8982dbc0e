// The books of one input: what came, what was refused at the gate, what is missing. Shared by all backends, so that a
// test in one process counts exactly as the cart does.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>

#include "services/base/core/messages.h"
#include "services/transport/bus/port.h"

namespace fulcrum::bus {

/// Written by the reading thread, read by any (the health thread asks for stats).
class InputAccount {
 public:
  /// @param one_owner of two epochs only the later one is taken from.
  explicit InputAccount(bool gap_is_loss, bool one_owner = false) : gap_is_loss_(gap_is_loss), one_owner_(one_owner) {}

  /// Of the owner, as far as is known: not of a process that another one has replaced. Reading thread only.
  /// @param now_ns an epoch after it is no process's: one such sample would shut out all that come after it [ns].
  [[nodiscard]] bool IsOfOwner(const Stamp& stamp,
                               std::int64_t now_ns = std::numeric_limits<std::int64_t>::max()) noexcept {
    if (!one_owner_) return true;
    if (stamp.epoch < owner_epoch_ || stamp.epoch > static_cast<std::uint64_t>(now_ns)) return false;
    owner_epoch_ = stamp.epoch;
    return true;
  }

  /// A sample that passed the gate.
  void Accept(const Stamp& stamp) noexcept {
    received_.fetch_add(1, std::memory_order_relaxed);
    Follow(stamp);
    // Newest by arrival, not by value: after a replay starts over, stamps may go back.
    newest_stamp_ns_.store(stamp.stamp_ns, std::memory_order_relaxed);
  }

  /// A sample that did not.
  void Reject() noexcept { rejected_.fetch_add(1, std::memory_order_relaxed); }

  /// A sample that passed nothing but whose place in the sequence is known: refused, yet not lost.
  void Reject(const Stamp& stamp) noexcept {
    Reject();
    if (stamp.sequence != 0) Follow(stamp);  // 0: bytes that were no message.
  }

  /// A sample put aside unread because a newer one was wanted.
  void Supersede(const Stamp& stamp) noexcept {
    received_.fetch_add(1, std::memory_order_relaxed);
    Follow(stamp);
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
  /// Counts the gap to the previous sample of the same epoch. A new epoch is a restarted or another writer: what it
  /// sent before this reader came is not a loss.
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
  std::array<Writer, 16> writers_{};  ///< More than the nodes of a cart; the oldest entry makes room.
  std::size_t next_victim_ = 0;
  // Relaxed: each counter stands for itself and nothing is published through it.
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
