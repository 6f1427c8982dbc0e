// The keys of a configuration file, as words for mutations.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "services/base/config/strict_yaml.h"

namespace fulcrum::fuzz {

[[nodiscard]] inline std::vector<std::string> KeysOf(const std::vector<config::KeyRule>& rules) {
  std::set<std::string> keys;
  for (const config::KeyRule& rule : rules) {
    const std::size_t dot = rule.path.rfind('.');
    std::string key = dot == std::string::npos ? rule.path : rule.path.substr(dot + 1);
    keys.insert(key.substr(0, key.find('[')) + ": ");
  }
  return {keys.begin(), keys.end()};
}

}  // namespace fulcrum::fuzz
