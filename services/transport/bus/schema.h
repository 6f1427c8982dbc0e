// The schema that this build speaks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace fulcrum::bus {

/// Hash of all IDL files without comments and white space, compiled in. Peers of another are refused.
[[nodiscard]] std::uint64_t SchemaHash();

/// IDL of the message type of this name ("ToolState") with all that it needs, as it stood when this was built. Empty
/// for an unknown name.
[[nodiscard]] std::string SchemaText(std::string_view type);

}  // namespace fulcrum::bus
