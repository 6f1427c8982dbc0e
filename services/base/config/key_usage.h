// Unknown keys of a configuration file are those that no getter has read: finds them, and lists the rules of the
// others.
#pragma once

#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/config/yaml_tree.h"

namespace fulcrum::config::internal {

/// Throws InputError for the first key that was not read; the message suggests the nearest known key.
void CheckAllUsed(const Document& document, const Node& map);

/// Every key that was read, in the order of reading; of the maps of a list the first stands for all.
[[nodiscard]] std::vector<KeyRule> RulesOf(const Node& root);

}  // namespace fulcrum::config::internal
