#include "services/base/config/strict_yaml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <string>

#include "services/base/config/units.h"
#include "services/base/config/yaml_tree.h"

namespace fulcrum::config {

using internal::Document;
using internal::Node;
using internal::NodeKind;

namespace {

/// Shortest text that reads back to the same number.
std::string Shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// Text of a default. Most are floats of the parameter structs in SI: 0.2f m is meant as 200 mm, not as
/// 200.00000298023224 mm.
std::string DefaultText(double value) {
  char text[32];
  const char* end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr;
  double rounded = 0;
  std::from_chars(text, end, rounded);
  const double float_rounding = std::numeric_limits<float>::epsilon() * std::abs(value);
  return std::abs(rounded - value) <= float_rounding ? Shortest(rounded) : Shortest(value);
}

std::string Describe(const Range& range, const Unit* unit) {
  std::string text;
  if (std::isfinite(range.min) && std::isfinite(range.max)) {
    text = (range.min_open ? "above " : "") + Shortest(range.min) + (range.min_open ? " up to " : " to ") +
           Shortest(range.max);
  } else if (std::isfinite(range.min)) {
    text = (range.min_open ? "above " : "at least ") + Shortest(range.min);
  } else if (std::isfinite(range.max)) {
    text = "at most " + Shortest(range.max);
  } else {
    text = "any number";
  }
  return unit ? text + " " + std::string(unit->spelling) : text;
}

const char* KindName(const Node& node) {
  switch (node.kind) {
    case NodeKind::kNull:
      return "nothing";
    case NodeKind::kScalar:
      return "a single value";
    case NodeKind::kList:
      return "a list";
    case NodeKind::kMap:
      return "a map";
  }
  return "?";
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kShown = 60;
  std::string quoted = "'";
  quoted += text.substr(0, kShown);
  quoted += text.size() > kShown ? "…'" : "'";
  return quoted;
}

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

/// `value unit` text in the unit of the key; throws through document.Fail.
double ParseNumber(const Document& document, const Node& node, const Unit* unit, const Range& range) {
  const std::string valid = "; valid: " + Describe(range, unit);
  if (node.kind != NodeKind::kScalar) {
    document.Fail(node.line, node.path, std::string("expected a number, found ") + KindName(node) + valid);
  }
  double value = 0;
  const char* begin = node.text.data();
  const char* end = begin + node.text.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || !std::isfinite(value)) {
    document.Fail(node.line, node.path, Quoted(node.text) + " is not a finite number" + valid);
  }
  const std::string_view rest(stop, static_cast<std::size_t>(end - stop));
  if (!rest.empty()) {
    const Unit* given = UnitOfSpelling(rest);
    if (!given) {
      document.Fail(node.line, node.path, Quoted(node.text) + ": unknown unit or stray text" + valid);
    }
    if (!unit) {
      document.Fail(node.line, node.path, Quoted(node.text) + " has a unit, but this is a plain number" + valid);
    }
    if (given->dimension != unit->dimension) {
      document.Fail(node.line, node.path,
                    Quoted(node.text) + " has the wrong unit: this is a " + std::string(unit->dimension) + " in " +
                        std::string(unit->spelling) + valid);
    }
    value = given == unit ? value : value * given->si / unit->si;
  }
  if (!range.Contains(value)) {
    document.Fail(node.line, node.path, Quoted(node.text) + " is out of range" + valid);
  }
  return value;
}

double SiFactor(std::string_view key) {
  const Unit* unit = UnitOfKey(key);
  return unit ? unit->si : 1.0;
}

std::string Count(std::size_t min_count, std::size_t max_count) {
  return (min_count == max_count ? "" : std::to_string(min_count) + " to ") + std::to_string(max_count);
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

void CheckAllUsed(const Document& document, const Node& map) {
  for (const auto& entry : map.entries) {
    const std::string& key = entry.first;
    const Node* node = entry.second;
    const auto asked = std::find_if(map.asked.begin(), map.asked.end(), [&](const auto& a) { return a.key == key; });
    if (asked == map.asked.end()) {
      const auto nearest = std::min_element(map.asked.begin(), map.asked.end(), [&](const auto& a, const auto& b) {
        return Distance(key, a.key) < Distance(key, b.key);
      });
      std::string hint = "remove it";
      if (nearest != map.asked.end()) {
        if (Distance(key, nearest->key) <= std::max<std::size_t>(2, key.size() / 2)) {
          hint = "did you mean '" + nearest->key + "'?";
        } else {
          hint += "; known here:";
          for (const auto& a : map.asked) {
            hint += " " + a.key;
          }
        }
      }
      document.Fail(node->line, node->path, "unknown key; " + hint);
    }
    for (const Node* child : asked->maps) {
      CheckAllUsed(document, *child);
    }
  }
}

}  // namespace

// ------------------------------------------------------------------------------------------------- StrictMap

bool StrictMap::Has(std::string_view key) const { return node_->Find(key) != nullptr; }

std::vector<std::string> StrictMap::Keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : node_->entries) {
    keys.push_back(entry.first);
  }
  return keys;
}

