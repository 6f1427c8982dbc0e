// Access of a test to the bus of a running cart, whose sessions make keys of their own.
#pragma once

#include <string>

#include "services/transport/bus/dds/participant.h"

namespace fulcrum::testing {

/// Settings with which a test may read every topic of the cart in that domain. Waits up to 30 s until a session is
/// announced; without one, returns settings for a bus without keys.
[[nodiscard]] bus::DdsSettings ReaderOf(int domain, const std::string& name = "test");
/// The same for a test that may write every topic and read none.
[[nodiscard]] bus::DdsSettings WriterOf(int domain, const std::string& name = "test");

}  // namespace fulcrum::testing
