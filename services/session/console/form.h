// Strict parsing of request targets and forms: input that does not match exactly is refused. Pure functions.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace fulcrum::console {

using Form = std::map<std::string, std::string, std::less<>>;

/// Parses application/x-www-form-urlencoded. nullopt when it is malformed: an invalid escape, a control character, a
/// repeated name, a name of other characters than a-z and _, more than 32 fields or 4096 bytes.
[[nodiscard]] std::optional<Form> ParseForm(std::string_view text);

struct Target {
  std::string
      path;  ///< Letters, digits, '.', '-', '_', '/'; begins with '/', no empty part, no part that begins with '.'.
  Form query;
};
/// Parses the target of a request line; nullopt when it is malformed.
[[nodiscard]] std::optional<Target> ParseTarget(std::string_view text);

/// True for a name of one part: 1 to 96 letters, digits, '.', '-', '_', not beginning with '.'.
[[nodiscard]] bool IsPlainName(std::string_view text);
/// True for frame_<digits>.png, the name of a picture of render_node.
[[nodiscard]] bool IsPictureName(std::string_view text);
/// True for SESSION/FILE.mcap, both plain names.
[[nodiscard]] bool IsRecordingName(std::string_view text);

/// The number when the whole text is one in [least, most], in decimal digits; else nullopt.
[[nodiscard]] std::optional<double> ParseNumber(std::string_view text, double least, double most);

}  // namespace fulcrum::console