Node* StrictMap::Use(std::string_view key) {
  for (const Node::Asked& asked : node_->asked) {
    if (asked.key == key) {
      throw std::logic_error("configuration key '" + std::string(key) + "' of '" + node_->path + "' is read twice");
    }
  }
  node_->asked.emplace_back().key = key;
  Node* node = node_->Find(key);
  if (node && node->kind == NodeKind::kNull) {
    document_->Fail(node->line, node->path, "has no value; give one or remove the key");
  }
  return node;
}

Node* StrictMap::Require(std::string_view key, std::string_view what) {
  Node* node = Use(key);
  if (!node) {
    Fail(key, "is missing; give " + std::string(what));
  }
  return node;
}

void StrictMap::Rule(std::string valid, std::optional<std::string> standard) {
  node_->asked.back().valid = std::move(valid);
  node_->asked.back().standard = std::move(standard);
}

void StrictMap::Fail(std::string_view key, std::string_view reason) const {
  const Node* node = node_->Find(key);
  const std::string path = node_->path.empty() ? std::string(key) : node_->path + "." + std::string(key);
  document_->Fail(node ? node->line : node_->line, path, reason);
}

double StrictMap::ReadNumber(std::string_view key, const double* default_value, const Range& range) {
  const Unit* unit = UnitOfKey(key);
  const Node* node = default_value ? Use(key) : Require(key, Describe(range, unit));
  const double value = node ? ParseNumber(*document_, *node, unit, range) : *default_value;
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = node ? Shortest(value) : DefaultText(value);
  Rule(Describe(range, unit), default_value ? std::optional(DefaultText(*default_value)) : std::nullopt);
  return value;
}

double StrictMap::Number(std::string_view key, const Range& range) { return ReadNumber(key, nullptr, range); }

double StrictMap::Number(std::string_view key, double default_value, const Range& range) {
  return ReadNumber(key, &default_value, range);
}

double StrictMap::NumberSi(std::string_view key, const Range& range) {
  return ReadNumber(key, nullptr, range) * SiFactor(key);
}

double StrictMap::NumberSi(std::string_view key, double default_si, const Range& range) {
  const double default_value = default_si / SiFactor(key);
  const double value = ReadNumber(key, &default_value, range);
  return Has(key) ? value * SiFactor(key) : default_si;
}

std::int64_t StrictMap::ReadInteger(std::string_view key, const std::int64_t* default_value, std::int64_t min,
                                    std::int64_t max) {
  const std::string valid = "an integer from " + std::to_string(min) + " to " + std::to_string(max);
  const Node* node = default_value ? Use(key) : Require(key, valid);
  std::int64_t value = default_value ? *default_value : 0;
  if (node) {
    const char* end = node->text.data() + node->text.size();
    const auto [stop, error] = std::from_chars(node->text.data(), end, value);
    if (node->kind != NodeKind::kScalar || error != std::errc() || stop != end || value < min || value > max) {
      document_->Fail(node->line, node->path,
                      (node->kind == NodeKind::kScalar ? Quoted(node->text) : KindName(*node)) +
                          std::string(" is not valid; valid: ") + valid);
    }
  }
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = std::to_string(value);
  Rule(valid, default_value ? std::optional(std::to_string(*default_value)) : std::nullopt);
  return value;
}

std::int64_t StrictMap::Integer(std::string_view key, std::int64_t min, std::int64_t max) {
  return ReadInteger(key, nullptr, min, max);
}

