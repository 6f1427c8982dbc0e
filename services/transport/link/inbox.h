// Packets that wait for the link's thread: filled by threads of the bus, bounded.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <vector>

#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::link {

class Inbox {
 public:
  struct Packet {
    bus::FarLane lane;
    std::vector<std::uint8_t> bytes;
    std::int64_t heard_ns;
  };
  struct Content {
    std::deque<Packet> packets;
    std::uint64_t overflowed = 0;  ///< Packets for which there was no room.
  };

  void Put(bus::FarLane lane, std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  /// Ends the present or next WaitUntil.
  void Wake();
  /// Waits for a packet, for Wake, or until `due_ns`.
  void WaitUntil(std::int64_t due_ns);
  [[nodiscard]] Content Take();

 private:
  std::mutex mutex_;  ///< Guards all members.
  std::condition_variable news_;
  Content content_;
  std::size_t size_B_ = 0;
  bool woken_ = false;
};

}  // namespace fulcrum::link
