// Which connections the server keeps. A connection is a guest until a request on it has presented the token; then it
// has one of the reserved slots, which guests cannot take. A new guest is always admitted: where there is no slot left,
// the oldest guest is closed instead, so that silent connections never keep the operator out. Each guest may stay a
// moment, in which an honest one sends its request; meanwhile the next connection waits. Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <optional>
#include <string>

namespace fulcrum::console {

class Admission {
 public:
  using Id = std::uint64_t;
  using Time = std::chrono::steady_clock::time_point;
  struct Limits {
    std::size_t guests = 256;
    std::size_t guests_per_address = 128;
    std::size_t known = 32;  ///< Slots reserved for clients with the token.
    /// Shortest stay of a guest that gives way: long enough for a TLS handshake and a request on a busy machine. 128
    /// slots let 3200 connections pass in a second, so that a thousand silent ones delay the next by 0.3 s.
    std::chrono::milliseconds stay{40};
  };

  explicit Admission(const Limits& limits) : limits_(limits) {}

  /// Earliest time at which a connection from this address can be admitted: now, or the end of a guest's stay.
  [[nodiscard]] Time Earliest(const std::string& address, Time now) const;
  /// @return the guest that has lost its slot to the new one and must be closed.
  std::optional<Id> Enter(Id connection, const std::string& address, Time now);
  /// The guest has presented the token. @return false when all reserved slots are taken: it remains a guest.
  bool Recognise(Id connection);
  void Leave(Id connection);
  /// Removes the oldest guest, for example when the process has no file descriptor left.
  std::optional<Id> TakeOldest();

  [[nodiscard]] std::size_t guests() const { return guests_.size(); }
  [[nodiscard]] std::size_t known() const { return known_.size(); }

 private:
  struct Guest {
    Id connection;
    std::string address;
    Time since;
  };
  using Guests = std::list<Guest>;
  /// The guest that gives way to a connection from this address; end(): there is a slot.
  [[nodiscard]] Guests::const_iterator Loser(const std::string& address) const;

  const Limits limits_;
  Guests guests_;  ///< Oldest first.
  std::list<Id> known_;
};

}  // namespace fulcrum::console
