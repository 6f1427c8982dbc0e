// The compiled scene file: round trip, and refusal of every damaged file.
#include "services/scene/format/scene_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <random>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/sections.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

constexpr const char* kSource = "name: small\n";

const SceneData& SmallScene() {
  static const SceneData scene = BuildProcedural(Small());
  return scene;
}

class SceneFileTest : public testing::Test {
 protected:
  void SetUp() override {
    dir_ = std::filesystem::temp_directory_path() / ("fulcrum_scene_file_test_" + std::to_string(getpid()));
    std::filesystem::create_directories(dir_);
    file_ = dir_ / "small.scene";
    hash_ = WriteSceneFile(SmallScene(), kSource, file_);
    std::ifstream in(file_, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  void Write(const std::string& bytes) const {
    std::ofstream(file_, std::ios::binary | std::ios::trunc).write(bytes.data(), std::ssize(bytes));
  }
  /// The message of the refusal; empty when the file was accepted.
  [[nodiscard]] std::string Refusal() const {
    try {
      const SceneFile scene(file_);
      return "";
    } catch (const InputError& error) {
      return std::string("input: ") + error.what();
    } catch (const MismatchError& error) {
      return std::string("mismatch: ") + error.what();
    }
  }

  std::filesystem::path dir_, file_;
  std::uint64_t hash_ = 0;
  std::string bytes_;
};

TEST_F(SceneFileTest, RoundTripKeepsEveryByte) {
  const SceneFile file(file_);
  const SceneView written = SmallScene().View();
  const SceneView& read = file.view();
  EXPECT_EQ(read.hash, hash_);
  EXPECT_EQ(written.hash, hash_);
  EXPECT_EQ(ContentHash(read), hash_);
  EXPECT_STREQ(read.name, "small");
  EXPECT_EQ(file.source_yaml(), kSource);
  EXPECT_EQ(read.tube_vertex_count, written.tube_vertex_count);
  EXPECT_EQ(read.tools[1].p_WP, written.tools[1].p_WP);
  std::vector<std::string> sections;
  ForEachSection(written, [&](const char* name, auto& span) {
    Hash64 a;
    a.Add(std::as_bytes(span));
    bool found = false;
    ForEachSection(read, [&](const char* other, auto& mapped) {
      if (std::string(name) == other) {
        Hash64 b;
        b.Add(std::as_bytes(mapped));
        EXPECT_EQ(span.size(), mapped.size()) << name;
        EXPECT_EQ(a.value(), b.value()) << name;
        found = true;
      }
    });
    EXPECT_TRUE(found) << name;
  });
}

TEST_F(SceneFileTest, BreathingIsKept) {
  SceneSettings settings = Small();
  settings.breathing = {Vec3f::UnitX(), 0.007f, 3.5f};
  EXPECT_NE(WriteSceneFile(BuildProcedural(settings), kSource, file_), hash_);
  const SceneFile file(file_);
  EXPECT_EQ(file.view().breathing.direction, Vec3f(Vec3f::UnitX()));
  EXPECT_EQ(file.view().breathing.amplitude_m, 0.007f);
  EXPECT_EQ(file.view().breathing.period_s, 3.5f);
}

TEST_F(SceneFileTest, StereoIsKeptAndChangesNothingOfOtherScenes) {
  SceneSettings settings = Small();
  settings.stereo = {StereoLayout::kNone, 0.004f, 0.08f};
  const auto without = dir_ / "without.scene";
  EXPECT_EQ(WriteSceneFile(BuildProcedural(settings), kSource, without), hash_);
  std::ifstream in(without, std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), bytes_);
  EXPECT_EQ(bytes_.find("stereo"), std::string::npos) << "no section of that name";

  settings.stereo.layout = StereoLayout::kTopBottom;
  const std::uint64_t hash = WriteSceneFile(BuildProcedural(settings), kSource, file_);
  EXPECT_NE(hash, hash_);
  const SceneFile file(file_);
  EXPECT_EQ(file.view().stereo.layout, StereoLayout::kTopBottom);
  EXPECT_EQ(file.view().stereo.interocular_m, 0.004f);
  EXPECT_EQ(file.view().stereo.convergence_m, 0.08f);
  EXPECT_EQ(ContentHash(file.view()), hash);

  for (const StereoParams& bad : {StereoParams{static_cast<StereoLayout>(3), 0.004f, 0},
                                  {StereoLayout::kSideBySide, 0.03f, 0},
                                  {StereoLayout::kSideBySide, 0.004f, 0.001f}}) {
    settings.stereo = bad;
    EXPECT_THROW((void)WriteSceneFile(BuildProcedural(settings), kSource, file_), InputError);
  }
}

TEST_F(SceneFileTest, AssessmentIsKept) {
  SceneSettings settings = Small();
  settings.assessment.on = 1;
  settings.assessment.limit[static_cast<std::size_t>(Measure::kTime)] = 33;
  settings.planned_line = {Vec2f(0.5f, 0.2f), Vec2f(0.5f, 0.8f)};
  EXPECT_NE(WriteSceneFile(BuildProcedural(settings), kSource, file_), hash_);
  const SceneFile file(file_);
  EXPECT_EQ(file.view().assessment.on, 1u);
  EXPECT_EQ(file.view().assessment.limit, settings.assessment.limit);
  EXPECT_EQ(file.view().assessment.points, settings.assessment.points);
  EXPECT_GT(file.view().planned_line.size(), 50u);
}

TEST_F(SceneFileTest, SameSceneGivesTheSameFile) {
  const auto again = dir_ / "again.scene";
  EXPECT_EQ(WriteSceneFile(BuildProcedural(Small()), kSource, again), hash_);
  std::ifstream in(again, std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), bytes_);
}

