// Organs of which the description says nothing but the file: where they lie, what closes them, a scene around them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/new_scene.h"
#include "services/scene/compiler/placement.h"
#include "services/scene/compiler/preview.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/compiler/tetrahedralise.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

namespace fs = std::filesystem;

/// A closed surface of revolution: rings around points of a line, their planes across it.
TriangleMesh Rings(const std::vector<Vec3d>& line, const std::vector<double>& radii) {
  constexpr int kSegments = 32;
  TriangleMesh mesh;
  for (std::size_t r = 0; r < line.size(); ++r) {
    const Vec3d along = (line[std::min(r + 1, line.size() - 1)] - line[r > 0 ? r - 1 : 0]).normalized();
    const Vec3d side = along.cross(Vec3d::UnitZ()).normalized(), up = side.cross(along);
    for (int s = 0; s < kSegments; ++s) {
      const double a = 2 * M_PI * s / kSegments;
      mesh.vertices.push_back(line[r] + radii[r] * (std::cos(a) * side + std::sin(a) * up));
    }
  }
  const auto id = [&](std::size_t r, int s) { return static_cast<Index>(r * kSegments + s % kSegments); };
  for (std::size_t r = 0; r + 1 < line.size(); ++r) {
    for (int s = 0; s < kSegments; ++s) {
      mesh.triangles.push_back({id(r, s), id(r + 1, s + 1), id(r, s + 1)});
      mesh.triangles.push_back({id(r, s), id(r + 1, s), id(r + 1, s + 1)});
    }
  }
  for (const std::size_t r : {std::size_t{0}, line.size() - 1}) {
    const auto middle = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back(line[r]);
    for (int s = 0; s < kSegments; ++s) {
      r == 0 ? mesh.triangles.push_back({middle, id(r, s), id(r, s + 1)})
             : mesh.triangles.push_back({middle, id(r, s + 1), id(r, s)});
    }
  }
  return mesh;
}

TriangleMesh Ball(const Vec3d& centre, double radius) {
  std::vector<Vec3d> line;
  std::vector<double> radii;
  for (int i = 1; i < 24; ++i) {
    const double a = M_PI * i / 24;
    line.push_back(centre - Vec3d(0, radius * std::cos(a), 0));
    radii.push_back(radius * std::sin(a));
  }
  return Rings(line, radii);
}

/// Three quarters of a circle around z.
TriangleMesh Bow() {
  std::vector<Vec3d> line;
  for (int i = 0; i <= 40; ++i) {
    const double a = 1.5 * M_PI * i / 40;
    line.emplace_back(0.05 * std::cos(a), 0.05 * std::sin(a), 0.2);
  }
  return Rings(line, std::vector<double>(line.size(), 0.012));
}

// ------------------------------------------------------------------------------------------------------- where

TEST(CentreLineOfATube, FollowsItsBends) {
  const std::vector<Vec3d> line = FindCentreLine(Bow());
  ASSERT_GT(line.size(), 10u);
  double length = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    EXPECT_NEAR(std::hypot(line[i].x(), line[i].y()), 0.05, 0.004);
    EXPECT_NEAR(line[i].z(), 0.2, 0.002);
    if (i > 0) length += (line[i] - line[i - 1]).norm();
  }
  EXPECT_NEAR(length, 1.5 * M_PI * 0.05, 0.03);
}

TEST(CentreLineOfATube, ABallHasNone) { EXPECT_TRUE(FindCentreLine(Ball({0, 0, 0}, 0.03)).empty()); }

TEST(Patch, LiesOnTheWidestPartAndNotBesideTheOrgan) {
  // A ball with a long, thin handle.
  std::vector<Vec3d> line;
  std::vector<double> radii;
  for (int i = 1; i < 24; ++i) {
    const double a = M_PI * i / 24;
    line.emplace_back(0, -0.03 * std::cos(a), 0);
    radii.push_back(std::max(0.03 * std::sin(a), i > 12 ? 0.004 : 0.0));
  }
  line.emplace_back(0, 0.09, 0);
  radii.push_back(0.004);
  ImportSettings import;
  import.facing = Vec3f::UnitZ();
  const TriangleMesh organ = Rings(line, radii);
  const Placement place = PlacePatch(organ, import);
  EXPECT_LT(place.ToWorld(Vec3d::Zero()).head<2>().norm(), 0.006) << "on the ball";
  EXPECT_LT(place.patch_length_m, 0.058);
  EXPECT_GT(place.patch_length_m, 0.025);
}

