// DDS Security of one participant: its properties, and what of the library's log tells why somebody was refused.
// Internal to services/transport/bus/dds.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/rtps/common/GuidPrefix_t.hpp>
#include <string>

#include "services/transport/bus/security.h"

namespace fulcrum::bus::dds {

/// Authentication (PKI-DH), access control, and with `encrypt` AES-GCM, over the transports that `qos` names already,
/// each with OneDiscoveryAtATime. Throws InputError when the keys are of no use.
void ApplySecurity(const Security& security, eprosima::fastdds::dds::DomainParticipantQos* qos);

/// Whose keys a participant has authenticated with; "?" when they are nobody's of the table. The library and all peers
/// hold its address against its certificate.
[[nodiscard]] std::string IdentityBehind(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix);

/// Takes over what the library logs about security: its callbacks say who was refused, only its log says why. Once per
/// process, because that log is.
void ListenToSecurityLog();
/// Why a certificate was refused last; empty: nothing was said. Asked from within the library's callback, on the thread
/// that has refused.
[[nodiscard]] std::string LastCertificateComplaint();
/// Why the permissions of a participant that had authenticated were refused; empty: they were not.
[[nodiscard]] std::string PermissionsComplaint(const eprosima::fastrtps::rtps::GuidPrefix_t& prefix);

}  // namespace fulcrum::bus::dds
