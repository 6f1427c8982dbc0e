// The schema that this build speaks.
#pragma once

#include <cstdint>

namespace fulcrum::bus {

/// Hash of all IDL files without comments and white space, compiled in. Peers of another are refused.
[[nodiscard]] std::uint64_t SchemaHash();

}  // namespace fulcrum::bus
