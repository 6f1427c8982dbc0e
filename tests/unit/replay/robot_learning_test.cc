// The parts of a set for robot learning: tables as Parquet, states between samples.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "services/apps/replayer/kinematics.h"
#include "services/apps/replayer/parquet_file.h"
#include "tests/support/parquet_reader.h"

namespace fulcrum::replay {
namespace {

std::string FileOf(const std::vector<ParquetColumn>& columns) {
  const auto bytes = ParquetOf(columns);
  return {bytes.begin(), bytes.end()};
}

TEST(ParquetFile, HasEachValueAtItsPlace) {
  std::vector<float> pairs;
  std::vector<std::int64_t> numbers;
  std::vector<bool> odd;
  constexpr int kRows = 300;  // Counts above 127 take two bytes.
  for (int i = 0; i < kRows; ++i) {
    pairs.insert(pairs.end(), {0.5f * static_cast<float>(i), -static_cast<float>(i), 1e-20f});
    numbers.push_back((std::int64_t{1} << 40) * i - 7);
    odd.push_back(i % 2 == 1);
  }
  const auto table = fulcrum::testing::ReadParquet(FileOf({{"a.triple", pairs, 3}, {"number", numbers}, {"odd", odd}}));
  EXPECT_EQ(table.rows, kRows);
  ASSERT_EQ(table.columns.size(), 3u);
  const auto &triple = table.columns.at("a.triple"), &number = table.columns.at("number"),
             &is = table.columns.at("odd");
  EXPECT_EQ(triple.type, 4);
  EXPECT_EQ(number.type, 2);
  EXPECT_EQ(is.type, 0);
  ASSERT_EQ(triple.values.size(), std::size_t{kRows});
  ASSERT_EQ(number.values.size(), std::size_t{kRows});
  ASSERT_EQ(is.values.size(), std::size_t{kRows});
  for (int i = 0; i < kRows; ++i) {
    const auto row = static_cast<std::size_t>(i);
    EXPECT_EQ(triple.values[row], (std::vector<double>{0.5 * i, -1.0 * i, static_cast<double>(1e-20f)}));
    EXPECT_EQ(number.values[row], std::vector<double>{std::ldexp(i, 40) - 7});
    EXPECT_EQ(is.values[row], std::vector<double>{static_cast<double>(i % 2)});
  }
}

TEST(ParquetFile, HasTheSchemaOfLists) {
  // LogicalTypes.md of the format: a list is a group LIST of one repeated group "list" of one "element".
  const auto table = fulcrum::testing::ReadParquet(
      FileOf({{"pair", std::vector<float>{1, 2, 3, 4}, 2}, {"number", std::vector<std::int64_t>{5, 6}}}));
  using Element = fulcrum::testing::ParquetTable::Element;
  constexpr int kNone = -1, kFloat = 4, kInt64 = 2, kRequired = 0, kRepeated = 2, kList = 3;
  EXPECT_EQ(table.schema, (std::vector<Element>{{"schema", kNone, kNone, 2, kNone},
                                                {"pair", kNone, kRequired, 1, kList},
                                                {"list", kNone, kRepeated, 1, kNone},
                                                {"element", kFloat, kRequired, kNone, kNone},
                                                {"number", kInt64, kRequired, kNone, kNone}}));
  const auto &pair = table.columns.at("pair"), &number = table.columns.at("number");
  EXPECT_EQ(pair.path, (std::vector<std::string>{"pair", "list", "element"}));
  EXPECT_EQ(number.path, std::vector<std::string>{"number"});
  for (const auto* column : {&pair, &number}) {
    EXPECT_EQ(column->codec, 0) << "not compressed";
    EXPECT_EQ(column->encodings, (std::vector<int>{0, 3})) << "values PLAIN, levels RLE";
    EXPECT_EQ(column->page_encodings, (std::vector<int>{0, 3, 3}));
  }
}

TEST(ParquetFile, RefusesColumnsOfOtherLengths) {
  const std::vector<std::int64_t> two{1, 2}, three{1, 2, 3};
  EXPECT_THROW((void)ParquetOf({}), std::logic_error);
  EXPECT_THROW((void)FileOf({{"a", std::vector<float>{}}}), std::logic_error);
  EXPECT_THROW((void)FileOf({{"a", two}, {"b", three}}), std::logic_error);
  EXPECT_THROW((void)FileOf({{"a", two, 2}, {"b", three, 2}}), std::logic_error) << "half a list";
}

TEST(ParquetFile, HasTheseBytes) {
  // Worked out by hand from parquet.thrift and Thrift's compact protocol: one column "n" of one int64, 5.
  const std::string page_header = {0x15, 0x00, 0x15, 0x10, 0x15, 0x10, 0x2C, 0x15, 0x02,
                                   0x15, 0x00, 0x15, 0x06, 0x15, 0x06, 0x00, 0x00};
  const std::string value = {5, 0, 0, 0, 0, 0, 0, 0};
  const std::string schema = std::string{0x15, 0x02, 0x19, 0x2C} +  // Version 1, two elements:
                             std::string{0x48, 0x06} + "schema" + std::string{0x15, 0x02, 0x00} +  // the root,
                             std::string{0x15, 0x04, 0x25, 0x00, 0x18, 0x01} + "n" + std::string{0x00};
  const std::string rows = {0x16, 0x02};
  const std::string chunk =
      std::string{0x19, 0x1C, 0x19, 0x1C, 0x26, 0x08, 0x1C, 0x15, 0x04, 0x19, 0x25, 0x00, 0x06, 0x19, 0x18, 0x01} +
      "n" + std::string{0x15, 0x00, 0x16, 0x02, 0x16, 0x32, 0x16, 0x32, 0x26, 0x08, 0x00, 0x00};
  const std::string group_end = {0x16, 0x32, 0x16, 0x02, 0x00};
  const std::string by = std::string{0x28, 0x07} + "Fulcrum" + std::string{0x00};
  const std::string footer = schema + rows + chunk + group_end + by;
  const std::string size = {static_cast<char>(footer.size()), 0, 0, 0};
  EXPECT_EQ(FileOf({{"n", std::vector<std::int64_t>{5}}}), "PAR1" + page_header + value + footer + size + "PAR1");
}

ToolState ToolsAt(std::int64_t stamp_ns, float x, float angle_rad) {
  ToolState tools;
  tools.stamp.sequence = 1;
  tools.stamp.stamp_ns = stamp_ns;
  tools.tools[0].p_WT = Vec3f(x, 0, 0);
  tools.tools[0].q_WT = Quatf(Eigen::AngleAxisf(angle_rad, Vec3f::UnitZ()));
  return tools;
}

TEST(Kinematics, AreLinearBetweenSamples) {
  Kinematics kinematics;
  EXPECT_TRUE(kinematics.empty());
  ToolState second = ToolsAt(3'000'000, 0.3f, 0.4f);
  second.tools[0].q_WT.coeffs() = -second.tools[0].q_WT.coeffs();  // The same orientation.
  HandleState open, closed;
  open.stamp = {1, 0, 1'000'000};
  open.handles[0].jaw_angle_rad = 1;
  closed.stamp = {2, 0, 6'000'000};
  closed.pedals = kPedalCut;
  kinematics.Add(ToolsAt(1'000'000, 0.1f, 0));
  kinematics.Add(second);
  kinematics.Add(open);
  kinematics.Add(closed);
  const KinematicState half = kinematics.At(2'000'000);
  EXPECT_NEAR(half.tools[0].tip_W.x(), 0.2, 1e-7);
  EXPECT_NEAR(half.tools[0].q_WT.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vec3d::UnitZ()))), 0, 1e-6);
  EXPECT_NEAR(half.tools[0].jaw_rad, 0.8, 1e-7);
  EXPECT_EQ(half.pedals, kPedalNone);
  EXPECT_EQ(kinematics.At(6'000'000).pedals, kPedalCut);
  EXPECT_NEAR(kinematics.At(0).tools[0].tip_W.x(), 0.1, 1e-7) << "before the first sample";
  EXPECT_NEAR(kinematics.At(9'000'000).tools[0].tip_W.x(), 0.3, 1e-7) << "after the last one";
}

TEST(Kinematics, HoldOverAGap) {
  Kinematics kinematics;
  kinematics.Add(ToolsAt(0, 0.1f, 0));
  kinematics.Add(ToolsAt(1'000'000'000, 0.3f, 0));
  kinematics.Add(ToolsAt(500'000'000, 9, 0));  // Of a writer that was restarted: older.
  EXPECT_NEAR(kinematics.At(999'000'000).tools[0].tip_W.x(), 0.1, 1e-7);
  EXPECT_NEAR(kinematics.At(1'000'000'000).tools[0].tip_W.x(), 0.3, 1e-7);
}

}  // namespace
}  // namespace fulcrum::replay
