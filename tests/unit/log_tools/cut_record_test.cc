// An artificial session with known metal and hole: on a flat sheet, then on one that was lifted and cut.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <random>

#include "services/base/core/error.h"
#include "services/records/log_tools/cut_map.h"
#include "services/records/log_tools/deformed_sheet.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"
#include "tests/support/assessment_cases.h"

namespace fulcrum::log_tools {
namespace {

namespace fs = std::filesystem;

/// 31 x 21 nodes, 1 mm apart, in z = 0; s along x and t along y, 5 mm beside the origin of W.
struct FlatScene {
  static constexpr std::uint32_t kRows = 31, kCols = 21;
  static constexpr float kShift = 5e-3f;

  FlatScene() {
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t col = 0; col < kCols; ++col) {
        material.emplace_back(1e-3f * static_cast<float>(col), 1e-3f * static_cast<float>(row));
        places.emplace_back(material.back().x() - kShift, material.back().y() - kShift, 0);
      }
    }
    view.membrane.rows = kRows;
    view.membrane.cols = kCols;
    view.membrane.texel_m = 1e-4f;
    view.membrane_material = material;
    view.rest_position = places;
    view.hash = 11;
    view.tools[1].kind = ToolKind::kHook;
    view.tools[1].tip_radius_m = 0.5e-3f;
    view.tools[1].tip_length_m = 4e-3f;
  }

  std::vector<Vec2f> material;
  std::vector<Vec3f> places;
  SceneView view;
};

std::vector<float> Interleaved(const std::vector<Vec3f>& places) {
  std::vector<float> xyz;
  for (const Vec3f& place : places) xyz.insert(xyz.end(), place.data(), place.data() + 3);
  return xyz;
}

class CutRecording : public testing::Test {
 protected:
  CutRecording() { fs::create_directory(folder_); }
  ~CutRecording() override { fs::remove_all(folder_); }

  /// The heel moves from t = 10 to 20 mm in 1 s at s = 8 mm, 0.3 mm above the sheet, with current from 0.2 s on.
  fs::path Record(std::uint64_t scene_hash = 11) {
    fs::path file = folder_ / "session.mcap";
    recording::McapWriter writer(file, "fulcrum", "fulcrum test");
    std::map<TopicId, std::uint16_t> channels;
    std::uint32_t sequence = 0;
    const auto put = [&]<class T>(const T& message, double time_s) {
      constexpr TopicId id = bus::kTopicOf<T>;
      const std::string type(bus::TopicLabel(id));
      if (!channels.contains(id)) {
        const std::uint16_t schema = writer.AddSchema("fulcrum::idl::" + type, "omgidl", bus::SchemaText(type));
        channels[id] = writer.AddChannel(schema, bus::RoleOf(id).name, "cdr", {{"node", "some_node"}});
      }
      std::vector<std::uint8_t> bytes;
      EXPECT_TRUE(bus::EncodeCdr(message, &bytes)) << type;
      const auto log_ns = static_cast<std::uint64_t>(std::llround(1e9 * (time_s + 5)));
      writer.Write(channels[id], ++sequence, log_ns, log_ns, std::as_bytes(std::span(bytes)));
    };
    SceneManifest manifest;
    manifest.stamp = test::StampAt(-0.2);
    manifest.scene_name = "flat";
    manifest.session_id = "s-1";
    manifest.scene_hash = scene_hash;
    manifest.session_start_ns = test::kStart_ns;
    GeneratorSetting setting;
    setting.stamp = test::StampAt(-0.5);
    setting.cut_W = 35;
    put(setting, -0.5);
    put(manifest, -0.2);
    for (int ms = 0; ms <= 1000; ++ms) {
      const double time_s = 1e-3 * ms;
      ToolState tool = test::ToolAt(time_s, Vec3d::Zero(), Vec3d(8e-3, 10e-3 + 10e-3 * time_s, 0));
      tool.tools[1].p_WT -= Vec3f(FlatScene::kShift, FlatScene::kShift, -0.3e-3f);
      // The neck points up: z of the tool points down.
      tool.tools[1].q_WT = Quatf(0, 1, 0, 0);
      put(tool, time_s);
      put(test::PedalAt(time_s, ms >= 200 ? CauteryMode::kCut : CauteryMode::kOff), time_s);
      if (ms % 10 != 5) continue;
      TissueFrame frame;
      frame.header.stamp = test::StampAt(time_s);
      frame.header.scene_hash = scene_hash;
      // The frame's positions are some milliseconds old: between two poses.
      frame.header.session_time_s = time_s - 0.0025;
      frame.header.vertex_count = static_cast<std::uint32_t>(scene_.places.size());
      frame.xyz = Interleaved(scene_.places);
      put(frame, time_s + 1e-4);
      CauteryContact contact = test::TipAt(time_s, Vec2f(8e-3f, static_cast<float>(10e-3 + 10e-3 * time_s)), true);
      contact.session_time_s = time_s - 0.0025;
      put(contact, time_s + 2e-4);
    }
    put(Patch(1, 0), 0.7);
    put(Patch(2, 20), 0.9);
    return file;
  }