std::int64_t StrictMap::Integer(std::string_view key, std::int64_t default_value, std::int64_t min, std::int64_t max) {
  return ReadInteger(key, &default_value, min, max);
}

bool StrictMap::ReadFlag(std::string_view key, const bool* default_value) {
  const Node* node = default_value ? Use(key) : Require(key, "true or false");
  bool value = default_value && *default_value;
  if (node) {
    value = node->text == "true";
    if (node->kind != NodeKind::kScalar || (!value && node->text != "false")) {
      document_->Fail(node->line, node->path,
                      (node->kind == NodeKind::kScalar ? Quoted(node->text) : KindName(*node)) +
                          std::string(" is not valid; valid: true, false"));
    }
  }
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = value ? "true" : "false";
  Rule("true, false", default_value ? std::optional<std::string>(*default_value ? "true" : "false") : std::nullopt);
  return value;
}

bool StrictMap::Flag(std::string_view key) { return ReadFlag(key, nullptr); }

bool StrictMap::Flag(std::string_view key, bool default_value) { return ReadFlag(key, &default_value); }

std::string StrictMap::ReadText(std::string_view key, const std::string_view* default_value, std::size_t max_length) {
  const std::string valid = "a text of 1 to " + std::to_string(max_length) + " bytes";
  const Node* node = default_value ? Use(key) : Require(key, valid);
  std::string value(default_value ? *default_value : "");
  if (node) {
    const bool printable = std::none_of(node->text.begin(), node->text.end(),
                                        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
    if (node->kind != NodeKind::kScalar || node->text.empty() || node->text.size() > max_length || !printable) {
      document_->Fail(node->line, node->path,
                      (node->kind == NodeKind::kScalar ? Quoted(node->text) : KindName(*node)) +
                          std::string(" is not valid; valid: ") + valid);
    }
    value = node->text;
  }
  node_->asked.back().form = value.empty() ? Node::Form::kAbsent : Node::Form::kQuoted;
  node_->asked.back().text = value;
  Rule(valid, default_value ? std::optional<std::string>(*default_value) : std::nullopt);
  return value;
}

std::string StrictMap::Text(std::string_view key, std::size_t max_length) { return ReadText(key, nullptr, max_length); }

std::string StrictMap::TextOr(std::string_view key, std::string_view default_value, std::size_t max_length) {
  return ReadText(key, &default_value, max_length);
}

std::size_t StrictMap::ChoiceIndex(std::string_view key, const std::size_t* default_index,
                                   const std::vector<std::string_view>& words) {
  std::string valid;
  for (const std::string_view word : words) {
    valid += (valid.empty() ? "" : ", ") + std::string(word);
  }
  const Node* node = default_index ? Use(key) : Require(key, "one of: " + valid);
  std::size_t index = default_index ? *default_index : 0;
  if (node) {
    index = static_cast<std::size_t>(std::find(words.begin(), words.end(), node->text) - words.begin());
    if (node->kind != NodeKind::kScalar || index == words.size()) {
      document_->Fail(node->line, node->path,
                      (node->kind == NodeKind::kScalar ? Quoted(node->text) : KindName(*node)) +
                          std::string(" is not valid; valid: ") + valid);
    }
  }
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = words[index];
  Rule(valid, default_index ? std::optional<std::string>(words[*default_index]) : std::nullopt);
  return index;
}

std::optional<std::vector<double>> StrictMap::ReadNumbers(std::string_view key, std::size_t min_count,
                                                          std::size_t max_count, const Range& range) {
  const Unit* unit = UnitOfKey(key);
  const std::string count = Count(min_count, max_count);
  const Node* node = Use(key);
  Rule(count + " numbers, each " + Describe(range, unit), std::nullopt);
  if (!node) {
    return {};
  }
  if (node->kind != NodeKind::kList || node->items.size() < min_count || node->items.size() > max_count) {
    const std::string found = node->kind == NodeKind::kList ? "a list of " + std::to_string(node->items.size())
                                                            : std::string(KindName(*node));
    document_->Fail(node->line, node->path,
                    "expected a list of " + count + " numbers, found " + found + "; each: " + Describe(range, unit));
  }
  std::vector<double> values;
  for (const Node* item : node->items) {
    values.push_back(ParseNumber(*document_, *item, unit, range));
  }
  return values;
}

std::vector<double> StrictMap::Numbers(std::string_view key, std::size_t min_count, std::size_t max_count,
                                       const Range& range) {
  const auto values = ReadNumbers(key, min_count, max_count, range);
  if (!values) {
    Fail(key, "is missing; give a list of numbers, each " + Describe(range, UnitOfKey(key)));
  }
  node_->asked.back().form = Node::Form::kFlow;
  for (const double value : *values) {
    node_->asked.back().list.push_back(Shortest(value));
  }
  return *values;
}

std::vector<double> StrictMap::NumbersSi(std::string_view key, std::size_t min_count, std::size_t max_count,
                                         const Range& range) {
  std::vector<double> values = Numbers(key, min_count, max_count, range);
  std::for_each(values.begin(), values.end(), [si = SiFactor(key)](double& value) { value *= si; });
  return values;
}

std::vector<double> StrictMap::NumbersSi(std::string_view key, const std::vector<double>& default_si,
                                         std::size_t min_count, std::size_t max_count, const Range& range) {
  if (Has(key)) {
    return NumbersSi(key, min_count, max_count, range);
  }
  Use(key);
  node_->asked.back().form = Node::Form::kFlow;
  std::string standard = "[";
  for (const double value : default_si) {
    node_->asked.back().list.push_back(DefaultText(value / SiFactor(key)));
    standard += (standard.size() == 1 ? "" : ", ") + node_->asked.back().list.back();
  }
  Rule(Count(min_count, max_count) + " numbers, each " + Describe(range, UnitOfKey(key)), standard + "]");
  return default_si;
}

Vec3f StrictMap::Vector3Si(std::string_view key, const Range& range) {
  const std::vector<double> v = NumbersSi(key, 3, 3, range);
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

Vec3f StrictMap::Vector3Si(std::string_view key, const Vec3f& default_si, const Range& range) {
  const std::vector<double> v = NumbersSi(key, {default_si.x(), default_si.y(), default_si.z()}, 3, 3, range);
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

std::vector<std::string> StrictMap::Texts(std::string_view key, std::size_t min_count, std::size_t max_count) {
  const std::string valid = "a list of " + std::to_string(min_count) + " to " + std::to_string(max_count) + " texts";
  const Node* node = min_count == 0 ? Use(key) : Require(key, valid);
  Rule(valid, min_count == 0 ? std::optional<std::string>("none") : std::nullopt);
  if (!node) {
    return {};
  }
  if (node->kind != NodeKind::kList || node->items.size() < min_count || node->items.size() > max_count) {
    document_->Fail(node->line, node->path, "expected " + valid + ", found " + KindName(*node));
  }
  std::vector<std::string> texts;
  for (const Node* item : node->items) {
    if (item->kind != NodeKind::kScalar || item->text.empty()) {
      document_->Fail(item->line, item->path, "expected a text, found " + std::string(KindName(*item)));
    }
    texts.push_back(item->text);
  }
  node_->asked.back().form = Node::Form::kQuotedList;
  node_->asked.back().list = texts;
  return texts;
}

StrictMap StrictMap::Map(std::string_view key) {
  Require(key, "a map");
  node_->asked.pop_back();
  return *OptionalMap(key);
}

StrictMap StrictMap::MapOrDefaults(std::string_view key) {
  if (std::optional<StrictMap> map = OptionalMap(key)) {
    return *map;
  }
  const std::string path = node_->path.empty() ? std::string(key) : node_->path + "." + std::string(key);
  Node* absent = document_->NewNode(NodeKind::kMap, 0, path);
  node_->asked.back().form = Node::Form::kMap;
  node_->asked.back().maps = {absent};
  return {document_, absent};
}

std::optional<StrictMap> StrictMap::OptionalMap(std::string_view key) {
  Node* node = Use(key);
  if (!node) {
    return {};
  }
  if (node->kind != NodeKind::kMap) {
    document_->Fail(node->line, node->path, std::string("expected a map, found ") + KindName(*node));
  }
  node_->asked.back().form = Node::Form::kMap;
  node_->asked.back().maps = {node};
  return StrictMap(document_, node);
}

std::vector<StrictMap> StrictMap::Maps(std::string_view key, std::size_t min_count, std::size_t max_count) {
  const std::string valid = "a list of " + std::to_string(min_count) + " to " + std::to_string(max_count) + " maps";
  const Node* node = min_count == 0 ? Use(key) : Require(key, valid);
  Rule(valid, min_count == 0 ? std::optional<std::string>("none") : std::nullopt);
  if (!node) {
    return {};
  }
  if (node->kind != NodeKind::kList || node->items.size() < min_count || node->items.size() > max_count) {
    const std::string found = node->kind == NodeKind::kList ? std::to_string(node->items.size()) : KindName(*node);
    document_->Fail(node->line, node->path, "expected " + valid + ", found " + found);
  }
  std::vector<StrictMap> maps;
  for (Node* item : node->items) {
    if (item->kind != NodeKind::kMap) {
      document_->Fail(item->line, item->path, std::string("expected a map, found ") + KindName(*item));
    }
    maps.push_back(StrictMap(document_, item));
  }
  node_->asked.back().form = Node::Form::kMaps;
  node_->asked.back().maps = node->items;
  return maps;
}

// ------------------------------------------------------------------------------------------------ StrictYaml

StrictYaml StrictYaml::FromFile(const std::filesystem::path& file) {
  return FromText(internal::ReadTextFile(file.string()), file.string());
}

StrictYaml StrictYaml::FromText(std::string_view text, std::string_view name) {
  return StrictYaml(internal::ParseDocument(text, name));
}

StrictYaml StrictYaml::FromFileOnBases(const std::filesystem::path& file, const std::vector<std::string_view>& own,
                                       std::string_view text) {
  constexpr std::size_t kMostBases = 8;  // More is a circle.
  constexpr std::string_view kBase = "base";
  const auto parse = [](const std::filesystem::path& at) {
    return internal::ParseDocument(internal::ReadTextFile(at.string()), at.string());
  };
  const auto take = [&](Document* document, std::string_view key) -> const Node* {
    auto& entries = document->root->entries;
    const auto at = std::find_if(entries.begin(), entries.end(), [&](const auto& entry) { return entry.first == key; });
    const Node* node = at == entries.end() ? nullptr : at->second;
    if (node != nullptr) entries.erase(at);
    return node;
  };
  auto document = text.empty() ? parse(file) : internal::ParseDocument(text, file.string() + " with --set applied");
  std::filesystem::path folder = file.parent_path();
  const Node* next = take(document.get(), kBase);
  while (next != nullptr) {
    if (next->kind != NodeKind::kScalar || next->text.empty()) {
      document->Fail(next->line, kBase, std::string("expected the name of a file, found ") + KindName(*next));
    }
    if (document->bases.size() == kMostBases) {
      document->Fail(next->line, kBase, "more than 8 files stand on one another: is there a circle?");
    }
    const std::filesystem::path at = (folder / next->text).lexically_normal();
    if (!std::filesystem::is_regular_file(at)) {
      document->Fail(next->line, kBase,
                     Quoted(next->text) + " is not at " + at.string() + "; give a file beside this one");
    }
    auto below = parse(at);
    const Node* after = take(below.get(), kBase);
    for (const std::string_view key : own) (void)take(below.get(), key);
    folder = at.parent_path();
    internal::LayOver(std::move(below), document.get());
    next = after;
  }
  return StrictYaml(std::move(document));
}

std::vector<std::filesystem::path> StrictYaml::files() const {
  std::vector<std::filesystem::path> all{document_->name};
  all.insert(all.end(), document_->bases.begin(), document_->bases.end());
  return all;
}

StrictYaml::StrictYaml(std::unique_ptr<Document> document) : document_(std::move(document)) {}
StrictYaml::~StrictYaml() = default;
StrictYaml::StrictYaml(StrictYaml&&) noexcept = default;
StrictYaml& StrictYaml::operator=(StrictYaml&&) noexcept = default;

StrictMap StrictYaml::root() { return {document_.get(), document_->root}; }

void StrictYaml::Finish() const { CheckAllUsed(*document_, *document_->root); }

std::string StrictYaml::Effective() const { return internal::EmitAsked(*document_->root); }

std::vector<KeyRule> StrictYaml::Rules() const {
  std::vector<KeyRule> rules;
  AddRules(*document_->root, "", &rules);
  return rules;
}

}  // namespace fulcrum::config
