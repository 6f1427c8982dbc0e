#include "services/apps/replayer/assertion.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string_view>

#include "services/apps/replayer/report_format.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

struct Sign {
  const char* text;
  Relation relation;
};
// Longer signs come first, because "<" is a prefix of "<=".
constexpr std::array<Sign, 6> kSigns{{{"<=", Relation::kAtMost},
                                      {">=", Relation::kAtLeast},
                                      {"==", Relation::kEqual},
                                      {"!=", Relation::kUnequal},
                                      {"<", Relation::kLess},
                                      {">", Relation::kMore}}};

const char* SignOf(Relation relation) {
  return std::find_if(kSigns.begin(), kSigns.end(), [&](const Sign& sign) { return sign.relation == relation; })->text;
}

bool IsOfName(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.'; }

/// Scanner of the parts of an assertion.
class Scan {
 public:
  explicit Scan(const std::string& text) : text_(text) {}

  std::string_view Name() {
    SkipBlanks();
    const std::size_t begin = at_;
    while (at_ < text_.size() && IsOfName(text_[at_])) ++at_;
    const std::string_view name = std::string_view(text_).substr(begin, at_ - begin);
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) != 0 || name[0] == '.') {
      at_ = begin;
      Fail("the name of a figure is missing");
    }
    return name;
  }

  Relation Sign() {
    SkipBlanks();
    const std::string_view rest = std::string_view(text_).substr(at_);
    for (const auto& sign : kSigns) {
      if (!rest.starts_with(sign.text)) continue;
      at_ += std::string_view(sign.text).size();
      return sign.relation;
    }
    Fail(rest.starts_with('=') ? "\"=\" is no comparison, \"==\" is" : "a comparison is missing");
  }

  double Number() {
    SkipBlanks();
    const std::size_t begin = at_;
    const bool plus = at_ < text_.size() && text_[at_] == '+';
    if (plus && text_.compare(at_ + 1, 1, "-") != 0) ++at_;
    double number = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), number);
    // from_chars accepts "inf" and "nan", which are no valid bounds.
    if (error != std::errc() || !std::isfinite(number)) {
      at_ = begin;
      Fail(error == std::errc::result_out_of_range ? "the number is out of range" : "a number is missing");
    }
    at_ = static_cast<std::size_t>(end - text_.data());
    return number;
  }

  void End() {
    SkipBlanks();
    if (at_ < text_.size()) Fail("text after the number; give one --assert for each condition");
  }

 private:
  void SkipBlanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }

  [[noreturn]] void Fail(const std::string& what) const {
    throw InputError("--assert \"" + text_ + "\", at character " + std::to_string(at_ + 1) + ": " + what +
                     ". An assertion is FIGURE < | <= | == | != | >= | > NUMBER, for example \"cut_length_mm > 30\"");
  }

  const std::string& text_;
  std::size_t at_ = 0;
};

}  // namespace

Assertion ParseAssertion(const std::string& text) {
  Scan scan(text);
  Assertion assertion;
  assertion.figure = scan.Name();
  assertion.relation = scan.Sign();
  assertion.bound = scan.Number();
  scan.End();
  return assertion;
}

bool Holds(const Assertion& assertion, double value) {
  // No relation holds for NaN, not even !=.
  if (std::isnan(value)) return false;
  switch (assertion.relation) {
    case Relation::kLess:
      return value < assertion.bound;
    case Relation::kAtMost:
      return value <= assertion.bound;
    case Relation::kEqual:
      return value == assertion.bound;
    case Relation::kUnequal:
      return value != assertion.bound;
    case Relation::kAtLeast:
      return value >= assertion.bound;
    case Relation::kMore:
      return value > assertion.bound;
  }
  return false;
}

std::string TextOf(const Assertion& assertion) {
  return assertion.figure + ' ' + SignOf(assertion.relation) + ' ' + Format("%.10g", assertion.bound);
}

}  // namespace fulcrum::replay
