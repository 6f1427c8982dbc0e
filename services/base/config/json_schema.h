// A JSON Schema (draft 2020-12) of the keys that a reader knows, for editors of YAML files.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "services/base/config/strict_yaml.h"

namespace fulcrum::config {

/// From the rules with which the reader checks its files; of equal paths the first counts. Numbers may also be texts
/// with a unit, whose range an editor does not check. Keys that no rule names are errors at the top, and in maps there
/// that hold nothing but values; which keys others may have depends on their content.
[[nodiscard]] std::string JsonSchema(std::span<const KeyRule> rules, std::string_view title);

}  // namespace fulcrum::config
