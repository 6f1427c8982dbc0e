// What happens without OpenGL or without a display, and that a window shows what is drawn off screen.
#include "render_node/scene_graph/display.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "render_node/offscreen/egl_context.h"
#include "services/base/core/exit_code.h"
#include "services/scene/builder/build.h"
#include "tests/integration/render/synthetic_scene.h"
#include "tests/support/virtual_screen.h"

namespace fulcrum::render {
namespace {

struct Outcome {
  int exit_code;
  std::string text;
};

Outcome RunCommand(const std::string& command) {
  std::FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  Outcome outcome{-1, {}};
  std::array<char, 256> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) {
    outcome.text += line.data();
  }
  outcome.exit_code = WEXITSTATUS(pclose(pipe));
  return outcome;
}

class NodeCommand : public ::testing::Test {
 protected:
  NodeCommand() {
    std::filesystem::create_directories(folder_);
    scene::WriteSceneFile(scene::BuildProcedural(scene::Small()), "", folder_ / "small.scene");
  }
  ~NodeCommand() override { std::filesystem::remove_all(folder_); }

  std::string Command(const std::string& environment, const std::string& options) const {
    return "timeout 20 env " + environment + " " FULCRUM_BIN_DIR "/render_node --domain 31 --scene " +
           (folder_ / "small.scene").string() + " --session " + folder_.string() + " " + options;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / ("render_" + std::to_string(getpid()));
};

TEST_F(NodeCommand, WithoutOpenGlItSaysWhatToInstall) {
  const Outcome outcome = RunCommand(Command("__EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent", ""));
  EXPECT_EQ(outcome.exit_code, static_cast<int>(ExitCode::kFailure)) << outcome.text;
  EXPECT_NE(outcome.text.find("no OpenGL off screen"), std::string::npos) << outcome.text;
  EXPECT_NE(outcome.text.find("libegl-mesa0"), std::string::npos) << outcome.text;
}

TEST(DoctorTest, NamesWhatDrawsThePicture) {
  const Outcome graphics = RunCommand(FULCRUM_BIN_DIR "/render_node --graphics");
  ASSERT_EQ(graphics.exit_code, static_cast<int>(ExitCode::kDone)) << graphics.text;
  EXPECT_EQ(EglContext().description() + "\n", graphics.text);
  const Outcome doctor = RunCommand(FULCRUM_BIN_DIR "/fulcrum doctor --domain 31");
  EXPECT_NE(doctor.text.find("pictures are drawn by " + graphics.text), std::string::npos) << doctor.text;
}

TEST(DoctorTest, SaysWhatToInstallWithoutOpenGl) {
  const Outcome doctor =
      RunCommand("env __EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent " FULCRUM_BIN_DIR "/fulcrum doctor --domain 31");
  EXPECT_EQ(doctor.exit_code, static_cast<int>(ExitCode::kFailure)) << doctor.text;
  EXPECT_NE(doctor.text.find("✗ off-screen GL       no OpenGL off screen"), std::string::npos) << doctor.text;
}

TEST_F(NodeCommand, AWindowWithoutADisplayIsRefused) {
  const Outcome outcome = RunCommand(Command("-u DISPLAY", "--window"));
  EXPECT_EQ(outcome.exit_code, static_cast<int>(ExitCode::kBadUsage)) << outcome.text;
  EXPECT_NE(outcome.text.find("--window: no display"), std::string::npos) << outcome.text;
}

TEST(WindowTest, ShowsWhatIsDrawnOffScreen) {
  const fulcrum::testing::VirtualScreen screen;
  if (!screen.installed()) {
    GTEST_SKIP() << "Xvfb is not installed: the window is not tested";
  }
  ASSERT_FALSE(screen.display().empty()) << "Xvfb does not answer on /tmp/.X11-unix";
  setenv("DISPLAY", screen.display().c_str(), 1);
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  SceneView view = data.View();
  view.render.width = 480;
  view.render.height = 270;
  const SyntheticMoment moment = MakeSyntheticMoment(view, 4.5);
  const auto draw = [&](bool window) {
    LaparoscopeView laparoscope(view);
    const auto display =
        window ? MakeWindowDisplay(laparoscope, view.render) : MakeOffscreenDisplay(laparoscope, view.render);
    laparoscope.SetTissue(moment.tissue.xyz);
    laparoscope.SetTopology(moment.topology);
    laparoscope.SetTool(0, moment.tools.tools[0]);
    laparoscope.Update();
    display->Draw();
    Bitmap picture;
    display->DrawAndRead(&picture);
    EXPECT_FALSE(display->closed());

    Bitmap later;
    EXPECT_EQ(display->TakeRead(true, &later), ReadResult::kNone);
    display->DrawAndStartRead();
    display->Draw();  // Changes nothing of what is read.
    EXPECT_EQ(display->TakeRead(true, &later), ReadResult::kDone);
    EXPECT_EQ(later.width, picture.width);
    EXPECT_EQ(later.rgb, picture.rgb);
    EXPECT_EQ(display->TakeRead(true, &later), ReadResult::kNone) << "the picture was taken already";
    return picture;
  };
  const Bitmap in_window = draw(true), off_screen = draw(false);
  ASSERT_EQ(in_window.rgb.size(), off_screen.rgb.size());
  double sum = 0;
  for (std::size_t i = 0; i < in_window.rgb.size(); ++i) {
    sum += std::abs(int{in_window.rgb[i]} - int{off_screen.rgb[i]});
  }
  // Both are drawn by software, perhaps by different builds of it: edges may move by a pixel.
  EXPECT_LT(sum / static_cast<double>(in_window.rgb.size()), 2.0);
}

}  // namespace
}  // namespace fulcrum::render
