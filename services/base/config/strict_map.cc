// The maps of a strict configuration file: each getter reads one key and records that it was read.
#include <algorithm>
#include <string>

#include "services/base/config/strict_yaml.h"
#include "services/base/config/units.h"
#include "services/base/config/value_text.h"
#include "services/base/config/yaml_tree.h"
#include "services/base/config/yaml_values.h"

namespace fulcrum::config {

using internal::CountText;
using internal::DefaultText;
using internal::KindName;
using internal::Node;
using internal::NodeKind;
using internal::ParseNumber;
using internal::RangeText;
using internal::Shortest;

namespace {

double SiFactor(std::string_view key) {
  const Unit* unit = UnitOfKey(key);
  return unit ? unit->si : 1.0;
}

int FileOf(const Node& node) { return node.line / internal::kLinesPerFile; }

/// Omits what comes from a farther base than `file`. True if nothing of the node remains.
bool OmitBeyond(int file, Node* node) {
  if (node->kind != NodeKind::kMap) return FileOf(*node) > file;
  std::erase_if(node->entries, [&](const auto& entry) { return OmitBeyond(file, entry.second); });
  return node->entries.empty() && FileOf(*node) > file;
}

}  // namespace

bool StrictMap::Has(std::string_view key) const { return node_->Find(key) != nullptr; }

void StrictMap::KeepNearer(std::string_view one, std::string_view other) {
  const Node *a = node_->Find(one), *b = node_->Find(other);
  if (a == nullptr || b == nullptr) return;
  if (FileOf(*a) == FileOf(*b)) return;
  const std::string_view farther = FileOf(*a) > FileOf(*b) ? one : other;
  std::erase_if(node_->entries, [&](const auto& entry) { return entry.first == farther; });
}

bool StrictMap::IsChanged(std::string_view key) const {
  const Node* node = node_->Find(key);
  return node != nullptr && node->replaced != nullptr && node->replaced->text != node->text;
}

void StrictMap::OmitFarther(std::string_view key, std::string_view than) {
  const Node* nearer = node_->Find(than);
  if (nearer == nullptr) return;
  std::erase_if(node_->entries,
                [&](const auto& entry) { return entry.first == key && OmitBeyond(FileOf(*nearer), entry.second); });
}

void StrictMap::Restate(std::string_view key, double value) {
  for (Node::Asked& asked : node_->asked) {
    if (asked.key == key) asked.text = Shortest(value);
  }
}

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
  const Node* node = default_value ? Use(key) : Require(key, RangeText(range, unit));
  const double value = node ? ParseNumber(*document_, *node, unit, range) : *default_value;
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = node ? Shortest(value) : DefaultText(value);
  Rule(RangeText(range, unit), default_value ? std::optional(DefaultText(*default_value)) : std::nullopt);
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
  const std::int64_t value = node ? internal::ParseInteger(*document_, *node, min, max, valid) : *default_value;
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
  const std::string valid = "true, false";
  const Node* node = default_value ? Use(key) : Require(key, "true or false");
  const bool value = node ? internal::ParseFlag(*document_, *node, valid) : *default_value;
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = value ? "true" : "false";
  Rule(valid, default_value ? std::optional<std::string>(*default_value ? "true" : "false") : std::nullopt);
  return value;
}

bool StrictMap::Flag(std::string_view key) { return ReadFlag(key, nullptr); }

bool StrictMap::Flag(std::string_view key, bool default_value) { return ReadFlag(key, &default_value); }

std::string StrictMap::ReadText(std::string_view key, const std::string_view* default_value, std::size_t max_length) {
  const std::string valid = "a text of 1 to " + std::to_string(max_length) + " bytes";
  const Node* node = default_value ? Use(key) : Require(key, valid);
  std::string value = node ? internal::ParseText(*document_, *node, max_length, valid) : std::string(*default_value);
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
  const std::string valid = internal::WordsText(words);
  const Node* node = default_index ? Use(key) : Require(key, "one of: " + valid);
  const std::size_t index = node ? internal::ParseWord(*document_, *node, words, valid) : *default_index;
  node_->asked.back().form = Node::Form::kPlain;
  node_->asked.back().text = words[index];
  Rule(valid, default_index ? std::optional<std::string>(words[*default_index]) : std::nullopt);
  return index;
}

std::optional<std::vector<double>> StrictMap::ReadNumbers(std::string_view key, std::size_t min_count,
                                                          std::size_t max_count, const Range& range) {
  const Unit* unit = UnitOfKey(key);
  const std::string count = CountText(min_count, max_count);
  const Node* node = Use(key);
  Rule(count + " numbers, each " + RangeText(range, unit), std::nullopt);
  if (!node) {
    return {};
  }
  if (node->kind != NodeKind::kList || node->items.size() < min_count || node->items.size() > max_count) {
    const std::string found = node->kind == NodeKind::kList ? "a list of " + std::to_string(node->items.size())
                                                            : std::string(KindName(*node));
    document_->Fail(node->line, node->path,
                    "expected a list of " + count + " numbers, found " + found + "; each: " + RangeText(range, unit));
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
    Fail(key, "is missing; give a list of numbers, each " + RangeText(range, UnitOfKey(key)));
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
  Rule(CountText(min_count, max_count) + " numbers, each " + RangeText(range, UnitOfKey(key)), standard + "]");
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

}  // namespace fulcrum::config
