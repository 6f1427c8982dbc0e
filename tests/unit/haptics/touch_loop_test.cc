// Servo, Touch and a hand in a closed loop against a stiff wall, with the delays of the driver's own thread.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <numbers>

#include "haptics_node/device/simulated_device.h"
#include "haptics_node/device/touch_device.h"
#include "haptics_node/servo/servo.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"
#include "tests/unit/haptics/touch_rig.h"

namespace fulcrum::haptics {
namespace {

using testing::BenchScene;
using testing::BenchTrocar;
using testing::LatePhysics;
using testing::TestTissue;
using testing::TickAt;
using testing::TouchRig;

struct Case {
  const char* name;
  HandModel hand;
  int delay_ms;  ///< Delay of the whole loop beyond that of a device which the servo reads and drives itself.
};

class StiffWall : public ::testing::TestWithParam<Case> {};

// The wall of Servo.AStiffWallStaysStable, rendered through the driver.
TEST_P(StiffWall, RingsDownThroughTheDriver) {
  TouchRig rig;
  WorkspaceMap map;
  map.R_WD = RotationFromAngles(Vec3d(std::numbers::pi / 2, 0, 0));
  map.p_DP = Vec3d(0, -0.2, 0);
  map.p_WP = BenchTrocar().p_WP;
  const TouchDriver::WantedByTool left{TouchDriver::Wanted{"Left Device", ""}, std::nullopt};
  const auto driver = std::make_shared<TouchDriver>(left, FULCRUM_HD_STAND_IN);
  SceneView scene = BenchScene(1.0);
  TouchDevice touch(driver, 0, map, 1, AttachPointForTip(BenchTrocar(), Vec3d(0, 0, 0.01)));
  Servo servo(ServoSettingsOf(scene), {&touch, nullptr});
  TestTissue tissue({.k1 = 8000, .k3 = 0, .kt = 500, .k_body = 6000, .b_body = 3});
  LatePhysics physics;

  const std::array<ScriptKey, 2> script{
      {{1.0f, 0, Vec3f(0, 0, 0.01f), 0, 0, 0}, {1.8f, 0, Vec3f(0, 0, -0.004f), 0, 0, 0}}};
  SimulatedDevice hand(GetParam().hand, BenchTrocar(), script, 0);
  std::deque<Vec3d> on_the_way(static_cast<std::size_t>(GetParam().delay_ms), map.p_DP + Vec3d(0, 0.19, 0));
  double lowest = 1, highest = -1, force = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const Tick tick = TickAt(i);
    hand.WriteForce(map.R_WD * Vec3d(rig.hd->devices[0].force_N.data()));
    on_the_way.push_back(map.p_DP + map.R_WD.transpose() * (hand.ReadPosition(tick) - map.p_WP));
    const Vec3d p_mm = 1e3 * on_the_way.front();
    on_the_way.pop_front();
    std::copy(p_mm.data(), p_mm.data() + 3, rig.hd->devices[0].position_mm.begin());
    ContactModel model;
    if (physics.Step(tissue, tick.stamp_ns - 1'000'000, &model)) servo.OfferModel(model, tick.stamp_ns);
    // Position in and force out at the same tick: no further delay, as with a simulated device.
    rig.Tick();
    servo.Step(tick);
    rig.Tick();
    tissue.Step(servo.record().tool.tools[0].p_WT.cast<double>(), tick.dt_s);
    if (tick.session_time_s < 3.5) continue;
    lowest = std::min(lowest, touch.ReadPosition(tick).z());
    highest = std::max(highest, touch.ReadPosition(tick).z());
    force = Vec3d(rig.hd->devices[0].force_N.data()).norm();
  }
  EXPECT_LT(highest - lowest, 5e-5);
  EXPECT_GT(force, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Hands, StiffWall,
                         ::testing::Values(Case{"Fingertip", kFingertip, 0}, Case{"FingertipLate", kFingertip, 2},
                                           Case{"LightGrip", kLightGrip, 0}, Case{"LightGripLate", kLightGrip, 2},
                                           Case{"FirmGrip", kFirmGrip, 0}, Case{"FirmGripLate", kFirmGrip, 2}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace fulcrum::haptics
