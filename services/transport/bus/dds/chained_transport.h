// What comes between the library and the sockets. Internal to services/transport/bus/dds.
#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

#include <atomic>
#include <memory>

namespace fulcrum::bus::dds {

/// `transport`, whose datagrams of discovery never reach the library on two threads at once.
///
/// A participant listens to discovery on two threads, multicast and unicast, and the library's security manager (2.9.1)
/// prepares the endpoints of a peer's handshake in members of its own that no lock guards
/// (SecurityManager::match_builtin_endpoints, temp_stateless_*_proxy_data_). Of two peers that are discovered at the
/// same moment one may be left without these endpoints: neither side ever hears the other's handshake.
/// User data is handed on as it comes.
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> OneDiscoveryAtATime(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport);

/// Between the raw inputs of a participant and its transport.
struct Gathering {
  std::atomic<bool> caught_up{false};  ///< The newest small sample was waited for: no other is in the socket.
};

/// `transport`, whose thread of user data rests for 8 ms whenever a datagram leaves `gathering` caught up, so that
/// small samples gather in the socket.
///
/// It rests here and not where a sample is taken: there the library holds the reader's lock, and whoever discovers a
/// new writer would wait for it, 8 ms a reader.
[[nodiscard]] std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> LetGather(
    std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> transport,
    std::shared_ptr<Gathering> gathering);

}  // namespace fulcrum::bus::dds