  /// A hole 1 mm wide, `rows` texels long, from t = 12 mm on at s = 10 mm.
  static TemperaturePatch Patch(std::uint64_t sequence, int rows) {
    TemperaturePatch patch;
    patch.header.stamp = test::StampAt(0.7 + 0.1 * static_cast<double>(sequence));
    patch.header.origin_x = 64;
    patch.header.origin_y = 100;
    patch.texels.assign(std::size_t{4} * kPatchTexels * kPatchTexels, 0);
    for (int y = 0; y < kPatchTexels; ++y) {
      for (int x = 0; x < kPatchTexels; ++x) {
        std::uint8_t* texel = &patch.texels[4 * static_cast<std::size_t>(y * kPatchTexels + x)];
        texel[0] = 100;
        const bool hole = x + 64 >= 95 && x + 64 < 105 && y + 100 >= 120 && y + 100 < 120 + rows;
        texel[3] = hole ? 0 : 255;
      }
    }
    return patch;
  }

  FlatScene scene_;
  const fs::path folder_ = fs::path(testing::TempDir()) / ("cut_record_" + std::to_string(getpid()));
};

TEST_F(CutRecording, MetalIsWhereItsPoseAndTheSheetSay) {
  const RecordedCut cut = ReadCut(Record(), scene_.view);
  EXPECT_EQ(cut.session_id, "s-1");
  ASSERT_GT(cut.metal.size(), 90u);
  for (const MetalFrame& frame : cut.metal) {
    ASSERT_TRUE(frame.in_contact) << frame.time_s;
    // The whole foot is 0.3 mm above the sheet; of the neck the first 0.5 mm counts: the mean is near the foot's
    // middle.
    EXPECT_NEAR(static_cast<double>(frame.centre.y()), 10e-3 + 10e-3 * frame.time_s, 2e-6) << frame.time_s;
    EXPECT_GT(frame.centre.x(), 9.0e-3f);
    EXPECT_LT(frame.centre.x(), 10.1e-3f);
    EXPECT_NEAR(static_cast<double>(frame.nearest_m), 0.3e-3, 1e-6);
    EXPECT_EQ(frame.mode != CauteryMode::kOff, frame.time_s > 0.2 - 1e-9) << frame.time_s;
  }
}

TEST_F(CutRecording, OfTwoContactsThePlaceIsThatOfOne) {
  // A furrow under the middle of the foot: heel and end touch.
  for (std::size_t node = 0; node < scene_.places.size(); ++node) {
    const std::size_t col = node % FlatScene::kCols;
    if (col >= 9 && col <= 11) scene_.places[node].z() -= 5e-3f;
  }
  const RecordedCut cut = ReadCut(Record(), scene_.view);
  ASSERT_GT(cut.metal.size(), 90u);
  bool first = true;
  for (const MetalFrame& frame : cut.metal) {
    ASSERT_TRUE(frame.in_contact) << frame.time_s;
    const auto end = std::max_element(frame.touched.begin(), frame.touched.end(),
                                      [](const Vec2f& a, const Vec2f& b) { return a.x() < b.x(); });
    EXPECT_GT(end->x(), 11.5e-3f) << "the end of the foot touches too";
    EXPECT_LT(frame.centre.x(), 8.5e-3f) << frame.time_s;
    EXPECT_EQ(frame.goes_on, !first) << frame.time_s;
    first = false;
  }
}

