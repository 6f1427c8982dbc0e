// Inputs of the bridge from files: stored calibrations, the cart's faults, the scene's script.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "handle_bridge/node/calibration_store.h"
#include "handle_bridge/node/cart_links.h"
#include "services/base/core/error.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

TEST(CalibrationStore, RefusesADamagedFileWithItsName) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("handle_store_test." + std::to_string(::getpid()));
  EXPECT_EQ(CalibrationStore::Load(folder).Find("A"), nullptr);  // Without a folder there are no calibrations.
  CalibrationStore::Save(folder, "/dev/\"a\" b's", {{480, 490, 500}, {60, 30, 0}});
  const CalibrationStore store = CalibrationStore::Load(folder);
  ASSERT_NE(store.Find("/dev/\"a\" b's"), nullptr);
  EXPECT_EQ(store.Find("/dev/\"a\" b's")->angles_deg, (std::vector<double>{60, 30, 0}));
  for (const char* bad : {"unit: A\ncodes: [480, 479]\nangles_deg: [0, 60]\n", "unit: A\ncodes: [480]\n",
                          "unit: A\ncodes: [480, 500]\nangles_deg: [0, 600]\n", ""}) {
    std::ofstream(folder / "bad.yaml") << bad;
    try {
      static_cast<void>(CalibrationStore::Load(folder));
      ADD_FAILURE() << bad;
    } catch (const InputError& refused) {
      EXPECT_NE(std::string(refused.what()).find("bad.yaml"), std::string::npos) << refused.what();
    }
  }
  std::filesystem::remove_all(folder);
}

TEST(FaultsAt, FollowTheCartsWindows) {
  config::SimulatedUnit unit;
  unit.drop = 0.25;
  unit.unplugged_s = {2, 3, 5, 6};
  unit.silent_s = {5.5, 7};
  EXPECT_EQ(FaultsAt(unit, 1).cable.drop_probability, 0.25);
  EXPECT_FALSE(FaultsAt(unit, 1).unplugged);
  EXPECT_TRUE(FaultsAt(unit, 2).unplugged);
  EXPECT_FALSE(FaultsAt(unit, 3).unplugged);
  EXPECT_TRUE(FaultsAt(unit, 5.7).unplugged);
  EXPECT_TRUE(FaultsAt(unit, 5.7).silent);
  EXPECT_FALSE(FaultsAt(unit, 99).silent);
}

TEST(ScriptedHands, GiveTheFirstKeyBeforeTheSessionAndThePedalsOfAllTools) {
  const std::array keys = {ScriptKey{1, 0, Vec3f::Zero(), 0.8f, 0, 0}, ScriptKey{3, 0, Vec3f::Zero(), 0.2f, 0, 0},
                           ScriptKey{0, 1, Vec3f::Zero(), 0.0f, 0, 0},
                           ScriptKey{2, 1, Vec3f::Zero(), 0.0f, kPedalCut, 35},
                           ScriptKey{4, 1, Vec3f::Zero(), 0.0f, 0, 0}};
  SceneView scene;
  scene.script = keys;
  const config::CartConfig cart;
  const ScriptedHands hands(scene, cart);
  EXPECT_NEAR(hands.At(-1).jaw_deg[0], 0.8 * kDegPerRad, 1e-3);
  EXPECT_EQ(hands.At(-1).pedals, 0);
  EXPECT_NEAR(hands.At(2).jaw_deg[0], 0.5 * kDegPerRad, 1e-3);
  EXPECT_EQ(hands.At(3.9).pedals, kPedalCut);
  EXPECT_EQ(hands.At(4).pedals, 0);
  EXPECT_NEAR(hands.At(99).jaw_deg[0], 0.2 * kDegPerRad, 1e-3);
}

TEST(ScriptedHands, AnAssistantDoesNotLetGoByTheClockBesideAPerson) {
  const std::array keys = {ScriptKey{1, 2, Vec3f::Zero(), 0.8f, 0, 0}, ScriptKey{2, 2, Vec3f::Zero(), 0.0f, 0, 0},
                           ScriptKey{10, 2, Vec3f::Zero(), 0.0f, 0, 0}, ScriptKey{11, 2, Vec3f::Zero(), 0.8f, 0, 0}};
  SceneView scene;
  scene.script = keys;
  scene.tools[0].kind = ToolKind::kHook;
  scene.tools[2].kind = ToolKind::kGrasper;
  scene.tools[2].traction_N = 2;
  config::CartConfig cart;
  EXPECT_NEAR(ScriptedHands(scene, cart).At(12).jaw_deg[2], 0.8 * kDegPerRad, 1e-3) << "the whole script";
  for (const config::DeviceKind kind : {config::DeviceKind::kTouch, config::DeviceKind::kOperator}) {
    cart.devices[0].kind = kind;
    EXPECT_NEAR(ScriptedHands(scene, cart).At(12).jaw_deg[2], 0, 1e-3);
  }
}

TEST(ScriptRestsUntil, IsTheBeginOfTheNextChangeOfAnyJawOrPedal) {
  const std::array keys = {ScriptKey{1, 0, Vec3f::Zero(), 0.8f, 0, 0}, ScriptKey{3, 0, Vec3f::Zero(), 0.8f, 0, 0},
                           ScriptKey{5, 0, Vec3f::Zero(), 0.2f, 0, 0}, ScriptKey{0, 1, Vec3f::Zero(), 0.0f, 0, 0},
                           ScriptKey{2, 1, Vec3f::Zero(), 0.0f, kPedalCut, 35}};
  SceneView scene;
  scene.script = keys;
  config::CartConfig cart;
  EXPECT_EQ(ScriptRestsUntil(scene, cart, 0.5), 2);
  EXPECT_EQ(ScriptRestsUntil(scene, cart, 2.5), 3);
  EXPECT_EQ(ScriptRestsUntil(scene, cart, 4), 4) << "the jaw moves";
  EXPECT_TRUE(std::isinf(ScriptRestsUntil(scene, cart, 5.5)));
  cart.handles[0].simulated.silent_s = {20, 21};
  EXPECT_EQ(ScriptRestsUntil(scene, cart, 5.5), 5.5) << "faults begin at any time";
}

TEST(IsScripted, NeitherWithARealLineNorWithAnOperator) {
  config::CartConfig cart;
  cart.handles[0].kind = cart.pedal.kind = config::LinkKind::kSimulated;
  EXPECT_TRUE(IsScripted(cart));
  for (const config::LinkKind kind :
       {config::LinkKind::kSerial, config::LinkKind::kOperator, config::LinkKind::kButtons}) {
    config::CartConfig other = cart;
    other.handles[1].kind = kind;
    EXPECT_FALSE(IsScripted(other));
    other = cart;
    other.pedal.kind = kind;
    EXPECT_FALSE(IsScripted(other));
  }
}

}  // namespace
}  // namespace fulcrum::handle_bridge
