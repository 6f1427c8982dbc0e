// Transports between the library and the sockets. Internal to services/transport/bus/dds.
#pragma once

#include <fastdds/rtps/common/Locator.h>
#include <fastdds/rtps/common/Types.h>
#include <fastdds/rtps/transport/TransportDescriptorInterface.h>
#include <fastdds/rtps/transport/TransportReceiverInterface.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace fulcrum::bus::dds {

/// Passes datagrams of discovery to the library one at a time, from the opening of the gate on; those that arrive
/// before are held. A participant announces itself while it is still being made and discards what arrives then: its
/// peers would repeat their handshakes only after a second.
class DiscoveryGate {
 public:
  void Pass(eprosima::fastdds::rtps::TransportReceiverInterface* above, const eprosima::fastrtps::rtps::octet* data,
            std::uint32_t size, const eprosima::fastrtps::rtps::Locator_t& local,
            const eprosima::fastrtps::rtps::Locator_t& remote);
  /// To be called when the participant has been made.
  void Open();

 private:
  struct Held {
    eprosima::fastdds::rtps::TransportReceiverInterface* above;
    std::vector<eprosima::fastrtps::rtps::octet> datagram;
    eprosima::fastrtps::rtps::Locator_t local, remote;
  };
  static constexpr std::size_t kMostHeld = 256;  ///< Many times what a cart sends in the time that it takes.

  std::mutex mutex_;
  bool open_ = false;
  std::vector<Held> held_;
};

/// Wraps `transport` so that its datagrams of discovery pass through `gate`.
///
/// A participant receives discovery on two threads, multicast and unicast, and the library's security manager (2.9.1)
/// prepares the endpoints of a peer's handshake in members that no lock guards
/// (SecurityManager::match_builtin_endpoints, temp_stateless_*_proxy_data_). Of two peers that are discovered at the
/// same moment one can be left without these endpoints: neither side then receives the other's handshake.
/// User data is passed on without a lock.
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> OneDiscoveryAtATime(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport,
    std::shared_ptr<DiscoveryGate> gate);

/// State shared by the raw inputs of a participant and its transport.
struct Gathering {
  /// The reader has waited for the newest small sample: the socket contains no other.
  std::atomic<bool> caught_up{false};
};

/// Wraps `transport` so that its thread of user data rests for 8 ms whenever a datagram leaves `gathering` caught up,
/// so that small samples gather in the socket.
///
/// It rests here and not where a sample is taken: there the library holds the reader's lock, and the discovery of a new
/// writer would wait for it, 8 ms per reader.
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> LetGather(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport,
    std::shared_ptr<Gathering> gathering);

/// Datagrams from addresses other than that of the one peer, counted and named.
class StrangeAddresses {
 public:
  using Ipv4 = std::array<std::uint8_t, 4>;
  /// Bounds what forged addresses can make this host store.
  static constexpr std::size_t kMostNamed = 16;

  void Add(const Ipv4& ipv4);
  [[nodiscard]] std::uint64_t datagrams() const { return datagrams_.load(std::memory_order_relaxed); }
  /// The first kMostNamed of them, dotted.
  [[nodiscard]] std::vector<std::string> named() const;

 private:
  std::atomic<std::uint64_t> datagrams_{0};  ///< Relaxed: an independent count that orders nothing.
  mutable std::mutex mutex_;
  std::vector<Ipv4> named_;
};

/// Wraps `transport` so that it exchanges datagrams with one address only: others are dropped before the library reads
/// them, and nothing is sent to a place that an announcement names elsewhere.
/// @param peer dotted IPv4.
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> OnlyWith(
    const std::string& peer, std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport,
    std::shared_ptr<StrangeAddresses> strangers);

}  // namespace fulcrum::bus::dds
