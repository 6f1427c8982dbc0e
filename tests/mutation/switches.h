// Many faults in one copy of a source file, each behind a switch (tests/mutation/switch.h); for deploy/mutate.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tests/mutation/faults.h"

namespace fulcrum::mutation {

/// A fault of a source file under the number that turns it on.
struct Switch {
  Fault fault;
  int number = 0;
};

/// The source with the faults behind switches. Its lines have the numbers that they have in `source`, also for the
/// compiler, which names `path`. Constants become variables: lines of `constexpr` that hold a fault or depend on one by
/// name are made `const`, and static_assert is left out. A switch may stand where only a constant may, or where the
/// fault has another type: then the result does not compile, with an error in the line of the fault.
[[nodiscard]] std::string WithSwitches(const std::string& source, const std::vector<Switch>& switches,
                                       const std::string& path);

}  // namespace fulcrum::mutation
