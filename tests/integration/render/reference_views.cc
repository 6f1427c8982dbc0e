// Draws the reference views of the documentation from recorded sessions, one JPEG sheet with a line under each:
//
//   reference_views OUT.jpg RECORDING [RECORDING_OF_OPENHELP [RECORDING_OF_CLIPS]]
//
// The scenes are those beside the recordings (scene.fulcrum). RECORDING is of the script of built-in, at least 24 s,
// RECORDING_OF_CLIPS of that of clips, at least 16 s. "-" leaves the views of a recording out.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "render_node/offscreen/jpeg.h"
#include "render_node/scene_graph/font.h"
#include "services/apps/replayer/projector.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum {
namespace {

constexpr int kColumns = 3, kWidth = 640, kHeight = 360, kCaption = 22;

struct View {
  const char* caption;
  double time_s;
  Vec3f target_m, from_m;  // Frame W; the second is the scope's place relative to the target. Zero: the scene's.
  float fov_deg = 60;
};

// Middle between the clips, frame W [m].
const Vec3f kClipped_m(-0.005f, -0.013f, 0.021f);

// Times and places are those of the script of built-in (deploy/scenes/built-in.yaml).
const std::vector<View> kViews{
    {"at rest", 0.5, Vec3f::Zero(), Vec3f::Zero()},
    {"tent", 6.5, Vec3f::Zero(), Vec3f::Zero()},
    {"first touch", 7.6, {0.003f, -0.015f, 0.020f}, {0.004f, -0.062f, 0.060f}, 22},
    {"slit from above", 17.5, {0.004f, -0.001f, 0.018f}, {0.000f, -0.022f, 0.070f}, 26},
    {"slit along", 14.0, {0.004f, -0.004f, 0.019f}, {0.002f, -0.060f, 0.022f}, 20},
    {"bared fat", 24.0, {0.004f, -0.002f, 0.016f}, {0.002f, -0.040f, 0.050f}, 14},
    {"edge of the burn", 9.5, {0.0050f, -0.0120f, 0.0195f}, {-0.004f, -0.040f, 0.050f}, 6},
    {"bleeding", 20.0, {0.008f, -0.003f, 0.016f}, {0.004f, -0.062f, 0.060f}, 24},
    {"smoke", 14.9, Vec3f::Zero(), Vec3f::Zero()},
    {"beneath the tent", 12.0, {-0.004f, -0.004f, 0.020f}, {0.030f, -0.060f, 0.026f}, 32},
    {"instruments close", 11.0, {-0.004f, -0.002f, 0.028f}, {0.010f, -0.060f, 0.050f}, 30},
};

// Those of the script of clips (deploy/scenes/clips.yaml).
const std::vector<View> kClipViews{
    {"clip applier", 8.5, Vec3f::Zero(), Vec3f::Zero()},
    {"clipped", 10.3, kClipped_m, {0.010f, -0.050f, 0.055f}, 17},
    {"divided between clips", 15.2, kClipped_m, {0.010f, -0.050f, 0.055f}, 17},
};

constexpr double kAtTheEnd_s = -1;
const std::vector<View> kOpenHelpViews{{"OpenHELP", kAtTheEnd_s, Vec3f::Zero(), Vec3f::Zero()}};
/// Instead of a recording: none.
constexpr const char* kNone = "-";

render::Bitmap Draw(replay::Projector* projector, const RenderParams& scene, const View& view) {
  RenderParams camera = scene;
  if (view.from_m != Vec3f::Zero()) {
    camera.scope_target_W = view.target_m;
    camera.scope_tip_W = view.target_m + view.from_m;
    camera.fov_deg = view.fov_deg;
  }
  projector->GoTo(view.time_s);
  render::Bitmap picture;
  if (!projector->Draw(&picture)) throw std::runtime_error("the recording has no tissue to show");
  projector->replay().node().DrawFrom(camera, &picture);
  return picture;
}

class Sheet {
 public:
  explicit Sheet(std::size_t views) : glyphs_(render::MakeGlyphSheet(12)) {
    const int rows = static_cast<int>(views + kColumns - 1) / kColumns;
    all_.width = kColumns * kWidth;
    all_.height = rows * (kHeight + kCaption);
    all_.rgb.assign(3 * static_cast<std::size_t>(all_.width) * static_cast<std::size_t>(all_.height), 0);
  }
  void Add(const render::Bitmap& picture, const std::string& caption) {
    // Rows are counted from the lowest, as in every bitmap.
    const int left = index_ % kColumns * kWidth;
    const int bottom = all_.height - (index_ / kColumns + 1) * (kHeight + kCaption);
    ++index_;
    for (int y = 0; y < std::min(kHeight, picture.height); ++y) {
      for (int x = 0; x < std::min(kWidth, picture.width); ++x) {
        std::copy_n(&picture.rgb[Offset(picture.width, x, y)], 3,
                    &all_.rgb[Offset(all_.width, left + x, bottom + kCaption + y)]);
      }
    }
    Write(caption, left + 8, bottom);
  }
  void Save(const std::filesystem::path& file) const {
    constexpr std::size_t kMostBytes = 1 << 20;
    render::JpegEncoder encoder;
    const auto bytes = encoder.Encode(all_, kMostBytes);
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
  }

