// Conditions on figures in a test of a node, for example "cut_length_mm > 30".
#pragma once

#include <string>

namespace fulcrum::replay {

enum class Relation { kLess, kAtMost, kEqual, kUnequal, kAtLeast, kMore };

struct Assertion {
  std::string figure;
  Relation relation = Relation::kEqual;
  double bound = 0;
};

/// Parses FIGURE < | <= | == | != | >= | > NUMBER with any blanks between. Throws InputError with the error and its
/// place.
[[nodiscard]] Assertion ParseAssertion(const std::string& text);

[[nodiscard]] bool Holds(const Assertion& assertion, double value);

/// Text of an assertion in a uniform spelling, for reports.
[[nodiscard]] std::string TextOf(const Assertion& assertion);

}  // namespace fulcrum::replay
