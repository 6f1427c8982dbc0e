// The models against theory, experiments and solvers of others: what a case is, and the verdict on its results.
//
// What is expected stands in expected.csv, before a case runs: the value, its tolerance, and who says so. A case gives
// its results on the default mesh, and where it can on one half as fine and one twice as fine.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace fulcrum::validation {

/// Named results of one mesh. An error [%] against a solution that the case itself evaluates has the expected value 0.
using Quantities = std::vector<std::pair<std::string, double>>;

enum class Mesh { kHalf, kDefault, kTwice };

struct Case {
  std::string name;
  std::string about;  ///< One sentence: what is loaded or heated, and how.
  /// An empty result: the case has no such mesh.
  std::function<Quantities(Mesh)> run;
};

/// All cases, in the order in which they are printed.
[[nodiscard]] const std::vector<Case>& Cases();

/// One line of expected.csv.
struct Expectation {
  double value = 0;
  std::string unit;
  double tolerance_pct = 0;  ///< Share of the value; if the value is 0, the quantity is an error in per cent itself.
  std::string kind;  ///< analytic, reference (our own, another method), independent (another solver), published.
  std::string source;
};
using Expectations = std::map<std::string, Expectation>;

/// Reads expected.csv, and calculix.csv beside it for the values that it leaves to that file. Throws InputError with
/// file and line.
[[nodiscard]] Expectations ReadExpectations(const std::filesystem::path& folder);

struct Row {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::string case_name, quantity;
  double measured = kNone;  ///< On the default mesh.
  Expectation expected;
  double error_pct = kNone, half_error_pct = kNone, twice_error_pct = kNone;
  double order = kNone;  ///< Of the error from the default to the mesh twice as fine; none below a tenth of a per cent.
  double run_s = 0;      ///< Time of the whole case on its default mesh.

  [[nodiscard]] bool passed() const;
};

/// Runs a case on its meshes. Throws InputError for a quantity that has no expectation.
[[nodiscard]] std::vector<Row> RunCase(const Case& what, const Expectations& expected);

[[nodiscard]] std::string Line(const Row& row);
void WriteHtml(const std::vector<Row>& rows, const std::filesystem::path& file);
void WriteJUnit(const std::vector<Row>& rows, const std::filesystem::path& file);

}  // namespace fulcrum::validation
