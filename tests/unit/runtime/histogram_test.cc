#include "services/base/runtime/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace fulcrum::runtime {
namespace {

TEST(Histogram, EmptyHasNoQuantiles) {
  const Histogram histogram;
  EXPECT_EQ(histogram.snapshot().Quantile(0.5), 0);
  EXPECT_EQ(histogram.snapshot().count, 0u);
}

TEST(Histogram, SmallValuesAreExact) {
  Histogram histogram;
  for (int i = 0; i < 16; ++i) histogram.Add(i);
  EXPECT_EQ(histogram.snapshot().Quantile(0.5), 7);
  EXPECT_EQ(histogram.snapshot().Quantile(0.0), 0);
  EXPECT_EQ(histogram.snapshot().Quantile(1.0), 15);
}

TEST(Histogram, NegativeCountsAsZeroAndHugeStaysInTheLastBin) {
  Histogram histogram;
  histogram.Add(-5);
  EXPECT_EQ(histogram.snapshot().Quantile(1.0), 0);
  histogram.Add(std::int64_t{1} << 60);
  const HistogramSnapshot snapshot = histogram.snapshot();
  EXPECT_EQ(snapshot.count, 2u);
  EXPECT_EQ(snapshot.bins.back(), 1u);
  EXPECT_EQ(snapshot.max_ns, std::int64_t{1} << 60);
}

// A bin is a sixteenth of its power of two wide, so a quantile is at most 1/16 above the sample it stands for.
TEST(Histogram, QuantilesAreWithinOneSixteenthAboveTheTruth) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(0.0, 10.5);  // 1 ns … 31 s.
  Histogram histogram;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 20000; ++i) {
    values.push_back(static_cast<std::int64_t>(std::pow(10.0, exponent(random))));
    histogram.Add(values.back());
  }
  std::sort(values.begin(), values.end());
  const HistogramSnapshot snapshot = histogram.snapshot();
  for (const double q : {0.01, 0.1, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * 20000.0)) - 1;
    EXPECT_GE(snapshot.Quantile(q), values[rank]) << q;
    EXPECT_LE(static_cast<double>(snapshot.Quantile(q)), 1.0625 * static_cast<double>(values[rank])) << q;
  }
  EXPECT_EQ(snapshot.Quantile(1.0), values.back());
}

}  // namespace
}  // namespace fulcrum::runtime
