// Scenes with several sheets, or without an organ, or without a sheet.
#include "services/base/core/sheets.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "services/base/core/error.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

constexpr const char* kSmall =
    "organ: {procedural: {rings: 22, segments: 10, length_mm: 100}}\n"
    "membrane: {rows: 41, cols: 22}\n";
constexpr const char* kPad =
    "bodies: [{name: pad, material: liver, shape: {ellipsoid_mm: [30, 25, 10], at_mm: [0, 0, 80]}, tet_edge_mm: 7,\n"
    "          held_side: [0, 0, -1]}]\n";
constexpr const char* kSheets =
    "sheets:\n"
    "  - {name: capsule, over: pad, facing: [0, 0, 1], width_mm: 20, length_mm: 24, rows: 25, cols: 15}\n"
    "  - {name: band, between: {first: {x_mm: [-2, 2], y_mm: [-20, -20], z_mm: [60, 60]},\n"
    "                           last: {x_mm: [-2, 2], y_mm: [20, 20], z_mm: [60, 60]}},\n"
    "     rows: 21, cols: 2, held: ends}\n";
constexpr const char* kVeil =
    "sheets:\n"
    "  - {name: veil, between: {first: {x_mm: [-20, 0, 20], y_mm: [-25, -25, -25], z_mm: [0, 3, 0]},\n"
    "                           last: {x_mm: [-20, 0, 20], y_mm: [25, 25, 25], z_mm: [0, 3, 0]}},\n"
    "     rows: 29, cols: 22}\n";

SceneSettings Parse(const std::string& lines) {
  return ParseSceneYaml("name: sheets\nphysics: {mode: accurate}\n" + lines, "x.yaml", {}).settings;
}
SceneData Build(const std::string& lines) { return BuildScene(Parse(lines), {}); }
std::string RefusalOf(const std::string& lines) {
  try {
    (void)Build(lines);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}
std::string Three() { return std::string(kSmall) + kPad + kSheets; }

class ThreeSheets : public testing::Test {
 protected:
  SceneData data_ = Build(Three());
  SceneView scene_ = data_.View();
};

TEST_F(ThreeSheets, AreRectanglesOfOneGridApart) {
  EXPECT_FALSE(FindFault(scene_));
  ASSERT_EQ(scene_.sheets.size(), 3u);
  EXPECT_STREQ(scene_.sheets[0].name, "membrane");
  EXPECT_STREQ(scene_.sheets[1].name, "capsule");
  EXPECT_STREQ(scene_.sheets[2].name, "band");
  EXPECT_EQ(scene_.membrane.cols, 22u);
  EXPECT_EQ(scene_.membrane.rows, scene_.sheets[2].first_row + 21);
  const std::vector<std::uint8_t> absent = AbsentNodes(scene_);
  std::size_t present = 0, cells = 0;
  for (Index node = 0; node < scene_.membrane.node_count(); ++node) {
    present += absent[node] == 0 ? 1 : 0;
    if (absent[node] == 0) continue;
    EXPECT_EQ(scene_.inverse_mass[scene_.membrane.first + node], 0);
    for (Index k = 0; k < 3; ++k) EXPECT_EQ(scene_.membrane_rest_length[3 * node + k], 0);
  }
  for (std::uint32_t r = 0; r + 1 < scene_.membrane.rows; ++r) {
    for (std::uint32_t c = 0; c + 1 < scene_.membrane.cols; ++c) cells += HasCell(scene_, r, c) ? 1 : 0;
  }
  EXPECT_EQ(present, 41u * 22 + 25 * 15 + 21 * 2);
  EXPECT_EQ(cells, 40u * 21 + 24 * 14 + 20);
}

TEST_F(ThreeSheets, NoPatchOfTheAtlasShowsTwo) {
  const float patch_m = kPatchTexels * scene_.membrane.texel_m;
  std::vector<std::pair<Vec2f, Vec2f>> boxes;
  for (const SheetPart& sheet : scene_.sheets) {
    Vec2f low = Vec2f::Constant(1e6f), high = -low;
    for (std::uint32_t r = sheet.first_row; r < sheet.first_row + sheet.rows; ++r) {
      for (std::uint32_t c = 0; c < sheet.cols; ++c) {
        const Vec2f m = scene_.membrane_material[r * scene_.membrane.cols + c] / patch_m;
        low = low.cwiseMin(m);
        high = high.cwiseMax(m);
      }
    }
    boxes.emplace_back(low.array().floor(), high.array().floor());
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = i + 1; k < boxes.size(); ++k) {
      EXPECT_TRUE((boxes[i].second.array() < boxes[k].first.array()).any() ||
                  (boxes[k].second.array() < boxes[i].first.array()).any())
          << i << " and " << k;
    }
  }
}

