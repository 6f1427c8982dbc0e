// Converts single values of a configuration file from text. What is not valid is refused with an InputError that names
// file, line, key, value and what would be valid.
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

/// In the unit of the key, from "0.3" or a quantity of the same dimension such as "300 um".
/// @param unit of the key; nullptr: a plain number.
[[nodiscard]] double ParseNumber(const Document& document, const Node& node, const Unit* unit, const Range& range);

/// @param valid what the refusal says would be valid.
[[nodiscard]] std::int64_t ParseInteger(const Document& document, const Node& node, std::int64_t min, std::int64_t max,
                                        std::string_view valid);
[[nodiscard]] bool ParseFlag(const Document& document, const Node& node, std::string_view valid);
/// 1 … max_length bytes without control characters.
[[nodiscard]] std::string ParseText(const Document& document, const Node& node, std::size_t max_length,
                                    std::string_view valid);
/// Index of one of a few words.
[[nodiscard]] std::size_t ParseWord(const Document& document, const Node& node,
                                    const std::vector<std::string_view>& words, std::string_view valid);

}  // namespace fulcrum::config::internal
