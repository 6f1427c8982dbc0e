// fulcrum doctor --security.
#pragma once

#include <filesystem>

#include "services/base/core/exit_code.h"

namespace fulcrum::supervisor::cli {

/// Prints what protects this machine, its cart and the session in the domain, what does not, and what that means.
/// @param cart file of the cart; empty: none. @return kFailure when something needs attention.
ExitCode ReportSecurity(int domain, const std::filesystem::path& cart);

}  // namespace fulcrum::supervisor::cli
