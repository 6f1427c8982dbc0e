// From the cart's description to devices in the node: the Touch over the stand-in, hands, recorded motion, trocars.
#include "haptics_node/node/cart_devices.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "haptics_node/device/hand_model.h"
#include "haptics_node/node/calibrate_trocar.h"
#include "haptics_node/node/haptics_node.h"
#include "haptics_node/node/trocar_store.h"
#include "services/base/core/error.h"
#include "tests/unit/haptics/node_bus.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/swing.h"
#include "tests/unit/haptics/test_tissue.h"
#include "tests/unit/haptics/touch_rig.h"
#include "tests/unit/runtime/allocation_guard.h"

namespace fulcrum::haptics {
namespace {

namespace fs = std::filesystem;
using config::DeviceKind;
using fulcrum::testing::AllocationGuard;
using testing::BenchScene;
using testing::LatePhysics;
using testing::Swing;
using testing::TestTissue;
using testing::TickAt;
using testing::TouchRig;

const Vec3d kPivot(0.012, -0.095, -0.110);

class CartDevicesTest : public ::testing::Test {
 protected:
  CartDevicesTest()
      : folder(fs::temp_directory_path() / ("cart_devices_test." + std::to_string(::getpid()))),
        scene(BenchScene(0.3)) {
    fs::create_directories(folder);
    cart.devices[1].kind = DeviceKind::kNone;
  }
  ~CartDevicesTest() override { fs::remove_all(folder); }