TEST_F(SceneFileTest, CommentsInTheSourceDoNotChangeTheHash) {
  EXPECT_EQ(WriteSceneFile(SmallScene(), "# another text\n", dir_ / "b.scene"), hash_);
}

TEST_F(SceneFileTest, LeavesNoTemporaryFile) {
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir_), {}), 1);
}

TEST_F(SceneFileTest, UnwritablePlaceIsRefusedWithItsName) {
  const auto place = dir_ / "no such folder" / "x.scene";
  try {
    (void)WriteSceneFile(SmallScene(), kSource, place);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(place.string()), std::string::npos);
  }
}

TEST_F(SceneFileTest, CutShortAnywhereIsRefused) {
  for (std::size_t keep = 0; keep < bytes_.size(); keep += 1 + keep / 7) {
    Write(bytes_.substr(0, keep));
    EXPECT_NE(Refusal().find(file_.string()), std::string::npos) << keep << ": " << Refusal();
  }
  Write(bytes_.substr(0, bytes_.size() - 1));
  EXPECT_NE(Refusal().find("cut short"), std::string::npos) << Refusal();
  Write(bytes_ + "x");
  EXPECT_NE(Refusal().find("cut short or added to"), std::string::npos);
}

TEST_F(SceneFileTest, MissingFileFolderAndForeignFileAreRefused) {
  Write("name: small\nphysics:\n  dt_ms: 10\n# a YAML file where a compiled scene should be\n");
  EXPECT_NE(Refusal().find("not a compiled scene"), std::string::npos);
  std::filesystem::remove(file_);
  EXPECT_NE(Refusal().find("cannot be opened"), std::string::npos);
  std::filesystem::create_directory(file_);
  EXPECT_NE(Refusal().find("not a compiled scene"), std::string::npos);
}

TEST_F(SceneFileTest, AnotherVersionIsAMismatch) {
  std::string other = bytes_;
  other[8] = static_cast<char>(kSceneFileVersion + 1);
  Write(other);
  EXPECT_EQ(Refusal().substr(0, 9), "mismatch:");
  const std::string says = "version " + std::to_string(kSceneFileVersion + 1) + ", this build reads version " +
                           std::to_string(kSceneFileVersion);
  EXPECT_NE(Refusal().find(says), std::string::npos) << Refusal();
}

TEST_F(SceneFileTest, AnAlteredByteInAnySectionIsNamed) {
  // The middle of the file lies in one of the arrays.
  std::string altered = bytes_;
  altered[altered.size() / 2] = static_cast<char>(altered[altered.size() / 2] ^ 0x10);
  Write(altered);
  EXPECT_NE(Refusal().find("checksum is wrong"), std::string::npos) << Refusal();
  EXPECT_NE(Refusal().find("section '"), std::string::npos);
}

TEST_F(SceneFileTest, RandomMutationsAreRefusedOrHarmless) {
  std::mt19937 random(20240717);
  int refused = 0;
  constexpr int kRounds = 400;
  for (int round = 0; round < kRounds; ++round) {
    std::string mutated = bytes_;
    const int flips = 1 + static_cast<int>(random() % 4);
    for (int k = 0; k < flips; ++k) {
      // Half of them in the header and section table, where they do the most harm.
      const std::size_t limit = random() % 2 ? 1400 : mutated.size();
      mutated[random() % limit] ^= static_cast<char>(1 + random() % 255);
    }
    Write(mutated);
    if (!Refusal().empty()) {
      ++refused;
    } else {
      // Only padding between sections is not covered by a checksum, and it is never read.
      const SceneFile file(file_);
      EXPECT_EQ(ContentHash(file.view()), hash_);
    }
  }
  EXPECT_GT(refused, kRounds * 9 / 10);
}

// ------------------------------------------------------------------------------------------------- validation rules

struct Rule {
  const char* section;
  const char* says;
  std::function<void(SceneData&)> spoil;
};

