#include "physics_node/node/contact_rest.h"

#include <algorithm>

#include "tests/unit/physics/node_bench.h"

namespace fulcrum::physics {
namespace {

TEST(ContactRest, PublishesEachTickUntilNothingHasChangedForTenAndTheFirstChangeAtOnce) {
  ContactRest rest;
  ToolState tools;
  tools.stamp = {1, 1, 1};
  std::uint64_t tick = 0;
  const auto due = [&](bool calm) {
    rest.Follow(tools, tools);
    rest.Decide(calm, tick++);
    return rest.due();
  };
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(due(false)) << "near tissue";
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(due(true)) << "repeated, should a sample be lost";
  int published = 0;
  for (int i = 0; i < 100; ++i) {
    if (i % 4 == 0) ++tools.stamp.sequence;
    const bool published_now = due(true);
    EXPECT_EQ(published_now, i % 4 == 0) << "with each ToolState";
    published += published_now ? 1 : 0;
  }
  EXPECT_EQ(published, 25);
  for (int i = 1; i <= 40; ++i) {
    (void)due(true);
    EXPECT_TRUE(i <= 10 || rest.due() == (i % 10 == 7)) << i << ": a servo that is silent does not silence physics";
  }
  EXPECT_TRUE(due(false)) << "tissue has woken";
  for (int i = 0; i < 11; ++i) (void)due(true);
  EXPECT_FALSE(due(true));
  tools.tools[1].p_WT.x() = 1e-6f;
  EXPECT_TRUE(due(true)) << "a tool has moved";
}

TEST_F(PhysicsNodeTest, AtRestContactsComeWithEachToolStateAndDateBySuch) {
  Bench bench(scene_, nullptr);
  auto models = bench.bus_.contacts.MakeInput();
  auto cautery = bench.bus_.cautery.MakeInput();
  const Vec3f place = scene_.rest_position[scene_.membrane.first + scene_.membrane.node_count() / 2];
  const Quatf kDown(0, 1, 0, 0);  // The shaft comes from above.
  const auto ns = [&] { return 1 + static_cast<std::int64_t>(bench.tick_.index) * kPeriod; };
  std::int64_t oldest_ns = 0;
  const auto run = [&](int ticks, int ticks_per_sample, float height_m) {
    int count = 0, hooks = 0;
    oldest_ns = 0;
    for (int i = 0; i < ticks; ++i) {
      if (i % ticks_per_sample == 0) bench.SendTool(1, place + Vec3f(0, 0, height_m), ns(), 1, kDown);
      bench.Step();
      ContactModel model;
      CauteryContact contact;
      while (models->TakeNext(&model)) {
        ++count;
        oldest_ns = std::max(oldest_ns, model.stamp.stamp_ns - model.tool_stamp_ns);
      }
      while (cautery->TakeNext(&contact)) ++hooks;
    }
    EXPECT_EQ(count, hooks);
    return count;
  };
  (void)run(600, 4, 0.06f);  // The tissue comes to rest.
  ASSERT_TRUE(bench.node_.simulation().asleep());
  EXPECT_EQ(run(400, 4, 0.06f), 100);
  EXPECT_LT(oldest_ns, 10'000'000);
  EXPECT_EQ(run(10, 1, 0.059f), 10);
  EXPECT_EQ(models->stats().lost, 0u);
}

}  // namespace
}  // namespace fulcrum::physics
