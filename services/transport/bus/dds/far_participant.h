// The bus between two hosts: packets of bytes over UDP to one other participant, whose address is known. Used by
// services/transport/link alone; all nodes stay on their own host's bus. No DDS type is visible here.
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
  kCart,  ///< Where the session is.
  kHost,  ///< Where some of its nodes run.
};

enum class FarLane : std::uint8_t {
  kStream,   ///< Best effort: what is lost is lost, nothing waits for it. At most kStreamPacket_B.
  kOrdered,  ///< Reliable and in order while both are connected; the newest kOrderedBacklog wait for a slow way.
};
inline constexpr std::size_t kStreamPacket_B = 1300;  ///< One Ethernet frame, encrypted or not.
inline constexpr std::size_t kOrderedPacket_B = 128 * 1024;
inline constexpr int kOrderedBacklog = 256;

struct FarSettings {
  int domain = 107;     ///< 101 … 200: apart from all carts' own.
  std::string address;  ///< IPv4 of the interface that leads to the other host: no other is used.
  std::string peer;     ///< IPv4 of the other host.
  FarSide side = FarSide::kCart;
  std::filesystem::path keys = {};  ///< Of `fulcrum keys init`: only who has such keys is heard, and nobody overhears.
};

/// Takes a packet; called on threads of the bus, one at a time for each lane; must not throw.
using FarSink = std::function<void(FarLane lane, std::span<const std::uint8_t> packet)>;

class FarParticipant {
 public:
  /// Throws InputError when an address, the domain or the keys cannot be used.
  FarParticipant(const FarSettings& settings, FarSink sink);
  ~FarParticipant();
  FarParticipant(const FarParticipant&) = delete;
  FarParticipant& operator=(const FarParticipant&) = delete;

  /// False when it was not sent: too long, no room, or nobody there.
  bool Send(FarLane lane, std::span<const std::uint8_t> packet) noexcept;
  /// The other side is there, as far as is known.
  [[nodiscard]] bool matched() const noexcept;
  /// The host's side: empty, or one line why the cart will never speak with it.
  [[nodiscard]] std::string mismatch();
  /// Who was refused since the start of this object.
  [[nodiscard]] Refusals refusals();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// IPv4 of `name` (dotted or of a host). Throws InputError.
[[nodiscard]] std::string ResolveAddress(const std::string& name);
/// IPv4 of ours that a packet to `peer` leaves from. Throws InputError when no way leads there.
[[nodiscard]] std::string AddressTowards(const std::string& peer);

}  // namespace fulcrum::bus
