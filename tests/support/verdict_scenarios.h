// Sessions with an injected fault and the required verdict. Real processes: with fake nodes
// (tests/integration/supervisor/fake_node.cc), or a whole cart.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace fulcrum::testing {

struct Scenario {
  std::string name;
  bool is_real;       ///< A whole cart: takes longer and needs an idle machine.
  int exit_code;      ///< Exit code of `fulcrum up`.
  std::string fault;  ///< Part of the fault that must be reported when it happens and at the end; empty: no fault.
  std::function<std::string(int domain, int* exit_code, double* picture_back_s)> run;  ///< Returns the output.
};
[[nodiscard]] const std::vector<Scenario>& VerdictScenarios();

struct ScenarioResult {
  std::string wrong;           ///< Error of the verdict; empty: it is right.
  std::string said;            ///< Output of `fulcrum up`.
  double picture_back_s = -1;  ///< From the hang of a picture to the next one [s]; negative: none hung.
};
[[nodiscard]] ScenarioResult RunScenario(const Scenario& scenario, int domain);

}  // namespace fulcrum::testing
