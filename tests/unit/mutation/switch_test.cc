#include "tests/mutation/switch.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace fulcrum::mutation {
namespace {

/// What a source with switches 1 to 4 computes.
struct Values {
  int sum = 5 - Place<'-'>{1} - 2 * 2;
  bool border = sum < Place<'<'>{2} < 1;
  int larger = Max(3, 4, 6);
  Eigen::Vector2d vector = Eigen::Vector2d(1, 2) + Place<'+'>{4} + 2.0 * Eigen::Vector2d(1, 1);
};

/// Of the test Values.OfTheSwitchThatIsOn in a process of its own.
int RunWithFault(int fault) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string command = "FULCRUM_FAULT=" + std::to_string(fault) + " '" + self +
                              "' --gtest_filter=Values.OfTheSwitchThatIsOn >/dev/null 2>&1";
  return std::system(command.c_str());
}

TEST(Values, OfTheSwitchThatIsOn) {
  const Values values;
  EXPECT_EQ(values.sum, kFault == 1 ? 9 : 1);
  EXPECT_EQ(values.border, kFault == 2);
  EXPECT_EQ(values.larger, kFault == 3 ? 4 : 6);
  EXPECT_EQ(values.vector, kFault == 4 ? Eigen::Vector2d(-1, 0) : Eigen::Vector2d(3, 4));
}

TEST(Values, OfEachSwitch) {
  for (const int fault : {1, 2, 3, 4, 5}) EXPECT_EQ(RunWithFault(fault), 0) << fault;
}

TEST(Record, NamesTheSwitchesThatAreReached) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "reached_switches";
  std::filesystem::remove(file);
  setenv("FULCRUM_FAULT_FILE", file.c_str(), 1);
  Record(12);
  Record(12);
  Record(3);
  unsetenv("FULCRUM_FAULT_FILE");
  EXPECT_EQ(std::filesystem::file_size(file), 5u);  // "12\n3\n"
}

}  // namespace
}  // namespace fulcrum::mutation