TEST_F(ThreeSheets, LeaveTheMembraneAsItWasAlone) {
  const SceneData alone = Build(kSmall);
  const SceneView one = alone.View();
  EXPECT_TRUE(one.sheets.empty());
  const Index nodes = one.membrane.node_count();
  for (Index node = 0; node < nodes; ++node) {
    EXPECT_EQ(one.rest_position[one.membrane.first + node], scene_.rest_position[scene_.membrane.first + node]);
    EXPECT_EQ(one.inverse_mass[one.membrane.first + node], scene_.inverse_mass[scene_.membrane.first + node]);
    EXPECT_EQ(one.membrane_material[node], scene_.membrane_material[node]);
  }
  for (Index edge = 0; edge < 3 * nodes; ++edge) {
    ASSERT_EQ(one.membrane_rest_length[edge], scene_.membrane_rest_length[edge]);
  }
  std::size_t own = 0;
  for (const Binding& b : scene_.bindings) {
    own += b.membrane < scene_.membrane.first + scene_.sheets[1].first_row * scene_.membrane.cols ? 1 : 0;
  }
  EXPECT_EQ(own, one.bindings.size());
  EXPECT_GT(scene_.bindings.size(), own) << "the capsule is bound to the pad";
}

TEST_F(ThreeSheets, HoldTheSidesThatAreAskedFor) {
  const SheetPart& band = scene_.sheets[2];
  for (std::uint32_t r = 0; r < band.rows; ++r) {
    for (std::uint32_t c = 0; c < 2; ++c) {
      const Index node = (band.first_row + r) * scene_.membrane.cols + c;
      EXPECT_EQ(scene_.inverse_mass[scene_.membrane.first + node] == 0, r == 0 || r + 1 == band.rows);
    }
  }
}

TEST_F(ThreeSheets, AreWrittenReadAndDescribed) {
  const auto file = std::filesystem::temp_directory_path() / ("sheets." + std::to_string(getpid()));
  const std::uint64_t hash = WriteSceneFile(data_, "", file);
  const SceneFile read(file);
  EXPECT_EQ(read.view().hash, hash);
  EXPECT_EQ(read.view().sheets.size(), 3u);
  std::filesystem::remove(file);
  const std::string text = Describe(scene_, Measure(scene_));
  EXPECT_NE(text.find("capsule: 25 x 15, 0.3 mm"), std::string::npos) << text;
  EXPECT_NE(text.find("band: 21 x 2, 0.3 mm, air on both sides"), std::string::npos) << text;
  EXPECT_EQ(text.find("nan"), std::string::npos) << text;
  EXPECT_EQ(text.find("scissors"), std::string::npos) << text;
  SceneView other = scene_;
  other.tools[2].kind = ToolKind::kScissors;
  EXPECT_NE(Describe(other, Measure(other)).find("tool2: they push tissue aside and cut nothing"), std::string::npos);
}

