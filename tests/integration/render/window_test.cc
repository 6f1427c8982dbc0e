// The window follows the size that its user gives it: the picture keeps its shape, the text its legibility, the pointer
// its meaning.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <thread>

#include "services/scene/builder/build.h"
#include "tests/integration/render/node_bus.h"
#include "tests/integration/render/synthetic_scene.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum::render {
namespace {

using fulcrum::testing::WindowPicture;

constexpr int kWidth = 960, kHeight = 540;  // Of the scene.
constexpr double kRadius = 0.7;             // Of the round field, as a share of the picture's height.
constexpr int kF11 = 0xffc8;

struct Rgb {
  int r, g, b;
};

Rgb At(const WindowPicture& picture, int x, int y) {
  const std::size_t k =
      4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x));
  return {picture.bgrx[k + 2], picture.bgrx[k + 1], picture.bgrx[k]};
}

/// Tissue is red and never black, text grey.
bool IsField(const Rgb& p) { return p.r >= 12 && p.r > p.b + 6; }
bool IsText(const Rgb& p) { return p.g > 60 && std::abs(p.r - p.b) < 40; }

/// Width of the field in a row, from its first to its last pixel.
int ChordAt(const WindowPicture& picture, int y) {
  int first = picture.width, last = -1;
  for (int x = 0; x < picture.width; ++x) {
    if (!IsField(At(picture, x, y))) continue;
    first = std::min(first, x);
    last = x;
  }
  return last - first + 1;
}

/// Height of the field in a column, from its first to its last pixel.
int ColumnAt(const WindowPicture& picture, int x) {
  int first = picture.height, last = -1;
  for (int y = 0; y < picture.height; ++y) {
    if (!IsField(At(picture, x, y))) continue;
    first = std::min(first, y);
    last = y;
  }
  return last - first + 1;
}

/// Height of the first line of text in the upper left corner of the box: its rows down to the first empty one.
int TextHeight(const WindowPicture& picture, const PixelBox& box) {
  const int top = picture.height - box.y - box.height;
  int height = 0;
  for (int y = top; y < top + box.height / 5; ++y) {
    bool any = false;
    for (int x = box.x; x < box.x + box.height / 8; ++x) any = any || IsText(At(picture, x, y));
    if (any) ++height;
    if (!any && height > 0) break;
  }
  return height;
}

class WindowTest : public ::testing::Test {
 protected:
  WindowTest() : data_(scene::BuildProcedural(scene::Small())), view_(data_.View()) {
    view_.render.width = kWidth;
    view_.render.height = kHeight;
    view_.render.hud = 1;
    view_.render.png_rate_Hz = 0.001f;
  }

  void SetUp() override {
    if (!screen_.installed()) GTEST_SKIP() << "Xvfb is not installed; apt install xvfb";
    ASSERT_FALSE(screen_.display().empty()) << "Xvfb does not answer on /tmp/.X11-unix";
    setenv("DISPLAY", screen_.display().c_str(), 1);
    node_ = std::make_unique<RenderNode>(view_, RenderSettings{.window = true, .frames = folder_}, bus_.ports());
    client_ = std::make_unique<fulcrum::testing::XClient>(screen_.display());
    ASSERT_TRUE(client_->FindWindow("Fulcrum"));
    SyntheticMoment moment = MakeSyntheticMoment(view_, 4.5);
    moment.tissue.header.stamp = moment.topology.stamp = moment.tools.stamp = moment.handles.stamp = {1, 1, 1};
    bus_.tissue_out->Write(moment.tissue);
    bus_.topology_out->Write(moment.topology);
    bus_.tools_out->Write(moment.tools);
    bus_.handles_out->Write(moment.handles);
    Step();
  }
  ~WindowTest() override { std::filesystem::remove_all(folder_); }

  void Step() { node_->Step({++tick_, 4.5, 1.0 / 30, 0}); }
  /// The server has sent the new size when Resize() returns: the next step receives it.
  WindowPicture Resized(int width, int height) {
    client_->Resize(width, height);
    Step();
    return client_->Whole();
  }

  const fulcrum::testing::VirtualScreen screen_{"3840x2160"};
  const scene::SceneData data_;
  SceneView view_;
  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) / ("window_" + std::to_string(getpid()));
  NodeBus bus_;
  std::unique_ptr<RenderNode> node_;
  std::unique_ptr<fulcrum::testing::XClient> client_;
  std::uint64_t tick_ = 0;
};

