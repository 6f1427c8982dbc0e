#include "services/base/config/yaml_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "services/base/config/value_text.h"

namespace fulcrum::config::internal {
namespace {

[[noreturn]] void RefuseValue(const Document& document, const Node& node, std::string_view valid) {
  std::string reason = node.kind == NodeKind::kScalar ? Quoted(node.text) : KindName(node);
  reason.append(" is not valid; valid: ").append(valid);
  document.Fail(node.line, node.path, reason);
}

}  // namespace

double ParseNumber(const Document& document, const Node& node, const Unit* unit, const Range& range) {
  const std::string valid = "; valid: " + RangeText(range, unit);
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

std::int64_t ParseInteger(const Document& document, const Node& node, std::int64_t min, std::int64_t max,
                          std::string_view valid) {
  std::int64_t value = 0;
  const char* end = node.text.data() + node.text.size();
  const auto [stop, error] = std::from_chars(node.text.data(), end, value);
  if (node.kind != NodeKind::kScalar || error != std::errc() || stop != end || value < min || value > max) {
    RefuseValue(document, node, valid);
  }
  return value;
}

bool ParseFlag(const Document& document, const Node& node, std::string_view valid) {
  const bool value = node.text == "true";
  if (node.kind != NodeKind::kScalar || (!value && node.text != "false")) {
    RefuseValue(document, node, valid);
  }
  return value;
}

std::string ParseText(const Document& document, const Node& node, std::size_t max_length, std::string_view valid) {
  const bool printable = std::none_of(node.text.begin(), node.text.end(),
                                      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (node.kind != NodeKind::kScalar || node.text.empty() || node.text.size() > max_length || !printable) {
    RefuseValue(document, node, valid);
  }
  return node.text;
}

std::size_t ParseWord(const Document& document, const Node& node, const std::vector<std::string_view>& words,
                      std::string_view valid) {
  const auto index = static_cast<std::size_t>(std::find(words.begin(), words.end(), node.text) - words.begin());
  if (node.kind != NodeKind::kScalar || index == words.size()) {
    RefuseValue(document, node, valid);
  }
  return index;
}

}  // namespace fulcrum::config::internal