TEST_F(ThreeSheets, AreRefusedWhereTheyDoNotFitTheGrid) {
  const auto fault = [&](const std::function<void(SceneData*)>& change) {
    SceneData changed = data_;
    change(&changed);
    const auto found = FindFault(changed.View());
    return found ? found->section : "";
  };
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].first_row -= 8; }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].first_row += 1; }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[2].rows = 0xffffffff; }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[2].cols = 23; }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[2].name[31] = 'x', std::memset(d->sheets[2].name, 'x', 32); }),
            "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets.resize(2); }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].Et_N_per_m = -1; }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].bending_Nm = std::nanf(""); }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].fat_youngs_modulus_Pa = 2e9f; }), "sheets");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].tear_stretch = 0.9f; }), "sheets");
  for (float SheetPart::*own : {&SheetPart::thickness_m, &SheetPart::conductivity_W_mK, &SheetPart::sigma_S_m}) {
    for (const float bad : {-1.0f, 1e-6f, 9.0f, std::nanf("")}) {
      EXPECT_EQ(fault([&](SceneData* d) { d->sheets[1].*own = bad; }), "sheets") << bad;
    }
  }
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].thickness_m = 1e-5f, d->sheets[1].sigma_S_m = 1.5f; }), "");
  EXPECT_EQ(fault([](SceneData* d) { d->fixed.membrane.rows += 1; }), "rest_position");
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[2].rows -= 1; }), "sheets") << "the last row of the grid is no sheet's";
  EXPECT_EQ(fault([](SceneData* d) { d->sheets.erase(d->sheets.begin()); }), "sheets") << "nor is the first";
  EXPECT_EQ(fault([](SceneData* d) { d->sheets[1].over = 2; }), "sheets");
  EXPECT_EQ(fault([&](SceneData* d) {
              for (std::uint32_t r = 0; r < 25; ++r) {
                for (std::uint32_t c = 0; c < 15; ++c) {
                  const std::size_t from = (scene_.sheets[1].first_row + r) * scene_.membrane.cols + c;
                  d->membrane_material[from] = d->membrane_material[r * scene_.membrane.cols + c];
                }
              }
            }),
            "membrane_material")
      << "two sheets in one place of the atlas";
  const Index gap = scene_.membrane.cols * 42;
  EXPECT_EQ(fault([&](SceneData* d) { d->inverse_mass[scene_.membrane.first + gap] = 1; }), "inverse_mass");
  EXPECT_EQ(fault([&](SceneData* d) { d->membrane_rest_length[3 * gap] = 1e-3f; }), "membrane_rest_length");
  EXPECT_EQ(fault([&](SceneData* d) { d->bindings[0].membrane = scene_.membrane.first + gap; }), "bindings");
}

TEST(Sheets, TakeScriptKeysByName) {
  const std::string key =
      "tools: {tool0: {kind: grasper, trocar_mm: [-60, -50, 150]}}\nscript: {duration_s: 5, tool0: ["
      "{time_s: 0, sheet: [0.5, 0.5], height_mm: 0, on: ";
  const SceneData data = Build(Three() + key + "band}]}\n");
  ASSERT_EQ(data.script.size(), 1u);
  EXPECT_NEAR(data.script[0].p_W.z(), 0.060f, 1e-4f);
  EXPECT_NE(RefusalOf(Three() + key + "sail}]}\n")
                .find("x.yaml:13: script.tool0[0].on: no sheet 'sail'; the scene has membrane, capsule, band"),
            std::string::npos);
  EXPECT_NE(RefusalOf(kPad + key + "band}]}\n").find("the scene has none"), std::string::npos);
}

TEST(Sheets, AScenesTissueMayBeBodiesOnly) {
  const SceneData data = Build(kPad);
  const SceneView scene = data.View();
  EXPECT_FALSE(FindFault(scene));
  EXPECT_EQ(scene.membrane.node_count(), 0u);
  ASSERT_EQ(scene.solids.size(), 1u);
  EXPECT_STREQ(scene.solids[0].name, "pad");
  EXPECT_TRUE(SheetsOf(scene).empty());
  EXPECT_EQ(scene.node_mask & (1u << static_cast<unsigned>(NodeId::kThermal)), 0u) << "nothing can be burnt";
  EXPECT_NE(RefusalOf(std::string(kPad) + "nodes: [physics_node, thermal_node]\n").find("needs a sheet"),
            std::string::npos);
  // A hook burns the body.
  const SceneData hooked = Build(std::string(kPad) + "tools:\n  tool1: {kind: hook, trocar_mm: [90, -30, 160]}\n");
  EXPECT_NE(hooked.fixed.node_mask & (1u << static_cast<unsigned>(NodeId::kThermal)), 0u);
}

