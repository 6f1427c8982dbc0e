// Attempts that a test tries, each by its name in a test program of this build.
#pragma once

#include <span>
#include <string>

namespace fulcrum {

struct ListedAttempt {
  const char* name;     ///< What is tried, and from where.
  const char* program;  ///< Test program.
  const char* test;     ///< Its test, which passes when the attempt is refused.
};
[[nodiscard]] std::span<const ListedAttempt> ListedAttempts();

/// Runs the test. @return true if it ran and passed; a test that is skipped has refused nothing.
[[nodiscard]] bool IsRefused(const ListedAttempt& attempt, std::string* said);

}  // namespace fulcrum
