#include "services/base/config/json_schema.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

namespace fulcrum::config {
namespace {

std::string JsonText(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof(code), "\\u%04x", static_cast<unsigned>(c));
      out += code;
    } else {
      out += c;
    }
  }
  return out + '"';
}

/// A map of the file, with the keys in the order in which they are read.
struct Map {
  struct Key {
    std::string name;
    const KeyRule* rule = nullptr;
    bool is_list = false;  ///< Of maps.
    Map* map = nullptr;
  };
  std::vector<Key> keys;
  std::vector<std::unique_ptr<Map>> maps;

  Key* At(const std::string& name) {
    const auto found = std::find_if(keys.begin(), keys.end(), [&](const Key& key) { return key.name == name; });
    if (found != keys.end()) return &*found;
    keys.push_back({name});
    return &keys.back();
  }
  Map* Below(Key* key) {
    if (key->map == nullptr) {
      maps.push_back(std::make_unique<Map>());
      key->map = maps.back().get();
    }
    return key->map;
  }
};

void Insert(Map* root, const KeyRule& rule) {
  Map* map = root;
  for (std::string_view rest = rule.path;;) {
    const std::size_t dot = rest.find('.');
    std::string name(rest.substr(0, dot));
    const bool list = name.ends_with("[]");
    if (list) name.resize(name.size() - 2);
    Map::Key* const key = map->At(name);
    key->is_list |= list;
    if (dot == std::string_view::npos) {
      if (key->rule == nullptr) key->rule = &rule;
      return;
    }
    map = map->Below(key);
    rest.remove_prefix(dot + 1);
  }
}

/// Takes a number off the front of a text.
bool TakeNumber(std::string_view* text, double* value) {
  const std::string copy(*text);
  char* end = nullptr;
  *value = std::strtod(copy.c_str(), &end);
  if (end == copy.c_str()) return false;
  text->remove_prefix(static_cast<std::size_t>(end - copy.c_str()));
  return true;
}
bool Take(std::string_view* text, std::string_view prefix) {
  if (!text->starts_with(prefix)) return false;
  text->remove_prefix(prefix.size());
  return true;
}
std::string SchemaNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.12g", value);
  return text;
}

/// Limits of "0.5 to 20 mm", "above 0 up to 1", "at least 3", "at most 3", "any number"; false for anything else.
bool Limits(std::string_view valid, std::string* limits) {
  if (valid.starts_with("any number")) return true;
  double low = 0, high = 0;
  if (Take(&valid, "at most ")) {
    if (!TakeNumber(&valid, &high)) return false;
    *limits += ", \"maximum\": " + SchemaNumber(high);
    return true;
  }
  const bool open = Take(&valid, "above "), one = !open && Take(&valid, "at least ");
  if (!TakeNumber(&valid, &low)) return false;
  *limits += std::string(open ? ", \"exclusiveMinimum\": " : ", \"minimum\": ") + SchemaNumber(low);
  if (Take(&valid, open ? " up to " : " to ")) {
    if (!TakeNumber(&valid, &high)) return false;
    *limits += ", \"maximum\": " + SchemaNumber(high);
    return true;
  }
  return open || one;
}

/// "type" and limits of a value, from the words of the reader.
std::string TypeOf(std::string_view valid) {
  std::string limits;
  if (valid == "true, false") return "\"type\": \"boolean\"";
  if (valid.starts_with("a text")) return "\"type\": \"string\"";
  if (valid.starts_with("a list of")) {
    return valid.ends_with("texts") ? "\"type\": \"array\", \"items\": {\"type\": \"string\"}" : "\"type\": \"array\"";
  }
  if (Take(&valid, "an integer from ") && Limits(valid, &limits)) return "\"type\": \"integer\"" + limits;
  if (const std::size_t each = valid.find(" numbers, each "); each != std::string_view::npos) {
    double least = 0, most = 0;
    std::string_view count = valid.substr(0, each);
    std::string items;
    if (TakeNumber(&count, &least)) {
      if (!Take(&count, " to ") || !TakeNumber(&count, &most)) most = least;
      items = ", \"minItems\": " + SchemaNumber(least) + ", \"maxItems\": " + SchemaNumber(most);
    }
    constexpr std::string_view kEach = " numbers, each ";
    (void)Limits(valid.substr(each + kEach.size()), &limits);
    return "\"type\": \"array\"" + items + ", \"items\": {\"type\": [\"number\", \"string\"]" + limits + "}";
  }
  if (Limits(valid, &limits)) return "\"type\": [\"number\", \"string\"]" + limits;
  std::string words;
  for (std::string_view rest = valid; !rest.empty();) {
    const std::size_t comma = rest.find(", ");
    words += (words.empty() ? "" : ", ") + JsonText(rest.substr(0, comma));
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 2);
  }
  return "\"enum\": [" + words + "]";
}

std::string About(const KeyRule& rule) {
  return (rule.standard && !rule.standard->empty() ? "default " + *rule.standard : std::string("no default")) +
         "; valid: " + rule.valid;
}

bool HasValuesOnly(const Map& map) {
  return std::none_of(map.keys.begin(), map.keys.end(), [](const Map::Key& key) { return key.map != nullptr; });
}

void WriteMap(const Map& map, int depth, const std::string& indent, std::string* out) {
  const std::string deeper = indent + "  ";
  *out += "\"type\": \"object\",\n";
  *out += indent +
          "\"additionalProperties\": " + (depth == 0 || (depth == 1 && HasValuesOnly(map)) ? "false" : "true") + ",\n" +
          indent + "\"properties\": {";
  const char* separator = "\n";
  for (const Map::Key& key : map.keys) {
    *out += separator + deeper + JsonText(key.name) + ": {";
    separator = ",\n";
    const bool said = key.rule != nullptr && !key.rule->valid.empty();
    if (said) *out += "\"description\": " + JsonText(About(*key.rule)) + ", ";
    if (key.map == nullptr) {
      *out += said ? TypeOf(key.rule->valid) : "\"type\": \"object\"";
    } else if (key.is_list) {
      *out += "\"type\": \"array\", \"items\": {";
      WriteMap(*key.map, depth + 2, deeper, out);
      *out += "}";
    } else {
      WriteMap(*key.map, depth + 1, deeper, out);
    }
    *out += "}";
  }
  *out += "\n" + indent + "}";
}

}  // namespace

std::string JsonSchema(std::span<const KeyRule> rules, std::string_view title) {
  Map root;
  for (const KeyRule& rule : rules) Insert(&root, rule);
  std::string out =
      "{\n  \"$schema\": \"https://json-schema.org/draft/2020-12/schema\",\n  \"title\": " + JsonText(title) + ",\n  ";
  WriteMap(root, 0, "  ", &out);
  return out + "\n}\n";
}

}  // namespace fulcrum::config
