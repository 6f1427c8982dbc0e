#include "services/base/core/operator_choice.h"

#include <gtest/gtest.h>

namespace fulcrum {
namespace {

constexpr std::int64_t kMilli = 1'000'000;

OperatorInput Of(OperatorSource source, std::uint64_t epoch, std::int64_t claim_ns, std::int64_t stamp_ns) {
  OperatorInput input;
  input.stamp = {1, epoch, stamp_ns};
  input.source = source;
  input.claim_ns = claim_ns;
  return input;
}

TEST(OperatorChoice, TheNewestClaimOperates) {
  OperatorChoice choice;
  EXPECT_EQ(choice.At(0), nullptr);
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kWindow, 5, 10 * kMilli, 10 * kMilli)));
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kProgram, 6, 20 * kMilli, 20 * kMilli)));
  EXPECT_FALSE(choice.Add(Of(OperatorSource::kWindow, 5, 10 * kMilli, 30 * kMilli))) << "an older claim";
  ASSERT_NE(choice.At(30 * kMilli), nullptr);
  EXPECT_EQ(choice.At(30 * kMilli)->source, OperatorSource::kProgram);
}

TEST(OperatorChoice, OnlyTheOperatorReleases) {
  OperatorChoice choice;
  EXPECT_FALSE(choice.Add(Of(OperatorSource::kWindow, 5, 0, kMilli))) << "nothing was claimed";
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kWindow, 5, 10 * kMilli, 10 * kMilli)));
  EXPECT_FALSE(choice.Add(Of(OperatorSource::kProgram, 6, 0, 11 * kMilli)));
  EXPECT_NE(choice.At(11 * kMilli), nullptr);
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kWindow, 5, 0, 12 * kMilli)));
  EXPECT_EQ(choice.At(12 * kMilli), nullptr);
}

TEST(OperatorChoice, AfterAReleaseAnOlderClaimDoesNotOperateAgain) {
  OperatorChoice choice;
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kWindow, 5, 10 * kMilli, 10 * kMilli)));
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kBrowser, 6, 20 * kMilli, 20 * kMilli)));
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kBrowser, 6, 0, 30 * kMilli)));
  EXPECT_FALSE(choice.Add(Of(OperatorSource::kWindow, 5, 10 * kMilli, 40 * kMilli)));
  EXPECT_FALSE(choice.Add(Of(OperatorSource::kBrowser, 6, 20 * kMilli, 29 * kMilli))) << "sent before the release";
  EXPECT_EQ(choice.At(40 * kMilli), nullptr);
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kWindow, 5, 50 * kMilli, 50 * kMilli))) << "it has claimed them anew";
  EXPECT_NE(choice.At(50 * kMilli), nullptr);
}

TEST(OperatorChoice, ASilentOperatorIsAbsent) {
  OperatorChoice choice;
  EXPECT_TRUE(choice.Add(Of(OperatorSource::kWindow, 5, 10 * kMilli, 10 * kMilli)));
  EXPECT_NE(choice.At(10 * kMilli + kOperatorSilence_ns), nullptr);
  EXPECT_EQ(choice.At(11 * kMilli + kOperatorSilence_ns), nullptr);
}

}  // namespace
}  // namespace fulcrum