TEST(Sheets, AScenesTissueMayBeASheetOnly) {
  const SceneData data = Build(kVeil);
  const SceneView scene = data.View();
  EXPECT_FALSE(FindFault(scene));
  EXPECT_EQ(scene.tube_vertex_count, 0u);
  ASSERT_EQ(scene.sheets.size(), 1u);
  EXPECT_TRUE(scene.bindings.empty());
  EXPECT_NE(scene.node_mask & (1u << static_cast<unsigned>(NodeId::kThermal)), 0u);
}

TEST(Sheets, SayThatNothingKeepsOneInItsPlace) {
  const std::string loose =
      "sheets: [{name: veil, held: none, between: {first: {x_mm: [0, 9], y_mm: [0, 0], z_mm: "
      "[50, 50]}, last: {x_mm: [0, 9], y_mm: [20, 20], z_mm: [50, 50]}}}]\n";
  const SceneData data = Build(kPad + loose);
  EXPECT_NE(Describe(data.View(), Measure(data.View())).find("neither held nor bound"), std::string::npos);
}

TEST(Sheets, AreNoCrumbsFromTheStart) {
  const auto gauze = [](const std::string& keys) {
    return std::string(kPad) + "sheets: [{name: gauze, " + keys +
           ", between: {first: {x_mm: [0, 9], y_mm: [0, 0], z_mm: [50, 50]}, "
           "last: {x_mm: [0, 9], y_mm: [9, 9], z_mm: [50, 50]}}}]\n";
  };
  try {
    (void)Build(gauze("rows: 6, cols: 6, held: none"));
    FAIL() << "36 loose nodes, which no picture would show";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("sheet 'gauze' has 36 nodes and is neither held"), std::string::npos)
        << error.what();
  }
  EXPECT_NO_THROW((void)Build(gauze("rows: 7, cols: 6, held: none")));
  EXPECT_NO_THROW((void)Build(gauze("rows: 6, cols: 6, held: ends")));
}

TEST(Sheets, AreRefusedWithThePlaceOfTheFault) {
  const auto sheet = [](const std::string& keys) { return std::string(kPad) + "sheets: [{" + keys + "}]\n"; };
  const auto expect = [&](const std::string& lines, const char* part) {
    EXPECT_NE(RefusalOf(lines).find(part), std::string::npos) << RefusalOf(lines);
  };
  expect(sheet("name: a"), "needs either `over` (a body) or `between` (two lines)");
  expect(sheet("name: a, over: pad, facing: [0, 0, 1], width_mm: 20, length_mm: 20, cols: 2"), "lower its binding");
  expect(sheet("name: a, between: {first: {x_mm: [0, 0], y_mm: [0, 0], z_mm: [9, 9]}, last: {x_mm: [0, 1],\n"
               "     y_mm: [5, 5], z_mm: [9, 9]}}"),
         "less than 0.1 mm apart");
  expect(sheet("name: a, over: lung"), "'lung' is no body of this scene");
  expect(sheet("name: pad, over: pad"), "is there twice");
  expect(sheet("name: membrane, over: pad"), "is the name of the sheet over the organ");
  expect(std::string(kPad) + "structures: [{kind: ureter, s: [0, 1], t: [0, 1]}]\n", "lies below a sheet");
  expect(std::string(kPad) + "assessment: {line: {s: [0, 1], t: [0, 1]}}\n", "lies on a sheet");
  expect(sheet("name: a, over: pad, facing: [0, 0, 1], width_mm: 200, length_mm: 200"), "there is no organ");
  expect(std::string(kPad) + "membrane: {rows: 41}\n", "describe it in `sheets`");
  expect("tools: {}\n", "organ");
  std::string many = "sheets:\n";
  for (int i = 0; i < 17; ++i) many += "  - {name: s" + std::to_string(i) + ", over: pad}\n";
  expect(kPad + many, "0 to 15 maps");
}

}  // namespace
}  // namespace fulcrum::scene
