// The two documents of DDS Security 1.1 that our authority signs: what holds in a domain, and what one identity may do.
// Pure text, made from services/transport/bus/access.h.
#pragma once

#include <ctime>
#include <string>

#include "services/transport/bus/access.h"

namespace fulcrum::keys {

struct Validity {
  std::time_t from = 0, until = 0;  ///< Seconds since 1970, UTC.
};

/// Everybody must authenticate, each topic has access control. `encrypt`: every datagram after that is encrypted
/// (AES-GCM), which rules out data-sharing.
[[nodiscard]] std::string GovernanceXml(bool encrypt);

[[nodiscard]] std::string PermissionsXml(const bus::AccessRole& role, const Validity& validity);

/// "CN=physics_node".
[[nodiscard]] std::string SubjectOf(const bus::AccessRole& role);

}  // namespace fulcrum::keys
