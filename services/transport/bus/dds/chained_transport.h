// Transports between the library and the sockets. Internal to services/transport/bus/dds.
#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

#include <atomic>
#include <memory>

namespace fulcrum::bus::dds {

/// Wraps `transport` so that its datagrams of discovery never enter the library on two threads at once.
///
/// A participant receives discovery on two threads, multicast and unicast, and the library's security manager (2.9.1)
/// prepares the endpoints of a peer's handshake in members that no lock guards
/// (SecurityManager::match_builtin_endpoints, temp_stateless_*_proxy_data_). Of two peers that are discovered at the
/// same moment one can be left without these endpoints: neither side then receives the other's handshake.
/// User data is passed on without a lock.
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> OneDiscoveryAtATime(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport);

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

}  // namespace fulcrum::bus::dds
