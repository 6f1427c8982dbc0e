// How the node follows time: pace, and frames at rest.
#include <algorithm>
#include <cmath>

#include "physics_node/node/contact_pace.h"
#include "tests/unit/physics/node_bench.h"

namespace fulcrum::physics {
namespace {

TEST_F(PhysicsNodeTest, SaysHowMuchSlowerThanRealTimeTheTissueIs) {
  Bench bench(scene_, nullptr);
  bench.Step();
  bench.Step();
  const auto error = [&] {
    Health health;
    bench.node_.FillHealth(&health);
    return health.last_error;
  };
  for (int i = 0; i < 300; ++i) {
    bench.tick_.index += 3;  // Each step takes four periods and simulates three.
    bench.Step();
  }
  EXPECT_NE(error().find("75 % of real time"), std::string::npos) << error();
  EXPECT_NEAR(bench.Figure("time_lost_s"), 3.0, 1e-6);
  for (int i = 0; i < 600; ++i) bench.Step();
  EXPECT_EQ(error().find("of real time"), std::string::npos) << error();
  EXPECT_NEAR(bench.Figure("time_lost_s"), 3.0, 1e-6);
}

/// The speed at which a tool presses, as the contact models tell it in the mean, of a node whose steps take `periods`
/// and simulate three of them.
double ToldSpeed(const SceneView& scene, std::uint64_t periods) {
  Bench bench(scene, nullptr);
  auto models = bench.bus_.contacts.MakeInput();
  const Vec3f place =
      scene.rest_position[scene.membrane.first + scene.membrane.node_count() / 2 + scene.membrane.cols / 2];
  // The pace is a mean of some seconds; the tool comes down when it has settled.
  constexpr double kSpeed_m_s = 0.01, kStart_m = 0.03, kSettle_s = 12, kPressed_s = kSettle_s + 3.2,
                   kEnd_s = kSettle_s + 3.8;
  double sum_m_s = 0;
  int pressed = 0;
  for (double time_s = 0; time_s < kEnd_s;) {
    const std::int64_t ns = 1 + static_cast<std::int64_t>(bench.tick_.index) * kPeriod;
    time_s = 1e-9 * static_cast<double>(ns);
    const double height_m = kStart_m - kSpeed_m_s * std::max(time_s - kSettle_s, 0.0);
    bench.SendTool(0, place + Vec3f(0, 0, static_cast<float>(height_m)), ns);
    bench.SendHandle(ns);
    bench.Step();
    bench.tick_.index += periods - 1;
    ContactModel model;
    if (!models->TakeLatest(&model) || model.devices[0].count == 0) continue;
    const Contact& contact = model.devices[0].contacts[0];
    if (contact.kind != ContactKind::kSurface || contact.gap > 0 || time_s < kPressed_s) continue;
    sum_m_s += static_cast<double>(contact.du_c.norm() / std::abs(contact.n.z()));
    ++pressed;
  }
  EXPECT_GT(pressed, 3);
  return sum_m_s / pressed;
}

TEST_F(PhysicsNodeTest, ContactsMoveInTheTimeOfTheHand) {
  EXPECT_NEAR(ToldSpeed(scene_, 3), 0.01, 3e-4);
  EXPECT_NEAR(ToldSpeed(scene_, 4), 0.01, 3e-4);
  EXPECT_NEAR(ToldSpeed(scene_, 6), 0.01, 3e-4);
}

TEST(ContactPace, RatesFollowAndStiffnessStays) {
  DeviceContacts device;
  device.count = 2;
  device.p_ext_W = 0.04f;
  for (Contact& contact : device.contacts) {
    contact.v_s = Vec3f(0.02f, 0, 0);
    contact.du_c = Vec3f(0, 0.01f, 0);
    contact.k_body = 300;
    contact.b_body = 10;
    contact.u_c = contact.f_ref = Vec3f(0, 0, 1);
  }
  DeviceContacts same = device;
  ToRealTime(1, &same);
  EXPECT_EQ(same.contacts[0].b_body, 10);
  EXPECT_EQ(same.contacts[0].v_s.x(), 0.02f);
  DeviceContacts half = device;
  ToRealTime(0.5, &half);
  EXPECT_FLOAT_EQ(half.p_ext_W, 0.02f);
  EXPECT_FLOAT_EQ(half.contacts[1].v_s.x(), 0.01f);
  EXPECT_FLOAT_EQ(half.contacts[1].du_c.y(), 0.005f);
  EXPECT_FLOAT_EQ(half.contacts[1].b_body, 20);
  EXPECT_EQ(half.contacts[1].k_body, 300);
  EXPECT_EQ(half.contacts[1].u_c.z(), 1);
  EXPECT_EQ(half.contacts[2].b_body, 10) << "not in use";
  // A tissue that stands still, and an absurd pace.
  DeviceContacts still = device;
  still.contacts[0].b_body = 900;
  ToRealTime(0, &still);
  EXPECT_EQ(still.contacts[0].b_body, 1000);
  EXPECT_FLOAT_EQ(still.contacts[0].v_s.x(), 0.002f);
}

TEST_F(PhysicsNodeTest, TheFirstStepMayTakeLong) {
  Bench bench(scene_, nullptr);
  bench.Step();
  bench.tick_.index += 30;  // Its caches were initialised meanwhile.
  bench.Step();
  EXPECT_EQ(bench.Figure("time_lost_s"), -1);
}

TEST_F(PhysicsNodeTest, AtRestAFrameEachTwoSecondsIsEnough) {
  Bench bench(scene_, nullptr);
  auto frames = bench.bus_.frames.MakeInput();
  for (int i = 0; i < 700; ++i) bench.Step();
  ASSERT_TRUE(bench.node_.simulation().asleep());
  TissueFrame frame;
  const auto count = [&] { return bench.frame_out_->stats().written; };
  const auto before = count();
  double announced_s = 0;
  for (int i = 0; i < 1000; ++i) {
    bench.Step();
    if (frames->TakeLatest(&frame)) announced_s = frame.header.next_within_s;
  }
  EXPECT_EQ(count() - before, 5u);
  EXPECT_NEAR(announced_s, 2.0, 1e-6);
  // On a busy machine, too: half of the periods missed.
  const auto busy = count();
  for (int i = 0; i < 500; ++i) {
    ++bench.tick_.index;
    bench.Step();
  }
  EXPECT_EQ(count() - busy, 5u);
}

TEST(Pace, SeesWhatIsLostAndNotJitter) {
  Pace pace;
  for (int i = 0; i < 500; ++i) pace.Add(0.01, i % 2 == 0 ? 0.013 : 0.007);
  EXPECT_NEAR(pace.value(), 1, 0.01);
  for (int i = 0; i < 300; ++i) pace.Add(0.03, 0.04);
  EXPECT_NEAR(pace.value(), 0.75, 0.01);
  pace.Add(1, 0);
  pace.Add(-1, 1);
  EXPECT_NEAR(pace.value(), 0.75, 0.01);
}

}  // namespace
}  // namespace fulcrum::physics
