// Treatment of messages that are old on arrival: replay over the ring and cross-fade.
#include "haptics_node/servo/local_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

using testing::TestTissue;
using testing::TickAt;

constexpr double kDt = 1e-3;

/// A tip that presses and slides.
Vec3d Tip(std::uint64_t millisecond) {
  const double t = kDt * static_cast<double>(millisecond);
  return {0.002 * std::sin(7 * t), 0, -0.003 - 0.002 * std::sin(11 * t)};
}

DeviceContacts One(const Contact& contact) {
  DeviceContacts contacts;
  contacts.count = 1;
  contacts.contacts[0] = contact;
  return contacts;
}

class LocalModelTest : public ::testing::Test {
 protected:
  LocalModelTest() {
    tissue.Place(Tip(0));
    for (std::uint64_t i = 0; i <= kMessage; ++i) tissue.Step(Tip(i), kDt);
  }
  void Take(LocalModel* model, const DeviceContacts& contacts, std::uint64_t t_s, std::uint64_t now) {
    model->Accept(contacts, TickAt(t_s).stamp_ns, TickAt(now).stamp_ns, {}, ring);
  }
  ModelForce Step(LocalModel* model, std::uint64_t now) { return model->Step(Tip(now), TickAt(now).stamp_ns, kDt); }

  static constexpr std::uint64_t kMessage = 40;  ///< The tick of the message's tool sample.
  TestTissue tissue{{}};
  PoseRing ring;
};

// For any delay of a message the force after replay and cross-fade equals that of an immediate message.
TEST_F(LocalModelTest, ALateMessageEndsWhereAPunctualOneDoes) {
  for (const std::uint64_t late : {1u, 5u, 20u, 60u, 120u}) {
    LocalModel punctual, tardy;
    ring = PoseRing();
    ModelForce first, second;
    for (std::uint64_t now = kMessage; now < kMessage + late + 15; ++now) {
      ring.Push(TickAt(now).stamp_ns, Tip(now));
      if (now == kMessage + 1) Take(&punctual, One(tissue.Report()), kMessage, now);
      if (now == kMessage + late) Take(&tardy, One(tissue.Report()), kMessage, now);
      if (now > kMessage) first = Step(&punctual, now);
      if (now >= kMessage + late) second = Step(&tardy, now);
    }
    EXPECT_GT(first.f_W.z(), 0.3);
    EXPECT_LT((first.f_W - second.f_W).norm(), 1e-12) << late << " ms late";
  }
}

TEST_F(LocalModelTest, ANewModelTakesOverWithoutAStep) {
  LocalModel model;
  Vec3d last = Vec3d::Zero();
  double largest = 0;
  for (std::uint64_t now = kMessage; now < kMessage + 60; ++now) {
    ring.Push(TickAt(now).stamp_ns, Tip(kMessage));  // The tip holds still, so that only the model changes the force.
    if (now == kMessage + 1 || now == kMessage + 30) {
      Contact contact = tissue.Report();
      if (now == kMessage + 30) contact.f_ref *= 1.5f;  // The new reference force is larger by half.
      ASSERT_TRUE(model.ready(TickAt(now).stamp_ns));
      Take(&model, One(contact), now - 1, now);
    }
    if (now == kMessage) continue;
    const Vec3d f = model.Step(Tip(kMessage), TickAt(now).stamp_ns, kDt).f_W;
    if (now >= kMessage + 30) largest = std::max(largest, (f - last).norm());
    if (now == kMessage + 30) {
      EXPECT_LT((f - last).norm(), 0.01);
      EXPECT_FALSE(model.ready(TickAt(now).stamp_ns));
    }
    last = f;
  }
  // Smootherstep over 8 ms: its steepest tick is 0.23 of the way.
  EXPECT_LT(largest, 0.26 * 0.5 * tissue.force().norm());
  EXPECT_NEAR(last.z(), 1.5 * tissue.force().z(), 0.1 * tissue.force().z());
}

// Physics assumes tissue 30 % too stiff; its own messages show it.
TEST_F(LocalModelTest, LearnsTheStiffnessThatMessagesImply) {
  const auto worst_after = [&](std::uint64_t begin) {
    LocalModel model;
    TestTissue truth{{}};
    truth.Place(Tip(0));
    ring = PoseRing();
    double worst = 0;
    std::vector<Contact> reports;
    for (std::uint64_t now = 0; now < 1000; ++now) {
      ring.Push(TickAt(now).stamp_ns, Tip(now));
      if (now > 15 && now % 10 == 0) {
        Contact contact = reports[now - 15];
        for (float* value : {&contact.k1, &contact.k3, &contact.kt, &contact.k_body, &contact.b_body}) *value *= 1.3f;
        Take(&model, One(contact), now - 15, now);
      }
      const Vec3d f = Step(&model, now).f_W;
      const Vec3d true_f = truth.Step(Tip(now), kDt);
      reports.push_back(truth.Report());
      if (now >= begin && now < begin + 300) worst = std::max(worst, (f - true_f).norm());
    }
    return worst;
  };
  EXPECT_LT(worst_after(600), 0.25 * worst_after(40));
}

TEST_F(LocalModelTest, TheForceEndsAtTheCapOfTheMessage) {
  LocalModel model;
  DeviceContacts contacts = One(tissue.Report());
  contacts.force_cap_N = 0.2f;
  ASSERT_GT(tissue.force().norm(), 0.3);
  Take(&model, contacts, kMessage, kMessage + 1);
  ModelForce force;
  for (std::uint64_t now = kMessage + 1; now < kMessage + 20; ++now) force = Step(&model, now);
  EXPECT_NEAR(force.f_W.norm(), 0.2, 1e-6);
}

// Contacts of a device act in parallel: both together are as stiff at the hand as one alone may be. A lever of 1.
TEST_F(LocalModelTest, TwoStiffContactsShareTheStiffnessOfTheHand) {
  constexpr double kBody = 2e5, kDepth_m = 0.001;
  Contact stiff;
  stiff.kind = ContactKind::kSurface;
  stiff.k1 = 2e4f;
  stiff.k_body = static_cast<float>(kBody);
  stiff.b_body = 1;
  for (const std::uint32_t count : {1u, 2u}) {
    DeviceContacts contacts;
    contacts.count = count;
    for (std::uint32_t i = 0; i < count; ++i) {
      contacts.contacts[i] = stiff;
      contacts.contacts[i].id = i + 1;
    }
    LocalModel model;
    HandMapping hand;
    hand.pose = PoseFromAttachPoint(testing::BenchTrocar(), AttachPointForTip(testing::BenchTrocar(), Vec3d::Zero()));
    model.Accept(contacts, TickAt(0).stamp_ns, TickAt(0).stamp_ns, hand, ring);
    ModelForce force;
    for (std::uint64_t now = 1; now < 30; ++now) force = model.Step(Vec3d(0, 0, -kDepth_m), TickAt(now).stamp_ns, kDt);
    EXPECT_NEAR(force.f_W.z(), kDepth_m / (1 / kMaxHandStiffness_N_m + 1 / (count * kBody)), 1e-4) << count;
  }
}

}  // namespace
}  // namespace fulcrum::haptics