/// Gives the hook a mesh of one triangle.
SceneData* AddBody(SceneData* scene) {
  scene->tool_vertices = {{0, 0, 0}, {0.001f, 0, 0}, {0, 0.001f, 0}};
  scene->tool_triangles = {{0, 1, 2}};
  scene->tool_meshes = {{1, ToolPart::kBody, 0, 3, 0, 1}};
  return scene;
}

TEST(SceneValidation, ToolMeshesAreSound) {
  SceneData scene = SmallScene();
  EXPECT_FALSE(FindFault(AddBody(&scene)->View()));
}

TEST(SceneValidation, ShippedGeometryIsSound) {
  EXPECT_FALSE(FindFault(SmallScene().View()));
  EXPECT_FALSE(FindFault(BuildProcedural(BuiltIn()).View()));
}

TEST(SceneValidation, EveryRuleRefusesAndNamesItsSection) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Rule> rules = {
      {"scene", "name", [](SceneData& s) { s.fixed.name[0] = 0; }},
      {"scene", "dt_s", [](SceneData& s) { s.fixed.physics.dt_s = 0; }},
      {"scene", "k_bending", [](SceneData& s) { s.fixed.physics.k_bending = kNan; }},
      {"scene", "thermal.cell", [](SceneData& s) { s.fixed.thermal.cell_m = -1; }},
      {"scene", "thermal.volume", [](SceneData& s) { s.fixed.thermal.volume = 2; }},
      {"scene", "thermal.model", [](SceneData& s) { s.fixed.thermal.model = static_cast<ThermalModel>(2); }},
      {"scene", "render.width", [](SceneData& s) { s.fixed.render.width = 0; }},
      {"scene", "coordinate", [](SceneData& s) { s.fixed.render.scope_tip_W.x() = kNan; }},
      {"scene", "force_limit", [](SceneData& s) { s.fixed.haptics.force_limit_N = -3; }},
      {"scene", "unknown kind", [](SceneData& s) { s.fixed.tools[0].kind = static_cast<ToolKind>(77); }},
      {"scene", "node_mask", [](SceneData& s) { s.fixed.node_mask = 0x80; }},
      {"scene", "membrane nodes", [](SceneData& s) { s.fixed.membrane.rows = 0xffffffffu; }},
      {"scene", "begins at", [](SceneData& s) { s.fixed.membrane.first = 7; }},
      {"rest_position", "valid: 2045", [](SceneData& s) { s.rest_position.pop_back(); }},
      {"rest_position", "coordinate", [](SceneData& s) { s.rest_position[3].y() = kNan; }},
      {"inverse_mass", "element 5", [](SceneData& s) { s.inverse_mass[5] = -1; }},
      {"membrane_material", "element 9", [](SceneData& s) { s.membrane_material[9].x() = 0.5f; }},
      {"membrane_material", "row 2, column 2: the sheet is folded over",
       [](SceneData& s) {
         const std::size_t n = 3 * s.fixed.membrane.cols + 3;
         s.membrane_material[n] = 2 * s.membrane_material[n - s.fixed.membrane.cols - 1] - s.membrane_material[n];
       }},
      {"tets", "index 4000000", [](SceneData& s) { s.tets[2][1] = 4000000; }},
      {"tets", "no positive volume", [](SceneData& s) { std::swap(s.tets[2][1], s.tets[2][2]); }},
      {"tet_colours", "offsets", [](SceneData& s) { s.tet_colours.back() += 1; }},
      {"tet_colours", "share particle",
       [](SceneData& s) {
         s.tet_colours = {0, static_cast<Index>(s.tets.size())};
       }},
      {"tet_colours", "must grow", [](SceneData& s) { s.tet_colours[1] = 0xffffffffu; }},
      {"tube_edges", "index", [](SceneData& s) { s.tube_edges[0].a = 220; }},
      {"tube_edges", "twice", [](SceneData& s) { s.tube_edges[0].a = s.tube_edges[0].b; }},
      {"tube_edges", "rest length", [](SceneData& s) { s.tube_edges[1].rest_length = 0; }},
      {"membrane_rest_length", "elements", [](SceneData& s) { s.membrane_rest_length.push_back(1); }},
      {"membrane_rest_length", "element 0", [](SceneData& s) { s.membrane_rest_length[0] = 0; }},
      {"membrane_rest_length", "rest length", [](SceneData& s) { s.membrane_rest_length.back() = 0.001f; }},
      {"bending", "index 1;", [](SceneData& s) { s.bending[0].v[0] = 1; }},
      {"bending", "rest angle", [](SceneData& s) { s.bending[0].rest_angle = 4; }},
      {"bindings", "valid: 220", [](SceneData& s) { s.bindings[0].membrane = 3; }},
      {"bindings", "sum to",
       [](SceneData& s) {
         s.bindings[0].barycentric = {0.5f, 0.4f, 0.2f};
       }},
      {"bindings", "rest length", [](SceneData& s) { s.bindings[0].rest_length = kNan; }},
      {"tube_surface", "index", [](SceneData& s) { s.tube_surface[4][2] = kNoIndex; }},
      {"surface_vertices", "index", [](SceneData& s) { s.surface_vertices[4].tetrahedron = 600; }},
      {"surface_vertices", "weight", [](SceneData& s) { s.surface_vertices[4].barycentric[0] = kNan; }},
      {"surface_triangles", "index", [](SceneData& s) { s.surface_triangles[0][0] = kNoIndex; }},
      {"static_vertices", "coordinate", [](SceneData& s) { s.static_vertices[0].z() = 1e20f; }},
      {"scene", "breathing.amplitude", [](SceneData& s) { s.fixed.breathing.amplitude_m = kNan; }},
      {"scene", "breathing.period", [](SceneData& s) { s.fixed.breathing.period_s = 0; }},
      {"scene", "breathing.direction", [](SceneData& s) { s.fixed.breathing.direction.setZero(); }},
      {"scene", "line_done_pct",
       [](SceneData& s) { s.fixed.assessment.limit[static_cast<std::size_t>(Measure::kLineDone)] = 101; }},
      {"scene", "lift_hold = nan", [](SceneData& s) { s.fixed.assessment.points[1] = kNan; }},
      {"scene", "assessment.line.by", [](SceneData& s) { s.fixed.assessment.tracing = static_cast<LineTracing>(3); }},
      {"scene", "assessment.idle_speed", [](SceneData& s) { s.fixed.assessment.idle_speed_m_s = 0.5f; }},
      {"planned_line", "at least two", [](SceneData& s) { s.planned_line = {Vec2f::Zero()}; }},
      {"planned_line", "t = nan",
       [](SceneData& s) {
         s.planned_line.assign(2, Vec2f::Zero());
         s.planned_line[1].y() = kNan;
       }},
      {"static_surfaces", "beyond", [](SceneData& s) { s.static_surfaces[0].vertex_count = 0xffffffffu; }},
      {"static_surfaces", "role", [](SceneData& s) { s.static_surfaces[0].role = static_cast<SurfaceRole>(9); }},
      {"static_triangles", "index", [](SceneData& s) { s.static_triangles[0][0] = kNoIndex; }},
      {"protected_structures", "points", [](SceneData& s) { s.protected_structures[0].point_count = 100000; }},
      {"protected_structures", "kind",
       [](SceneData& s) { s.protected_structures[0].kind = static_cast<ProtectedKind>(9); }},
      {"protected_points", "coordinate", [](SceneData& s) { s.protected_points[0].p_W.x() = kNan; }},
      {"tool_vertices", "coordinate", [](SceneData& s) { AddBody(&s)->tool_vertices[1].y() = kNan; }},
      {"tool_triangles", "index 3", [](SceneData& s) { AddBody(&s)->tool_triangles[0][2] = 3; }},
      {"tool_meshes", "index 4", [](SceneData& s) { AddBody(&s)->tool_meshes[0].tool = 4; }},
      {"tool_meshes", "unknown part",
       [](SceneData& s) { AddBody(&s)->tool_meshes[0].part = static_cast<ToolPart>(3); }},
      {"tool_meshes", "beyond", [](SceneData& s) { AddBody(&s)->tool_meshes[0].triangle_count = 0xffffffffu; }},
      {"tool_meshes", "twice", [](SceneData& s) { s.tool_meshes.push_back(AddBody(&s)->tool_meshes[0]); }},
      {"tool_meshes", "parts", [](SceneData& s) { AddBody(&s)->tool_meshes[0].tool = 0; }},
      {"script", "index 4", [](SceneData& s) { s.script[0].tool = 4; }},
      {"script", "sorted", [](SceneData& s) { std::swap(s.script[0], s.script[1]); }},
      {"script", "power", [](SceneData& s) { s.script[0].power_W = 1e6f; }},
      {"script", "pedals", [](SceneData& s) { s.script[0].pedals = 64; }},
      {"script", "time", [](SceneData& s) { s.script.back().time_s = 1e6f; }},
  };
  for (const Rule& rule : rules) {
    SceneData scene = SmallScene();
    rule.spoil(scene);
    const auto fault = FindFault(scene.View());
    ASSERT_TRUE(fault) << rule.section << " " << rule.says;
    EXPECT_EQ(fault->section, rule.section) << fault->reason;
    EXPECT_NE(fault->reason.find(rule.says), std::string::npos) << rule.section << ": " << fault->reason;
    EXPECT_THROW((void)WriteSceneFile(scene, kSource, "/never/written"), InputError);
  }
}

}  // namespace
}  // namespace fulcrum::scene
