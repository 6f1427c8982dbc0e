// A client's command to the supervisor of a running session.
#pragma once

#include <string>

#include "services/transport/control/control_socket.h"

namespace fulcrum::supervisor {

/// Sends a command to the supervisor of the domain and returns its reply. Throws InputError when no supervisor runs
/// there, std::runtime_error when no reply arrives within 10 s.
[[nodiscard]] control::Reply AskSupervisor(int domain, const std::string& verb, const std::string& argument);

}  // namespace fulcrum::supervisor
