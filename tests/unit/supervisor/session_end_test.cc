#include <gtest/gtest.h>

#include "services/base/config/operation.h"
#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/session/supervisor/session_setup.h"
#include "tests/fuzz/scene/tiny_scene.h"
#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {

TEST(EndOfSession, IsThatOfTheScriptWhereNoPersonMovesTheTools) {
  SceneView scene;
  scene.script_duration_s = 9;
  scene.tools[0].kind = ToolKind::kGrasper;
  UpSettings settings;
  EXPECT_EQ(EndOfSession(settings, scene), 9);
  settings.cart.devices[1].kind = config::DeviceKind::kTouch;
  EXPECT_EQ(EndOfSession(settings, scene), 9) << "the scene has no tool for that Touch";
  settings.cart.devices[0].kind = config::DeviceKind::kTouch;
  EXPECT_EQ(EndOfSession(settings, scene), 0) << "until it is stopped";
  settings.seconds = 20;
  EXPECT_EQ(EndOfSession(settings, scene), 20);
  settings.seconds = -1;
  config::LetScriptMove(&settings.cart);
  EXPECT_EQ(EndOfSession(settings, scene), 9);
}

TEST(SessionSetup, RefusesACartOfAnotherRateThanTheScenesSteps) {
  const TemporaryFolder folder;
  scene::SceneSettings tiny = fuzz::TinyScene();
  tiny.physics.dt_s = 0.02f;
  UpSettings settings;
  settings.scene = folder.path() / "tiny.fulcrum";
  settings.out = folder.path() / "out";
  settings.open_bus = true;
  scene::WriteSceneFile(scene::BuildProcedural(tiny), "name: tiny\n", settings.scene);
  EXPECT_THROW(SessionSetup{settings}, InputError);
  EXPECT_FALSE(std::filesystem::exists(settings.out)) << "refused before the session has a folder";
}

}  // namespace
}  // namespace fulcrum::supervisor
