#include <gtest/gtest.h>

#include "services/base/config/operation.h"
#include "services/session/supervisor/session_setup.h"

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

}  // namespace
}  // namespace fulcrum::supervisor
