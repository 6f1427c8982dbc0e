// A transport that hands discovery and handshakes to the library one datagram at a time. Internal to services/bus/dds.
#pragma once

#include <fastdds/rtps/transport/TransportDescriptorInterface.h>

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

}  // namespace fulcrum::bus::dds
