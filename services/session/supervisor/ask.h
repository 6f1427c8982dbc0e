// Asking the supervisor of a running session.
#pragma once

#include <string>

#include "services/base/core/messages.h"

namespace fulcrum::supervisor {

/// Sends a command to the supervisor of the domain and waits for its answer, at most 10 s. Throws InputError when none
/// runs there, MismatchError when it speaks another schema.
[[nodiscard]] CommandReply AskSupervisor(int domain, const std::string& verb, const std::string& argument);

}  // namespace fulcrum::supervisor
