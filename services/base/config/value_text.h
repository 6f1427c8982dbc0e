// Values, ranges and kinds of a configuration file as text: for refusals and for the effective configuration.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/config/units.h"
#include "services/base/config/yaml_tree.h"

namespace fulcrum::config::internal {

/// Shortest text that is read back as the same number.
[[nodiscard]] std::string Shortest(double value);

/// Text of a default. Most are floats of the parameter structs in SI: 0.2f m is meant as 200 mm, not as
/// 200.00000298023224 mm.
[[nodiscard]] std::string DefaultText(double value);

/// "0.05 to 5 mm", "above 0 up to 300 W", "at least 1". @param unit nullptr: none.
[[nodiscard]] std::string RangeText(const Range& range, const Unit* unit);

/// Number of items of a list: "3", "1 to 9".
[[nodiscard]] std::string CountText(std::size_t min_count, std::size_t max_count);

/// "cut, coag, blend".
[[nodiscard]] std::string WordsText(const std::vector<std::string_view>& words);

/// "nothing", "a single value", "a list", "a map".
[[nodiscard]] const char* KindName(const Node& node);

/// The text in quotation marks; of a longer text only the first 60 bytes.
[[nodiscard]] std::string Quoted(std::string_view text);

}  // namespace fulcrum::config::internal
