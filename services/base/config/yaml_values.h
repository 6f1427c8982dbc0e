// Converts single values of a configuration file from text. An invalid value is refused with an InputError that names
// file, line, key, value and the valid values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/config/units.h"
#include "services/base/config/yaml_tree.h"

namespace fulcrum::config::internal {

/// Value in the unit of the key, from "0.3" or from a quantity of the same dimension such as "300 um".
/// @param unit of the key; nullptr: a plain number.
[[nodiscard]] double ParseNumber(const Document& document, const Node& node, const Unit* unit, const Range& range);

/// @param valid description of the valid values for the error message.
[[nodiscard]] std::int64_t ParseInteger(const Document& document, const Node& node, std::int64_t min, std::int64_t max,
                                        std::string_view valid);
[[nodiscard]] bool ParseFlag(const Document& document, const Node& node, std::string_view valid);
/// Text of 1 to max_length bytes without control characters.
[[nodiscard]] std::string ParseText(const Document& document, const Node& node, std::size_t max_length,
                                    std::string_view valid);
/// Index of the value among a few words.
[[nodiscard]] std::size_t ParseWord(const Document& document, const Node& node,
                                    const std::vector<std::string_view>& words, std::string_view valid);

}  // namespace fulcrum::config::internal
