// Targets and forms of requests, read strictly: whatever is not plainly right is refused. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace fulcrum::console {

using Form = std::map<std::string, std::string, std::less<>>;

/// application/x-www-form-urlencoded. Nothing when it is malformed: a broken escape, a control character, a name twice,
/// a name of other characters than a-z and _, more than 32 fields or 4096 bytes.
[[nodiscard]] std::optional<Form> ParseForm(std::string_view text);

struct Target {
  std::string
      path;  ///< Letters, digits, '.', '-', '_', '/'; begins with '/', no empty part, no part that begins with '.'.
  Form query;
};
/// Of a request line. Nothing when it is malformed.
[[nodiscard]] std::optional<Target> ParseTarget(std::string_view text);

/// A name of one part: 1 to 96 letters, digits, '.', '-', '_', not beginning with '.'.
[[nodiscard]] bool IsPlainName(std::string_view text);
/// frame_<digits>.png: what the render node calls its pictures.
[[nodiscard]] bool IsPictureName(std::string_view text);
/// SESSION/FILE.mcap, both plain names.
[[nodiscard]] bool IsRecordingName(std::string_view text);

/// A number in [least, most], in full and in plain digits.
[[nodiscard]] std::optional<double> ParseNumber(std::string_view text, double least, double most);

}  // namespace fulcrum::console
