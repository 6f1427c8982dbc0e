// Which keys of a configuration file were asked for: refuses the others, lists the rules of those that were.
#pragma once

#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/config/yaml_tree.h"

namespace fulcrum::config::internal {

/// Throws InputError for the first key that was not asked for, with the nearest one that was.
void CheckAllUsed(const Document& document, const Node& map);

/// Every key that was asked for, in the order of asking; of the maps of a list the first stands for all.
[[nodiscard]] std::vector<KeyRule> RulesOf(const Node& root);

}  // namespace fulcrum::config::internal