  [[nodiscard]] CartDevices Make() const { return MakeCartDevices(cart, scene, folder, FULCRUM_HD_STAND_IN); }
  void UseTouch(const std::string& name, const std::string& serial = "") {
    cart.devices[0].kind = DeviceKind::kTouch;
    cart.devices[0].name = name;
    cart.devices[0].serial = serial;
  }
  void UseMotion(const std::vector<DevicePose>& poses) {
    cart.devices[0].motion = folder / "motion.csv";
    std::ofstream(cart.devices[0].motion) << ToText(poses);
  }
  [[nodiscard]] std::string Refusal() const {
    try {
      (void)RecordTrocarMotion(cart, 0, 10, FULCRUM_HD_STAND_IN, [](double, const std::string&) {});
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  fs::path folder;
  SceneView scene;
  config::CartConfig cart;
};

TEST_F(CartDevicesTest, ServoWithATouchNeitherAllocatesNorLocks) {
  if (!AllocationGuard::active()) GTEST_SKIP() << "a sanitizer replaces malloc in this build";
  TouchRig rig;
  UseTouch("Left Device");
  // Straight up from the trocar, so that the tip is 7 mm below the tissue's surface.
  cart.devices[0].workspace.trocar_D = Vec3d(0, -0.193, 0);
  const testing::NodeBus bus;
  HapticsNode node(scene, std::move(Make().devices), bus.ports(), 1);
  TestTissue tissue{{}};
  LatePhysics physics;
  ToolState tool;
  std::int64_t servo_violations = 0, driver_violations = 0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const Tick tick = TickAt(i);
    ContactModel model;
    if (physics.Step(tissue, tick.stamp_ns - 1'000'000, &model)) bus.model_out->Write(model);
    node.BusStep();
    {
      const AllocationGuard guard;
      rig.Tick();
      driver_violations += guard.violations();
    }
    {
      const AllocationGuard guard;
      node.ServoStep(tick);
      servo_violations += guard.violations();
    }
    node.BusStep();
    if (bus.tool_in->TakeLatest(&tool)) tissue.Step(tool.tools[0].p_WT.cast<double>(), tick.dt_s);
  }
  EXPECT_EQ(servo_violations, 0);
  EXPECT_EQ(driver_violations, 0);
  EXPECT_GT(Vec3d(rig.hd->devices[0].force_N.data()).norm(), 0.1);  // Forces did reach the device.
  EXPECT_TRUE(rig.hd->misuse.empty());

  rig.hd->devices[0].heat[1] = 0.8;
  for (int i = 0; i < 100; ++i) rig.Tick();
  Health health;
  health.state = HealthState::kRunning;
  node.FillHealth(&health);
  const auto heat = std::find_if(health.metrics.begin(), health.metrics.end(),
                                 [](const Metric& metric) { return metric.name == "motor0_heat_pct"; });
  ASSERT_NE(heat, health.metrics.end());
  EXPECT_NEAR(heat->value, 80, 1e-9);
  EXPECT_EQ(health.state, HealthState::kDegraded);
  EXPECT_NE(health.last_error.find("tool 0: Touch A100 has warm motors"), std::string::npos) << health.last_error;
  EXPECT_LE(health.metrics.size(), 16u);
}

TEST_F(CartDevicesTest, MissingDriverIsRefusedOnlyWhenATouchIsWanted) {
  EXPECT_NO_THROW((void)MakeCartDevices(cart, scene, folder, "libnowhere.so"));
  UseTouch("Left Device");
  EXPECT_THROW((void)MakeCartDevices(cart, scene, folder, "libnowhere.so"), InputError);
}

TEST_F(CartDevicesTest, NotesTellWhatWasFound) {
  TouchRig rig;
  UseTouch("Right Device");
  EXPECT_EQ(Make().notes, std::vector<std::string>{"tool 0: Touch B200"});
  UseTouch("Third Device");
  const CartDevices none = Make();
  ASSERT_EQ(none.notes.size(), 1u);
  EXPECT_NE(none.notes[0].find("cannot open the Touch 'Third Device'"), std::string::npos);
}

// The same push moves a lighter hand farther: checks the three hands and the scene's own.
TEST_F(CartDevicesTest, HandsDifferByTheirStiffness) {
  const auto yield = [&](config::HandHold hold) {
    cart.devices[0].hand = hold;
    cart.devices[0].force_scale = 0.5;
    const CartDevices made = Make();
    Vec3d first, last;
    for (std::uint64_t i = 0; i < 2000; ++i) {
      last = made.devices[0]->ReadPosition(TickAt(i));
      if (i == 0) first = last;
      made.devices[0]->WriteForce(Vec3d(2, 0, 0));
    }
    return (last - first).norm();
  };
  EXPECT_NEAR(yield(config::HandHold::kFingertip), 1 / kFingertip.stiffness_N_m, 1e-7);
  EXPECT_NEAR(yield(config::HandHold::kLightGrip), 1 / kLightGrip.stiffness_N_m, 1e-7);
  EXPECT_NEAR(yield(config::HandHold::kFirmGrip), 1 / kFirmGrip.stiffness_N_m, 1e-7);
  EXPECT_NEAR(yield(config::HandHold::kScene), 1 / HandModel(scene.haptics).stiffness_N_m, 1e-7);
}

TEST_F(CartDevicesTest, AnAssistantStaysBesideATouch) {
  TouchRig rig;
  const std::array keys = {ScriptKey{0, 2, Vec3f(0, 0, 0), 0.8f, 0, 0}, ScriptKey{1, 2, Vec3f(0, 0, 0), 0.0f, 0, 0},
                           ScriptKey{2, 2, Vec3f(0.03f, 0, 0), 0.8f, 0, 0}};
  scene.script = keys;
  scene.tools[2] = scene.tools[0];
  scene.tools[2].traction_N = 2;
  const auto way = [&] {
    const CartDevices made = Make();
    Vec3d first, last;
    for (std::uint64_t i = 1000; i < 3000; ++i) {
      last = made.devices[2]->ReadPosition(TickAt(i));
      if (i == 1000) first = last;
    }
    return (last - first).norm();
  };
  EXPECT_GT(way(), 0.005) << "the script leaves";
  UseTouch("Left Device");
  EXPECT_LT(way(), 0.001);
}

TEST_F(CartDevicesTest, RecordedMotionIsFollowedThroughTheWorkspaceMap) {
  const auto poses = Swing(kPivot, 0.2, 0);
  UseMotion(poses);
  cart.devices[0].workspace.trocar_D = kPivot;
  cart.devices[0].workspace.scale = 0.8;
  const CartDevices made = Make();
  const Mat3d R_WD = RotationFromAngles(cart.devices[0].workspace.rotation_rad);
  for (std::uint64_t i = 0; i < 9000; ++i) {
    const Vec3d p_WA = made.devices[0]->ReadPosition(TickAt(i));
    if (i % 10 != 0) continue;
    const Vec3d wanted =
        scene.tools[0].p_WP.cast<double>() + 0.8 * (R_WD * (poses[static_cast<std::size_t>(i / 10)].p_D - kPivot));
    EXPECT_LT((p_WA - wanted).norm(), 0.002) << i;
  }
}

TEST_F(CartDevicesTest, TrocarOfASimulatedDeviceIsMeasuredStoredAndLoaded) {
  auto poses = Swing(kPivot, 0.3, 0.001);
  poses[10].p_D += Vec3d(0.2, 0, 0);  // On the way to the trocar, with the button released.
  poses[10].buttons = 0;
  UseMotion(poses);
  const TrocarMotion motion = RecordTrocarMotion(cart, 0, 10, "unused", [](double, const std::string&) {});
  EXPECT_EQ(motion.poses.size(), poses.size() - 1);
  const PivotFit fit = FitPivot(motion.poses);
  ASSERT_EQ(fit.refusal, "");
  SaveTrocar(TrocarFile(folder, cart.name, 0), motion.serial, fit);

  const CartDevices made = Make();
  ASSERT_EQ(made.notes.size(), 1u);
  EXPECT_NE(made.notes[0].find("tool 0: trocar as measured"), std::string::npos);
  WorkspaceMap map{RotationFromAngles(cart.devices[0].workspace.rotation_rad), 1, kPivot,
                   scene.tools[0].p_WP.cast<double>()};
  EXPECT_LT((made.devices[0]->ReadPosition(TickAt(0)) - map.ToWorld(poses[0].p_D)).norm(), 0.0005);
}

TEST_F(CartDevicesTest, ATrocarThatAnotherTouchMeasuredIsNotUsed) {
  TouchRig rig;
  UseTouch("Left Device");
  const PivotFit fit = FitPivot(Swing(kPivot, 0.3, 0.001));
  SaveTrocar(TrocarFile(folder, cart.name, 0), "A100", fit);
  EXPECT_NE(Make().notes[0].find("trocar as measured"), std::string::npos);
  SaveTrocar(TrocarFile(folder, cart.name, 0), "B200", fit);
  EXPECT_NE(Make().notes[0].find("measured with device B200, this is A100; calibrate the trocar again"),
            std::string::npos);
}

/// A device that was not there at the start has no serial number before it is connected.
TEST_F(CartDevicesTest, ATrocarThatAnotherTouchMeasuredIsAFaultOfADeviceThatComesLate) {
  for (const bool fits : {false, true}) {
    TouchRig rig;
    UseTouch("Left Device");
    SaveTrocar(TrocarFile(folder, cart.name, 0), fits ? "A100" : "B200", FitPivot(Swing(kPivot, 0.3, 0.001)));
    rig.hd->devices[0].plugged = false;
    const CartDevices made = Make();
    rig.hd->devices[0].plugged = true;
    made.touch->Start();
    std::string trouble = "waits";
    for (int i = 0; i < 600 && (trouble == "waits" || trouble.find("cannot open") != std::string::npos); ++i) {
      rig.Tick();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      trouble = made.devices[0]->Describe().trouble;
    }
    EXPECT_EQ(trouble.find("measured with device B200") != std::string::npos, !fits) << trouble;
  }
}

TEST_F(CartDevicesTest, ADamagedTrocarFileIsRefused) {
  const fs::path file = TrocarFile(folder, "my/cart", 1);
  EXPECT_EQ(file, folder / "my_cart-tool1.yaml");
  EXPECT_FALSE(LoadTrocar(file).has_value());
  for (const char* text : {"", "trocar_mm: [1, 2]\n", "trocar_mm: [1, 2, .nan]\n",
                           "trocar_mm: [1, 2, 3]\nresidual_mm: 9\ncondition: 2\nswing_deg: 9\nposes: 500\n"}) {
    std::ofstream(file) << text;
    EXPECT_THROW((void)LoadTrocar(file), InputError) << text;
  }
}

TEST_F(CartDevicesTest, CalibrationNeedsADeviceThatMoves) {
  EXPECT_NE(Refusal().find("devices.tool0 is simulated without `motion`"), std::string::npos) << Refusal();
  cart.devices[0].kind = DeviceKind::kNone;
  EXPECT_NE(Refusal().find("devices.tool0 is none"), std::string::npos) << Refusal();
}

TEST_F(CartDevicesTest, AnOperatorsToolStartsWhereTheLaparoscopeSeesIt) {
  scene.render.scope_tip_W = {0, -0.1f, 0.1f};
  scene.render.scope_target_W = Vec3f::Zero();
  std::array<ScriptKey, 2> keys{};
  keys[0].p_W = {0.3f, 0, 0.02f};
  keys[1].p_W = {0, 0, 0.02f};
  keys[1].time_s = 2;
  scene.script = keys;
  cart.devices[0].kind = DeviceKind::kOperator;
  const Trocar trocar{scene.tools[0].p_WP.cast<double>(), scene.tools[0].shaft_length_m};
  const auto start = [&] {
    const CartDevices made = Make();
    return made.devices[0]->ReadPosition(TickAt(0));
  };
  const Vec3d inside = start();
  EXPECT_GT((inside - AttachPointForTip(trocar, keys[0].p_W.cast<double>())).norm(), 0.1);
  EXPECT_LT((inside - AttachPointForTip(trocar, keys[1].p_W.cast<double>())).norm(), 0.06);
  // Nothing of the script is in view.
  keys[1].p_W = keys[0].p_W;
  EXPECT_LT((start() - AttachPointForTip(trocar, keys[0].p_W.cast<double>())).norm(), 1e-6);
}

}  // namespace
}  // namespace fulcrum::haptics