TEST(Patch, LiesWhereItIsAsked) {
  const Vec3d centre(0.3, -0.2, 0.1);
  ImportSettings import;
  import.patch_at_m = (centre + Vec3d(0, 0, 0.05)).cast<float>();
  const Placement top = PlacePatch(Ball(centre, 0.03), import);
  EXPECT_LT((top.R_WF.row(2).transpose() - Vec3d::UnitZ()).norm(), 0.05) << "z of W is the normal there";
  EXPECT_NEAR(top.ToWorld(centre + Vec3d(0, 0, 0.03)).head<2>().norm(), 0, 0.001);
  EXPECT_NEAR(top.R_WF.determinant(), 1, 1e-9);
  // Off the pole it stays beside it.
  import.facing = Vec3f::UnitZ();
  import.patch_at_m = (centre + Vec3d(0.01, -0.005, 0.05)).cast<float>();
  EXPECT_LT(PlacePatch(Ball(centre, 0.03), import).ToWorld(centre + Vec3d(0.006, -0.003, 0.03)).head<2>().norm(),
            0.002);
  import.patch_at_m.reset();
  import.facing = Vec3f(-1, 0, 0);
  const Placement side = PlacePatch(Ball(centre, 0.03), import);
  EXPECT_LT((side.ToWorld(centre + Vec3d(-0.03, 0, 0)) - Vec3d(0, 0, 0.03)).norm(), 0.001);
  EXPECT_NEAR(side.patch_width_m, 0.65 * 0.06, 0.001);
}

// ------------------------------------------------------------------------------------------------------ repair

TEST(Wrap, MakesOneBodyOfPartsThatCross) {
  TriangleMesh two = Ball({0, 0, 0}, 0.03);
  const TriangleMesh other = Ball({0.03, 0, 0}, 0.03);
  const auto shift = static_cast<Index>(two.vertices.size());
  two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Triangle& t : other.triangles) two.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  RepairReport report;
  const TriangleMesh wrap = RepairSurface(two, {0.0003, false, 0}, "x", &report);
  EXPECT_TRUE(report.is_wrapped);
  // Two balls less the lens that they share.
  const double r = 0.03, ball = 4.0 / 3 * M_PI * r * r * r, lens = M_PI * (4 * r + r) * r * r / 12;
  EXPECT_NEAR(EnclosedVolume(wrap), 2 * ball - lens, 0.05 * ball);
}

TEST(Wrap, LeavesASoundSurfaceAlone) {
  RepairReport report;
  (void)RepairSurface(Bow(), {0.0003, false, 0}, "x", &report);
  EXPECT_FALSE(report.is_wrapped);
}

TEST(Wrap, OfTwoPartsKeepsOneAndSaysSo) {
  TriangleMesh two = Ball({0, 0, 0}, 0.03);
  const TriangleMesh other = Ball({0.09, 0, 0}, 0.03);
  const auto shift = static_cast<Index>(two.vertices.size());
  two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Triangle& t : other.triangles) two.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  RepairReport report;
  (void)RepairSurface(two, {0.0003, false, 0}, "x", &report);
  EXPECT_EQ(report.pieces_dropped, 1u);
  std::size_t dropped = 0;
  EXPECT_THROW((void)WrapSurface({{Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(2, 0, 0)}, {{0, 1, 2}}}, &dropped),
               InputError);
}

// ------------------------------------------------------------------------------------------------ whole scenes

class Import : public testing::Test {
 protected:
  Import() { fs::create_directories(folder_); }
  ~Import() override { fs::remove_all(folder_); }