TEST_F(WindowTest, KeepsTheShapeOfThePictureAndItsTextAtAnySize) {
  for (const auto& [width, height] : {std::pair{kWidth, kHeight},
                                      {640, 360},
                                      {3840, 2160},
                                      {1000, 1000},
                                      {1500, 400},
                                      {333, 777},
                                      {kWidth, kHeight}}) {
    SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(height));
    const WindowPicture picture = Resized(width, height);
    ASSERT_EQ(picture.width, width);
    ASSERT_EQ(picture.height, height);
    const PixelBox box = FitPicture(view_.render, width, height);
    EXPECT_TRUE(box.width == width || box.height == height);
    const int middle = height / 2;
    // Three figures of one circle: two chords give its diameter and its centre's row, the column the cropping.
    const double tolerance = 2 + 0.01 * box.height;
    EXPECT_NEAR(ChordAt(picture, middle), 2 * kRadius * box.height, tolerance);
    EXPECT_NEAR(ChordAt(picture, middle + box.height / 3), 2 * std::sqrt(kRadius * kRadius - 1.0 / 9) * box.height,
                tolerance);
    // Where no text reaches.
    EXPECT_NEAR(ColumnAt(picture, width / 2 + 3 * box.height / 10), box.height, tolerance);
    EXPECT_GE(TextHeight(picture, box), std::max(10.0, 0.025 * box.height) - 1);
    EXPECT_LE(TextHeight(picture, box), std::max(11.0, 0.027 * box.height));
  }
}

class StereoWindowTest : public WindowTest {
 protected:
  StereoWindowTest() { view_.stereo.layout = StereoLayout::kSideBySide; }
};

TEST_F(StereoWindowTest, HasBothFieldsInTheirHalvesAtAnySize) {
  const auto check = [&](const WindowPicture& picture) {
    SCOPED_TRACE(std::to_string(picture.width) + " x " + std::to_string(picture.height));
    const PixelBox box = FitPicture(view_.render, picture.width, picture.height);
    const double tolerance = 3 + 0.01 * box.height;
    for (const int eye : {0, 1}) {
      const int middle = box.x + (1 + 2 * eye) * box.width / 4;
      int first = picture.width, last = -1;
      for (int x = middle - box.width / 4; x < middle + box.width / 4; ++x) {
        if (!IsField(At(picture, x, picture.height / 2))) continue;
        first = std::min(first, x);
        last = std::max(last, x);
      }
      EXPECT_NEAR(last - first + 1, kRadius * box.height, tolerance) << "squeezed to a half";
      EXPECT_NEAR(0.5 * (first + last), middle, tolerance);
      EXPECT_NEAR(ColumnAt(picture, middle + box.height / 8), box.height, tolerance);
    }
  };
  for (const auto& [width, height] :
       {std::pair{kWidth, kHeight}, {1000, 1000}, {3840, 2160}, {1500, 401}, {333, 777}}) {
    check(Resized(width, height));
  }
}

TEST_F(WindowTest, TellsTheReaderOfLivePicturesHowLargeAPixelIs) {
  const auto reader = bus_.pictures.MakeInput();
  Picture picture;
  for (const int height : {kHeight, 360, 1080}) {
    (void)Resized(2 * height, height);  // Wider than the picture.
    const auto width = static_cast<std::uint32_t>(FitPicture(view_.render, 2 * height, height).width);
    for (int i = 0; i < 500 && picture.header.width != width; ++i) {
      (void)reader->TakeLatest(&picture);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_EQ(picture.header.width, width);
    ASSERT_EQ(picture.header.height, static_cast<std::uint32_t>(height));
    const double half_fov = 0.5 * static_cast<double>(view_.render.fov_deg) * std::numbers::pi / 180;
    EXPECT_NEAR(static_cast<double>(picture.header.pixel_rad) * height, 2 * std::tan(half_fov), 1e-5);
    // A larger picture does not begin with more lines of the scene than the last one had.
    if (height > kHeight) {
      EXPECT_LE(static_cast<double>(picture.header.scale) * height, kHeight);
    }
  }
}

TEST_F(WindowTest, FillsTheScreenAndReturns) {
  node_->Press(kF11);
  Step();
  Step();
  const WindowPicture full = client_->Whole();
  EXPECT_EQ(full.width, 3840);
  EXPECT_EQ(full.height, 2160);
  ASSERT_FALSE(full.bgrx.empty());
  EXPECT_NEAR(ColumnAt(full, 1920), 2160, 22);
  node_->Press(kF11);
  Step();
  Step();
  EXPECT_EQ(client_->Whole().width, kWidth);
  EXPECT_EQ(client_->Whole().height, kHeight);
}

}  // namespace
}  // namespace fulcrum::render
