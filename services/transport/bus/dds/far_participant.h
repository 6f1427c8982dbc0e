// The bus between two hosts: packets of bytes over UDP to one other participant with a known address. Used by
// services/transport/link only; all nodes stay on their own host's bus. No DDS type is visible here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "services/transport/bus/security.h"

namespace fulcrum::bus {

enum class FarSide : std::uint8_t {
  kCart,  ///< The host of the session.
  kHost,  ///< The host of some of its nodes.
};

enum class FarLane : std::uint8_t {
  kStream,  ///< Best effort: a lost packet is not repeated and delays no other. At most kStreamPacket_B.
  /// Reliable and in order while both are connected; the newest kOrderedBacklog packets wait for a slow connection.
  kOrdered,
};
inline constexpr std::size_t kStreamPacket_B = 1300;          ///< One Ethernet frame, encrypted or not.
inline constexpr std::size_t kOrderedPacket_B = 1024 * 1024;  ///< More than a TopologyState.
inline constexpr int kOrderedBacklog = 256;

struct FarSettings {
  int domain = 107;     ///< 101 to 200: separate from the domains of all carts.
  std::string address;  ///< IPv4 of the interface with the route to the other host: no other is used.
  std::string peer;     ///< IPv4 of the other host: datagrams are exchanged with no other address.
  FarSide side = FarSide::kCart;
  /// `address` is that of the present route to `peer`: a new participant uses the address of the route at that time.
  bool follows_route = false;
  /// Folder of `fulcrum keys init`: packets are then encrypted, and only participants with such keys are accepted.
  std::filesystem::path keys = {};
};

/// Receives a packet; called on threads of the bus, one at a time for each lane; must not throw.
using FarSink = std::function<void(FarLane lane, std::span<const std::uint8_t> packet)>;

class FarParticipant {
 public:
  /// Throws InputError when an address, the domain or the keys cannot be used.
  FarParticipant(const FarSettings& settings, FarSink sink);
  ~FarParticipant();
  FarParticipant(const FarParticipant&) = delete;
  FarParticipant& operator=(const FarParticipant&) = delete;

  /// False if it was not sent: too long, no room, or no peer.
  bool Send(FarLane lane, std::span<const std::uint8_t> packet) noexcept;
  /// Whether the other side has been discovered and has not left.
  [[nodiscard]] bool matched() const noexcept;
  /// Host only: one line with the reason why the cart will never accept this side; otherwise empty.
  [[nodiscard]] std::string mismatch();
  /// Datagrams from addresses other than the peer's, which were dropped.
  [[nodiscard]] std::uint64_t dropped() const noexcept;
  /// Participants that were refused since the construction of this object, and the addresses of dropped datagrams.
  [[nodiscard]] Refusals refusals();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether the interface with this address is down or has no cable. The library would make a participant without any
/// socket on it.
[[nodiscard]] bool IsUnplugged(const std::string& address);
/// IPv4 address of `name` (dotted or a host name). Throws InputError.
[[nodiscard]] std::string ResolveAddress(const std::string& name);
/// IPv4 address of this machine from which a packet to `peer` is sent. Throws InputError if there is no route.
[[nodiscard]] std::string AddressTowards(const std::string& peer);

}  // namespace fulcrum::bus
