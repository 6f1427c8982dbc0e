#include "services/base/config/key_usage.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <string>
#include <string_view>

namespace fulcrum::config::internal {
namespace {

/// Levenshtein distance; both words are short keys.
std::size_t Distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t above = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, above + 1, diagonal + (a[i] != b[j])});
      diagonal = above;
    }
  }
  return row.back();
}

/// What to do about an unknown key of a map.
std::string HintFor(const std::string& key, const Node& map) {
  const auto nearest = std::min_element(map.asked.begin(), map.asked.end(), [&](const auto& a, const auto& b) {
    return Distance(key, a.key) < Distance(key, b.key);
  });
  if (nearest == map.asked.end()) return "remove it";
  if (Distance(key, nearest->key) <= std::max<std::size_t>(2, key.size() / 2)) {
    return "did you mean '" + nearest->key + "'?";
  }
  std::string hint = "remove it; known here:";
  for (const Node::Asked& asked : map.asked) {
    hint += " " + asked.key;
  }
  return hint;
}

void AddRules(const Node& map, const std::string& path, std::vector<KeyRule>* rules) {
  for (const Node::Asked& asked : map.asked) {
    const Node* node = map.Find(asked.key);
    rules->push_back({path + asked.key, node ? node->line : 0, asked.standard, asked.valid});
    const std::string inner = path + asked.key + (asked.form == Node::Form::kMaps ? "[]." : ".");
    if (!asked.maps.empty()) {
      AddRules(*asked.maps.front(), inner, rules);
    }
  }
}

}  // namespace

void CheckAllUsed(const Document& document, const Node& map) {
  for (const auto& entry : map.entries) {
    const std::string& key = entry.first;
    const Node* node = entry.second;
    const auto asked = std::find_if(map.asked.begin(), map.asked.end(), [&](const auto& a) { return a.key == key; });
    if (asked == map.asked.end()) {
      document.Fail(node->line, node->path, "unknown key; " + HintFor(key, map));
    }
    for (const Node* child : asked->maps) {
      CheckAllUsed(document, *child);
    }
  }
}

std::vector<KeyRule> RulesOf(const Node& root) {
  std::vector<KeyRule> rules;
  AddRules(root, "", &rules);
  return rules;
}

}  // namespace fulcrum::config::internal