TEST_F(CutRecording, TouchGoesByTheReach) {
  const RecordedCut far =
      ReadCut(Record(), scene_.view, {.with_collision_margin = false, .strikes_m = -0.4e-3f, .holds_m = -0.4e-3f});
  for (const MetalFrame& frame : far.metal) EXPECT_FALSE(frame.in_contact);
}

TEST_F(CutRecording, EachSheetHasItsOwnThickness) {
  const ContactReach far{.with_collision_margin = false, .strikes_m = -0.4e-3f, .holds_m = -0.4e-3f};
  const double of_scene_J_m = ReadCut(Record(), scene_.view).metal.front().vaporising_J_m;
  EXPECT_GT(of_scene_J_m, 0);
  std::vector<SheetPart> sheets = {{"thick", 0, FlatScene::kRows, FlatScene::kCols, 0}};
  sheets[0].thickness_m = 3 * scene_.view.thermal.thickness_m;
  scene_.view.physics.collision_margin_m = 1e-3f;
  scene_.view.sheets = sheets;
  const std::vector<float> rest_length(3 * scene_.places.size(), 1e-3f);
  scene_.view.membrane_rest_length = rest_length;
  const RecordedCut cut = ReadCut(Record(), scene_.view, far);
  ASSERT_GT(cut.metal.size(), 90u);
  for (const MetalFrame& frame : cut.metal) {
    EXPECT_TRUE(frame.in_contact) << "half of its thickness is 0.3 mm more";
    EXPECT_NEAR(frame.vaporising_J_m, 3 * of_scene_J_m, 1e-4 * of_scene_J_m);
  }
}

TEST_F(CutRecording, LastPatchTellsTheHole) {
  const CutMap map = ReadCutMap(Record(), scene_.view);
  EXPECT_NEAR(map.figures.removed_mm2, 2.0, 1e-5);
  EXPECT_EQ(map.recorded.texels.revived, 0);
  EXPECT_NEAR(map.figures.length_mm, 2.0, 0.15);
  // Each path has a vertex every 0.2 mm; the rest at its end, shorter than that of 8 mm, is not counted.
  constexpr double kLeftOver = 0.2 / (8 - 0.2);
  EXPECT_NEAR(map.figures.spot_way_ratio, 1, kLeftOver);
  EXPECT_NEAR(map.figures.first_opening_s, 0.9 - 0.2, 0.02);
}

TEST_F(CutRecording, OtherSceneIsRefused) { EXPECT_THROW((void)ReadCut(Record(12), scene_.view), MismatchError); }

constexpr auto kNothingRemoved = [](const Vec2f&) { return false; };

TEST(DeformedSheet, NearestPlaceIsThatOfAllTriangles) {
  FlatScene scene;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Vec3f> places = scene.places;
  for (Vec3f& place : places) {
    place.z() += 2e-3f * std::sin(400 * place.x()) + 0.1e-3f * unit(random);
  }
  DeformedSheet sheet(scene.view);
  ASSERT_TRUE(sheet.SetPositions(Interleaved(places), kNothingRemoved));
  for (int i = 0; i < 50; ++i) {
    const Vec3f p(0.02f * unit(random) - FlatScene::kShift, 0.03f * unit(random) - FlatScene::kShift,
                  2e-3f * unit(random));
    const auto found = sheet.Nearest(p, 1);
    ASSERT_TRUE(found);
    // No point of a fine sampling of all cells is nearer.
    float nearest = std::numeric_limits<float>::infinity();
    for (std::uint32_t row = 0; row + 1 < FlatScene::kRows; ++row) {
      for (std::uint32_t col = 0; col + 1 < FlatScene::kCols; ++col) {
        const std::size_t n = row * FlatScene::kCols + col;
        for (int a = 0; a <= 10; ++a) {
          for (int b = 0; b <= a; ++b) {
            const float u = 0.1f * static_cast<float>(a), v = 0.1f * static_cast<float>(b);
            const Vec3f &p00 = places[n], &p11 = places[n + FlatScene::kCols + 1];
            for (const Vec3f& third : {places[n + 1], places[n + FlatScene::kCols]}) {
              nearest = std::min(nearest, ((1 - u) * p00 + v * p11 + (u - v) * third - p).norm());
            }
          }
        }
      }
    }
    EXPECT_LE(found->distance_m, nearest + 1e-7f);
    EXPECT_GE(found->distance_m, nearest - 0.1e-3f);
  }
}

