// Malformed datagrams on the loopback interface, to the ports of a cart's participants: any process of the machine can
// send them without joining the bus.
#pragma once

#include <cstdint>
#include <vector>

namespace fulcrum::testing {

/// UDP ports of this machine that are bound in the range that DDS derives from the domain.
[[nodiscard]] std::vector<std::uint16_t> PortsOfDomain(int domain);

/// Sends `datagrams` datagrams evenly over `seconds`, in turn to all ports of the domain: random bytes, headers of RTPS
/// with submessages of every kind whose lengths, counts or parameters are wrong, and announcements of participants and
/// endpoints that end too early. Returns how many were sent.
std::uint64_t FloodDomain(int domain, std::uint64_t datagrams, double seconds, std::uint32_t seed);

}  // namespace fulcrum::testing