  void Write(const char* name, const TriangleMesh& mesh, double per_metre) const {
    std::ofstream obj(folder_ / name);
    obj.precision(9);
    for (const Vec3d& p : mesh.vertices) obj << "v " << per_metre * p.transpose() << "\n";
    for (const Triangle& t : mesh.triangles) obj << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
  SceneData Build(const std::string& keys) const {
    const std::string text = "name: x\norgan:\n  import:\n" + keys +
                             "membrane: {rows: 41, cols: 29, gap_mm: 3, bending_row_stride: 4, bending_col_stride: 4, "
                             "binding_reach_mm: 5}\n";
    return BuildScene(ParseSceneYaml(text, "x.yaml", folder_).settings, {});
  }
  std::string Refusal(const std::string& keys) const {
    try {
      (void)Build(keys);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  const fs::path folder_ = fs::temp_directory_path() / ("fulcrum_import_test_" + std::to_string(getpid()));
};

void ExpectSound(const SceneView& scene) {
  const auto fault = FindFault(scene);
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  const SceneQuality q = Measure(scene);
  EXPECT_EQ(q.inverted_tets, 0u);
  EXPECT_GT(q.bindings, 20u);
  const Index middle = scene.membrane.first + scene.membrane.rows / 2 * scene.membrane.cols + scene.membrane.cols / 2;
  EXPECT_LT(scene.rest_position[middle].norm(), 1e-6f) << "the middle of the membrane is the origin";
  // Everything that moves hangs on something that does not.
  const auto organ = scene.inverse_mass.first(scene.tube_vertex_count);
  EXPECT_GT(std::count(organ.begin(), organ.end(), 0.0f), 10);
  EXPECT_LT(std::count(organ.begin(), organ.end(), 0.0f), static_cast<long>(organ.size()) * 3 / 4);
}

TEST_F(Import, ABallGetsAPatchThatEndsOnIt) {
  Write("ball.obj", Ball({0.4, 0.1, 0}, 0.03), 1e3);
  const SceneData data = Build("    organ: ball.obj\n");
  const SceneView scene = data.View();
  ExpectSound(scene);
  EXPECT_TRUE(scene.static_surfaces.empty()) << "no bed beside a patch";
  std::vector<Vec3d> organ;
  for (Index v = 0; v < scene.tube_vertex_count; ++v) organ.push_back(scene.rest_position[v].cast<double>());
  const std::vector<Triangle> surface(scene.tube_surface.begin(), scene.tube_surface.end());
  const TriangleLocator locator(organ, surface);
  for (std::uint32_t r = 0; r < scene.membrane.rows; ++r) {
    for (std::uint32_t c = 0; c < scene.membrane.cols; ++c) {
      const Vec3d p = scene.rest_position[scene.membrane.first + r * scene.membrane.cols + c].cast<double>();
      const double gap = locator.Closest(p, 0.05).closest.distance;
      const bool is_rim = r == 0 || c == 0 || r + 1 == scene.membrane.rows || c + 1 == scene.membrane.cols;
      if (is_rim) {
        EXPECT_LT(gap, 0.002) << "row " << r << ", column " << c;
      }
      EXPECT_LT(gap, 0.008);
    }
  }
}

TEST_F(Import, ABentTubeGetsAMembraneAlongIt) {
  Write("bow.obj", Bow(), 1e3);
  const SceneData data = Build("    organ: bow.obj\n");
  ExpectSound(data.View());
  ASSERT_EQ(data.View().static_surfaces.size(), 1u) << "its bed";
}

TEST_F(Import, TheSameTwice) {
  Write("ball.obj", Ball({0, 0, 0}, 0.03), 1e3);
  EXPECT_EQ(Build("    organ: ball.obj\n").fixed.hash, Build("    organ: ball.obj\n").fixed.hash);
}

TEST_F(Import, AWrongUnitIsRefusedWithTheRightOne) {
  Write("ball.obj", Ball({0, 0, 0}, 0.03), 1);
  const std::string refusal = Refusal("    organ: ball.obj\n");
  EXPECT_NE(refusal.find("it is 0.06 mm long; valid: 8 to 1000 mm. with `unit: m` it would be 60 mm long"),
            std::string::npos)
      << refusal;
  ExpectSound(Build("    organ: ball.obj\n    unit: m\n").View());
  ExpectSound(Build("    organ: ball.obj\n    scale: 1000\n").View());
}

/// What a refusal advises is a key that the body has.
TEST_F(Import, ABodyHasAUnitOfItsOwnAndIsCapped) {
  Write("ball.obj", Ball({0, 0, 0}, 0.03), 1e3);
  TriangleMesh open = Ball({0.07, 0, 0}, 0.02);
  open.triangles.resize(open.triangles.size() - 32);  // One pole.
  Write("open.obj", open, 1);
  const auto with = [](const std::string& keys) {
    return "    organ: ball.obj\n    patch: {}\nbodies: [{name: lump, material: liver, mesh: open.obj, tet_edge_mm: 8" +
           keys + "}]\nphysics: {mode: accurate}\n";
  };
  EXPECT_NE(Refusal(with("")).find("with `unit: m` it would be 40 mm long"), std::string::npos) << Refusal(with(""));
  EXPECT_NE(Refusal(with(", unit: m")).find("lump: the surface is not closed"), std::string::npos);
  EXPECT_NE(Refusal(with(", unit: m")).find("`cap_openings: true` closes its holes"), std::string::npos);
  const SceneData data = Build(with(", unit: m, cap_openings: true"));
  EXPECT_FALSE(FindFault(data.View()));
  ASSERT_EQ(data.solids.size(), 2u);
}

TEST_F(Import, AFixedSurfaceThatNobodyWouldSeeIsRefused) {
  Write("ball.obj", Ball({0, 0, 0}, 0.03), 1e3);
  Write("wall.obj", Ball({0, 0, -0.08}, 0.025), 1);
  const std::string organ = "    organ: ball.obj\n    patch: {}\n";
  const std::string fixed = "fixed: [{name: wall, mesh: wall.obj, collides: true";
  const std::string around = "    surroundings: [{name: wall, file: wall.obj";
  for (const std::string& keys : {organ + fixed, organ + around}) {
    const std::string refusal = Refusal(keys + "}]\n");
    EXPECT_NE(refusal.find("wall: it is 0.05 mm long; valid: 1 to 10000 mm. with `unit: m` it would be 50 mm long"),
              std::string::npos)
        << refusal;
    const SceneData data = Build(keys + ", unit: m}]\n");
    EXPECT_EQ(std::string(data.static_surfaces.back().name), "wall");
  }
}

TEST_F(Import, APatchBesideTheOrganIsRefusedWithAPicture) {
  Write("ball.obj", Ball({0, 0, 0}, 0.03), 1e3);
  try {
    (void)Build("    organ: ball.obj\n    patch: {width_mm: 300, length_mm: 300}\n");
    FAIL();
  } catch (const SpotError& error) {
    EXPECT_NE(std::string(error.what()).find("there is no organ; valid: at most 50 %"), std::string::npos)
        << error.what();
    EXPECT_EQ(PictureOf(error.spot()).substr(1, 3), "PNG");
  }
  EXPECT_NE(Refusal("    organ: ball.obj\n    patch: {}\n    centreline: {x_mm: [0, 0], y_mm: [-9, 9], z_mm: [0, 0]}\n")
                .find("exclude each other"),
            std::string::npos);
}

TEST_F(Import, WhatHasNoInsideIsRefused) {
  TriangleMesh plane;
  plane.vertices = {{0, 0, 0}, {0.05, 0, 0}, {0.05, 0.05, 0}, {0, 0.05, 0}};
  plane.triangles = {{0, 1, 2}, {0, 2, 3}};
  Write("plane.obj", plane, 1e3);
  EXPECT_NE(Refusal("    organ: plane.obj\n    cap_openings: true\n").find("a sheet and no organ"), std::string::npos);
  plane.triangles.insert(plane.triangles.end(), {{0, 2, 1}, {0, 3, 2}});
  Write("plane.obj", plane, 1e3);
  EXPECT_NE(Refusal("    organ: plane.obj\n    cap_openings: true\n"), "");
  std::ofstream(folder_ / "line.obj") << "v 0 0 0\nv 30 0 0\nv 60 0 0\nf 1 2 3\n";
  EXPECT_NE(Refusal("    organ: line.obj\n    cap_openings: true\n").find("no triangle"), std::string::npos);
}

TEST_F(Import, PatchIsInTheFrameOfTheFilesWhateverTheOrigin) {
  Write("ball.obj", Ball({0.1, 0.2, 0.3}, 0.03), 1e3);
  const std::string keys = "    organ: ball.obj\n    patch: {at_mm: [110, 200, 340]}\n";
  EXPECT_EQ(Build(keys).fixed.hash, Build(keys + "    origin_mm: [40, -60, 20]\n").fixed.hash);
}

TEST_F(Import, VerticesThatNoTriangleUsesDoNotCount) {
  TriangleMesh ball = Ball({1.4, 0, 0}, 0.03);
  ball.vertices.emplace_back(0, 0, 0);
  Write("ball.obj", ball, 1e3);
  EXPECT_EQ(Refusal("    organ: ball.obj\n"), "");
}

TEST_F(Import, FaultyTetrahedraAreFilledAnew) {
  // Two tetrahedra on the same side of a face.
  std::ofstream(folder_ / "folded.vtk")
      << "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0\n60 0 0\n0 60 0\n"
         "0 0 60\n10 10 90\nCELLS 2 10\n4 0 1 2 3\n4 0 1 2 4\nCELL_TYPES 2\n10\n10\n";
  std::string said;
  const std::string text =
      "name: x\norgan:\n  import:\n    organ: folded.vtk\n    target_tets: 900\nmembrane: {rows: 41, cols: 29, gap_mm: "
      "2, "
      "bending_row_stride: 4, bending_col_stride: 4}\n";
  const SceneData data = BuildScene(ParseSceneYaml(text, "x.yaml", folder_).settings,
                                    [&](const std::string& stage) { said += stage + "\n"; });
  EXPECT_NE(said.find("its surface is filled anew"), std::string::npos) << said;
  EXPECT_EQ(Measure(data.View()).inverted_tets, 0u);
}

TEST_F(Import, ABaseWithAProceduralOrganCanBeGivenAnotherOne) {
  Write("ball.obj", Ball({0, 0, 0}, 0.03), 1e3);
  std::ofstream(folder_ / "base.yaml") << "name: base\norgan: {procedural: {rings: 9}}\nmembrane: {rows: 41, cols: 29, "
                                          "bending_row_stride: 4, bending_col_stride: 4}\n";
  std::ofstream(folder_ / "own.yaml") << "base: base.yaml\nname: own\norgan: {import: {organ: ball.obj}}\n";
  EXPECT_EQ(CompileScene(folder_ / "own.yaml", {}, {}).data.View().membrane.rows, 41u);
  std::ofstream(folder_ / "both.yaml") << "name: both\norgan: {import: {organ: ball.obj}, procedural: {rings: 9}}\n";
  EXPECT_THROW((void)CompileScene(folder_ / "both.yaml", {}, {}), InputError);
}

TEST_F(Import, ANewSceneCompilesAndIsDrawn) {
  Write("ball.obj", Ball({0.1, 0.2, 0.3}, 0.03), 1);  // In metres, which is found.
  NewScene scene;
  scene.name = "ball";
  scene.mesh = folder_ / "ball.obj";
  scene.mesh_text = "ball.obj";
  const std::string text = DescribeNewScene(scene, {});
  EXPECT_NE(text.find("unit: m\n"), std::string::npos);
  std::ofstream(folder_ / "ball.yaml") << text;
  const SceneData data = CompileScene(folder_ / "ball.yaml", {}, {}).data;
  ExpectSound(data.View());
  EXPECT_EQ(data.View().physics.mode, PhysicsMode::kAccurate);
  EXPECT_GT(data.View().script.size(), 15u);
  EXPECT_EQ(PreviewOf(data.View()).substr(1, 3), "PNG");
}

TEST_F(Import, ANewSceneCapsWhatIsOpen) {
  TriangleMesh open = Bow();
  open.triangles.resize(open.triangles.size() - 32);  // Without its last cap.
  Write("bow.obj", open, 1e3);
  NewScene scene;
  scene.name = "bow";
  scene.mesh = folder_ / "bow.obj";
  scene.mesh_text = "bow.obj";
  EXPECT_NE(DescribeNewScene(scene, {}).find("cap_openings: true"), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::scene
