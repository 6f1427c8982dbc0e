// DDS Security of one participant: its properties, and the reasons for refusals found in the library's log. Internal to
// services/transport/bus/dds.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/rtps/common/GuidPrefix_t.hpp>
#include <memory>
#include <set>
#include <string>

#include "services/transport/bus/dds/chained_transport.h"
#include "services/transport/bus/security.h"

namespace fulcrum::bus::dds {

/// Applies authentication (PKI-DH), access control, and with `encrypt` AES-GCM, over the transports that `qos` names
/// already, each with OneDiscoveryAtATime. Throws InputError if the keys cannot be used. @return the gate of their
/// discovery, to be opened when the participant has been made.
[[nodiscard]] std::shared_ptr<DiscoveryGate> ApplySecurity(const Security& security,
                                                           eprosima::fastdds::dds::DomainParticipantQos* qos);

/// Adds the flow controller kPacking, for asynchronous writers: it bounds what the library packs into one datagram. The
/// library (2.9.1) keeps no room for what encryption adds to a datagram that several samples fill
/// (RTPSMessageGroup, append_message), and then aborts the process.
/// @param most_B bytes in each period of a millisecond, and in a datagram.
void BoundPacking(std::int32_t most_B, eprosima::fastdds::dds::DomainParticipantQos* qos);
inline constexpr const char* kPacking = "packing";

/// Identity with whose keys a participant has authenticated: of the table, or a guest, or "?". The library and all
/// peers check its address against its certificate, and the address contains a hash of the name.
/// @param claimed subject that the participant announces, such as "/CN=probe"; unverified, only checked against the
/// hash.
[[nodiscard]] std::string IdentityBehind(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix,
                                         const std::string& claimed = {});

/// Receives what the library logs about security: its callbacks name the refused participant, only its log contains the
/// reason. Once per process, as the log is one per process.
void ListenToSecurityLog();
/// Why a certificate was refused last; empty: no reason was logged. To be called from within the library's callback, on
/// the thread that has refused.
[[nodiscard]] std::string LastCertificateComplaint();
/// Why the permissions of a participant that had authenticated were refused; empty: they were not.
[[nodiscard]] std::string PermissionsComplaint(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix);
/// Endpoints that the library has refused to a participant by its signed permissions, such as "may not write
/// fulcrum/ToolState". It checks those only that match one of this process.
[[nodiscard]] std::set<std::string> EndpointComplaints(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix);

}  // namespace fulcrum::bus::dds
