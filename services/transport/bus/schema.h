// The schema of this build.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace fulcrum::bus {

/// Hash of all IDL files without comments and white space, compiled in. Peers with another hash are refused.
[[nodiscard]] std::uint64_t SchemaHash();

/// IDL of the message type of this name ("ToolState") with all types that it uses, as of the build. Empty for an
/// unknown name.
[[nodiscard]] std::string SchemaText(std::string_view type);

}  // namespace fulcrum::bus
