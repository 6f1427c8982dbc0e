// Small faults that could be made in a source file, found by rule; for deploy/mutate.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace fulcrum::mutation {

/// One change of a source file.
struct Fault {
  std::size_t begin = 0, end = 0;  ///< Of the text that is replaced.
  const char* kind = "";           ///< constant, term, unit, sign, border, condition, axis, limit, call.
  std::string text;                ///< In its place.
};

/// All faults of a source file, in the order of their places. Comments, strings, preprocessor lines, heads of templates
/// and static_assert stay as they are. The list depends on the text alone.
[[nodiscard]] std::vector<Fault> FaultsOf(const std::string& source);

/// The source with everything that may not be changed as spaces, so that places stay the same.
[[nodiscard]] std::string CodeOf(const std::string& source);

/// The source with a fault.
[[nodiscard]] std::string WithFault(const std::string& source, const Fault& fault);

/// "LINE KIND OLD -> NEW".
[[nodiscard]] std::string Describe(const std::string& source, const Fault& fault);

}  // namespace fulcrum::mutation