 private:
  static std::size_t Offset(int width, int x, int y) {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
  }
  void Write(const std::string& text, int x, int bottom) {
    const auto& size = glyphs_.sizes[0];
    for (const char32_t character : render::Characters(text)) {
      const render::Glyph& glyph = size.Of(character);
      for (int row = 0; row < size.height; ++row) {
        for (int column = 0; column < glyph.width; ++column) {
          const int from = (glyph.y + row) * glyphs_.width + glyph.x + column;
          std::fill_n(&all_.rgb[Offset(all_.width, x + column, bottom + row)], 3,
                      glyphs_.pixels[static_cast<std::size_t>(from)]);
        }
      }
      x += glyph.width;
    }
  }

  render::GlyphSheet glyphs_;
  render::Bitmap all_;
  int index_ = 0;
};

SceneView Sized(SceneView scene) {
  scene.render.width = kWidth;
  scene.render.height = kHeight;
  return scene;
}

/// Adds the views of a recording to the sheet.
void AddAll(const std::filesystem::path& recording, std::vector<View> views, Sheet* sheet) {
  const scene::SceneFile file(recording.parent_path() / "scene.fulcrum");
  const SceneView scene = Sized(file.view());
  replay::Projector projector(recording, scene);
  for (View& view : views) {
    if (view.time_s == kAtTheEnd_s) view.time_s = projector.end_s();
  }
  // A step back begins at the start of the recording.
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return views[i].time_s; });
  std::vector<render::Bitmap> pictures(views.size());
  for (const std::size_t i : order) pictures[i] = Draw(&projector, scene.render, views[i]);
  for (std::size_t i = 0; i < views.size(); ++i) sheet->Add(pictures[i], views[i].caption);
}

void DrawAll(std::span<const std::string> recordings, const std::filesystem::path& out) {
  const std::array<const std::vector<View>*, 3> views{&kViews, &kOpenHelpViews, &kClipViews};
  std::size_t count = 0;
  for (std::size_t i = 0; i < recordings.size(); ++i) count += recordings[i] == kNone ? 0 : views[i]->size();
  Sheet sheet(count);
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    if (recordings[i] != kNone) AddAll(recordings[i], *views[i], &sheet);
  }
  sheet.Save(out);
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  if (argc < 3 || argc > 5) {
    std::cerr << "usage: reference_views OUT.jpg RECORDING [RECORDING_OF_OPENHELP [RECORDING_OF_CLIPS]]\n";
    return 2;
  }
  try {
    fulcrum::DrawAll(std::vector<std::string>(argv + 2, argv + argc), argv[1]);
  } catch (const std::exception& error) {
    std::cerr << "reference_views: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
