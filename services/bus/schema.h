// The schema that this build speaks.
#pragma once

#include <cstdint>

namespace fulcrum::bus {

/// Hash of all IDL files without comments and white space, compiled in. Peers with another one are refused on discovery.
[[nodiscard]] std::uint64_t SchemaHash();

}  // namespace fulcrum::bus