// A slit along a row, opened: each lip keeps its shape, and the removed part spans the gap.
TEST(DeformedSheet, LipsGoOnUnstretchedAndTheHoleSpansTheGap) {
  FlatScene scene;
  constexpr std::uint32_t kRow = 15;  // The edges from it to the next row are severed.
  constexpr float kGap_m = 3e-3f;
  std::vector<Vec3f> places = scene.places;
  std::vector<std::uint8_t> dead_nodes((places.size() + 7) / 8), dead_edges((3 * places.size() + 7) / 8);
  for (std::uint32_t row = 0; row < FlatScene::kRows; ++row) {
    for (std::uint32_t col = 0; col < FlatScene::kCols; ++col) {
      const std::size_t node = row * FlatScene::kCols + col;
      if (row > kRow) places[node].y() += kGap_m;
      if (row != kRow) continue;
      SetBit(dead_edges, 3 * node + 1);
      SetBit(dead_edges, 3 * node + 2);
    }
  }
  // The removed part of the millimetre between the two rows: from 0.3 to 0.5 mm.
  const auto node_at = [&](std::uint32_t row) { return row * FlatScene::kCols + 10; };
  const float t0 = scene.view.membrane_material[node_at(kRow)].y();
  const auto removed = [&](const Vec2f& place) { return place.y() > t0 + 0.3e-3f && place.y() < t0 + 0.5e-3f; };
  DeformedSheet sheet(scene.view);
  sheet.SetTopology(dead_nodes, dead_edges);
  ASSERT_TRUE(sheet.SetPositions(Interleaved(places), removed));
  const auto at = [&](float beyond_row_m) {
    const auto place = sheet.Nearest(places[node_at(kRow)] + Vec3f(0, beyond_row_m, 0), 1e-3f);
    EXPECT_TRUE(place);
    if (!place) return -1.0f;
    EXPECT_NEAR(place->distance_m, 0, 1e-6f);
    return place->material.y() - t0;
  };
  constexpr float kLook_m = 1e-3f / 20;
  EXPECT_NEAR(at(0.1e-3f), 0.1e-3f, 1e-6f);
  EXPECT_NEAR(at(0.2e-3f), 0.2e-3f, 1e-6f);
  EXPECT_NEAR(at(kGap_m + 0.9e-3f), 0.9e-3f, 1e-6f);
  EXPECT_NEAR(at(kGap_m + 0.6e-3f), 0.6e-3f, 1e-6f);
  EXPECT_NEAR(at(0.5f * kGap_m + 0.4e-3f), 0.4e-3f, kLook_m);
}

// Where a piece of the sheet is missing, a point in the hole has the material coordinates of the missing piece.
TEST(DeformedSheet, AHoleIsSpannedByWhatWasThere) {
  FlatScene scene;
  std::vector<Vec3f> places = scene.places;
  std::vector<std::uint8_t> dead_nodes((places.size() + 7) / 8), dead_edges((3 * places.size() + 7) / 8);
  for (std::uint32_t row = 10; row < 14; ++row) {
    for (std::uint32_t col = 8; col < 12; ++col) {
      const std::size_t node = row * FlatScene::kCols + col;
      SetBit(dead_nodes, node);
      places[node] = Vec3f(1, 1, 1);  // An arbitrary position.
    }
  }
  DeformedSheet sheet(scene.view);
  sheet.SetTopology(dead_nodes, dead_edges);
  ASSERT_TRUE(sheet.SetPositions(Interleaved(places), kNothingRemoved));
  const auto place = sheet.Nearest(scene.places[11 * FlatScene::kCols + 9] + Vec3f(0, 0, 0.4e-3f), 1e-3f);
  ASSERT_TRUE(place);
  EXPECT_NEAR(place->distance_m, 0.4e-3f, 1e-6f);
  EXPECT_NEAR(place->material.x(), 9e-3f, 0.7e-3f);
  EXPECT_NEAR(place->material.y(), 11e-3f, 0.7e-3f);
  EXPECT_FALSE(sheet.Nearest(Vec3f(0, 0, 0.1f), 1e-3f));
}

}  // namespace
}  // namespace fulcrum::log_tools
