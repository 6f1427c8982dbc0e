// The two documents of DDS Security 1.1 that the authority signs: the rules of a domain and the rights of one identity.
// Pure text, made from services/transport/bus/access.h.
#pragma once

#include <ctime>
#include <optional>
#include <string>
#include <string_view>

#include "services/transport/bus/access.h"

namespace fulcrum::keys {

struct Validity {
  std::time_t from = 0, until = 0;  ///< Seconds since 1970, UTC.
};
/// Certificates are valid from this much earlier, because the clocks of two hosts differ.
inline constexpr std::time_t kClockSlack_s = 300;

/// Rules of the domain: every participant must authenticate, and each topic has access control. With `encrypt` every
/// datagram after the handshake is encrypted (AES-GCM), which rules out data-sharing.
[[nodiscard]] std::string GovernanceXml(bool encrypt);

[[nodiscard]] std::string PermissionsXml(const bus::AccessRole& role, const Validity& validity);

/// Rights that a document of PermissionsXml gives to `identity`: the role for which PermissionsXml writes this very
/// document. nullopt: another program or version has written it.
[[nodiscard]] std::optional<bus::AccessRole> RightsIn(const std::string& document, std::string_view identity,
                                                      const Validity& validity);

/// Subject of a role's certificate, "CN=physics_node".
[[nodiscard]] std::string SubjectOf(const bus::AccessRole& role);

}  // namespace fulcrum::keys
