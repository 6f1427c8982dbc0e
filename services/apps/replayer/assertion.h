// A condition on a figure, as a test of a node states it: "cut_length_mm > 30".
#pragma once

#include <string>

namespace fulcrum::replay {

enum class Relation { kLess, kAtMost, kEqual, kUnequal, kAtLeast, kMore };

struct Assertion {
  std::string figure;
  Relation relation = Relation::kEqual;
  double bound = 0;
};

/// FIGURE < | <= | == | != | >= | > NUMBER, blanks as one likes. Throws InputError, which says what is wrong and where.
[[nodiscard]] Assertion ParseAssertion(const std::string& text);

[[nodiscard]] bool Holds(const Assertion& assertion, double value);

/// In one spelling, for reports.
[[nodiscard]] std::string TextOf(const Assertion& assertion);

}  // namespace fulcrum::replay
