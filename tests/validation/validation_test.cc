// The cases that take no longer than a second, and what a validation does with files and results.
#include "tests/validation/validation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/base/core/error.h"
#include "tests/support/program.h"
#include "tests/validation/solid_cases.h"

namespace fulcrum::validation {
namespace {

namespace fs = std::filesystem;

const fs::path kExpected = fs::path(FULCRUM_SOURCE_DIR) / "deploy/validation";

std::string Content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class Files : public ::testing::Test {
 protected:
  Files() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
    fs::create_directories(folder_);
    fs::copy(kExpected, folder_, fs::copy_options::recursive);
  }
  /// The error that reading gives once `file` has this line more.
  [[nodiscard]] std::string ErrorWith(const std::string& file, const std::string& line) const {
    std::ofstream(folder_ / file, std::ios::app) << line << '\n';
    try {
      (void)ReadExpectations(folder_);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
  const fs::path folder_ = fs::path(::testing::TempDir()) / "validation_test";
};

TEST_F(Files, AWrongLineIsNamed) {
  EXPECT_NE(ErrorWith("expected.csv", "tube.length,much,m,5,analytic,textbook").find("\"much\" is not a finite number"),
            std::string::npos);
}

TEST_F(Files, AShortLineIsNamed) {
  EXPECT_NE(ErrorWith("expected.csv", "tube.length,1").find("6 fields are needed"), std::string::npos);
}

TEST_F(Files, AToleranceOfNothingIsRefused) {
  EXPECT_NE(ErrorWith("expected.csv", "tube.length,1,m,0,analytic,textbook").find("greater than 0"), std::string::npos);
}

TEST_F(Files, AValueThatNoSolverGaveIsRefused) {
  EXPECT_NE(ErrorWith("expected.csv", "tube.length,calculix,m,5,independent,x").find("not in calculix.csv"),
            std::string::npos);
}

TEST_F(Files, AMissingOrEmptyFileIsAnError) {
  std::ofstream(folder_ / "calculix.csv") << "# nothing\n";
  EXPECT_THROW((void)ReadExpectations(folder_), InputError);
  fs::remove(folder_ / "calculix.csv");
  EXPECT_THROW((void)ReadExpectations(folder_), InputError);
}

TEST_F(Files, AFailureIsShownAsAFailure) {
  const Case halved{"halved", "Half of what is expected, and less and less wrong.", [](Mesh mesh) {
                      return Quantities{{"q", mesh == Mesh::kTwice ? 3.5 : 2}};
                    }};
  const std::vector<Row> rows = RunCase(halved, {{"q", {4, "m", 5, "analytic", "a < b"}}});
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].passed());
  EXPECT_DOUBLE_EQ(rows[0].error_pct, -50);
  EXPECT_DOUBLE_EQ(rows[0].twice_error_pct, -12.5);
  EXPECT_DOUBLE_EQ(rows[0].order, 2);
  EXPECT_EQ(Line(rows[0]).find("FAILED"), 0u);
  WriteJUnit(rows, folder_ / "v.xml");
  EXPECT_NE(Content(folder_ / "v.xml").find("tests=\"1\" failures=\"1\""), std::string::npos);
  EXPECT_NE(Content(folder_ / "v.xml").find("<failure message=\"-50.00 %; at most 5 % is allowed\""),
            std::string::npos);
}

TEST_F(Files, AResultThatIsNoNumberFails) {
  const Case blown{"blown", "", [](Mesh) { return Quantities{{"q", std::nan("")}}; }};
  EXPECT_FALSE(RunCase(blown, {{"q", {4, "m", 5, "analytic", ""}}})[0].passed());
}

/// Fails with a quantity of `results` that is not within its tolerance.
void ExpectWithinTolerance(const Quantities& results) {
  static const Expectations kExpectations = ReadExpectations(kExpected);
  for (const auto& [quantity, value] : results) {
    const Expectation& e = kExpectations.at(quantity);
    EXPECT_LE(100 * std::abs(value / e.value - 1), e.tolerance_pct) << quantity;
  }
}

TEST(Validation, SolidsVibrateAsCalculiXSays) {
  ExpectWithinTolerance(VibrateBar(4));
  ExpectWithinTolerance(VibrateTube(2));
}

TEST(Validation, AWallOfTwoLayersIsPinchedAsCalculiXSays) { ExpectWithinTolerance(Pinch(2)); }

TEST(Validation, ABarBendsFarAsCalculiXSays) { ExpectWithinTolerance(Bend(4)); }

TEST(Validation, ABlockIsDentedAsCalculiXSays) { ExpectWithinTolerance(Dent(8)); }

TEST(Validation, EveryExpectationSaysItsKindAndItsSource) {
  for (const auto& [quantity, expectation] : ReadExpectations(kExpected)) {
    EXPECT_TRUE(expectation.kind == "analytic" || expectation.kind == "reference" ||
                expectation.kind == "independent" || expectation.kind == "published")
        << quantity;
    EXPECT_FALSE(expectation.source.empty()) << quantity;
  }
}

TEST(Command, ListsItsCasesAndRefusesOthers) {
  testing::Program list("fulcrum", {"validate", "--list"});
  EXPECT_EQ(list.End(0), 0);
  for (const Case& one : Cases()) EXPECT_NE(list.Said().find(one.name), std::string::npos);
  testing::Program other("fulcrum", {"validate", "tube-knot"});
  EXPECT_EQ(other.End(0), 2);
  EXPECT_NE(other.Said().find("no case tube-knot"), std::string::npos);
}

TEST(Command, WritesItsPage) {
  const fs::path out = fs::path(::testing::TempDir()) / "validation_page";
  testing::Program run("fulcrum", {"validate", "sheet-moduli", "--out", out.string()});
  EXPECT_EQ(run.End(0), 0) << run.Said();
  EXPECT_NE(Content(out / "validation.html").find("2 of 2 quantities"), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::validation
