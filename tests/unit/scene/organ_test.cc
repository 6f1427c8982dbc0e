// Organs from files: given tetrahedra, open surfaces, walls, a target size; each up to a valid scene.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/compiler/tet_repair.h"
#include "services/scene/compiler/tetrahedralise.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

constexpr double kRadius = 0.012, kHalfLength = 0.040;

/// A tube along y, its ends open.
TriangleMesh OpenTube() {
  constexpr int kRings = 41, kSegments = 36;
  TriangleMesh mesh;
  const auto id = [&](int r, int s) { return static_cast<Index>(r * kSegments + s % kSegments); };
  for (int r = 0; r < kRings; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      const double a = 2 * M_PI * s / kSegments;
      mesh.vertices.emplace_back(kRadius * std::sin(a), kHalfLength * (2.0 * r / (kRings - 1) - 1),
                                 kRadius * std::cos(a));
    }
  }
  for (int r = 0; r + 1 < kRings; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      mesh.triangles.push_back({id(r, s), id(r, s + 1), id(r + 1, s + 1)});
      mesh.triangles.push_back({id(r, s), id(r + 1, s + 1), id(r + 1, s)});
    }
  }
  return mesh;
}

double VolumeOf(const TriangleMesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles) {
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  }
  return volume;
}

const TriangleMesh& CappedTube() {
  static const TriangleMesh mesh = [] {
    RepairReport report;
    return RepairSurface(OpenTube(), {0, true, 0}, "x", &report);
  }();
  return mesh;
}

/// The capped tube as tetrahedra, as a file would hold them.
const MeshFile& TubeFile() {
  static const MeshFile file = [] {
    const TetrahedralMesh tets = Tetrahedralise(CappedTube(), 1200, "x");
    return MeshFile{tets.vertices, {}, tets.tets, 0};
  }();
  return file;
}

// ---------------------------------------------------------------------------------------------------- surfaces

TEST(OpenSurface, IsRefusedUnlessTheSceneSaysWhatToDo) {
  RepairReport report;
  try {
    (void)RepairSurface(OpenTube(), {}, "tube.stl", &report);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("tube.stl: the surface is not closed (72 open edges in 2 openings, "
                        "the longest around ("),
              std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("`cap_openings: true`"), std::string::npos);
  }
}

TEST(OpenSurface, CapsCloseIt) {
  RepairReport report;
  const TriangleMesh closed = RepairSurface(OpenTube(), {0, true, 0}, "x", &report);
  EXPECT_EQ(report.openings_capped, 2u);
  const double polygon = 0.5 * 36 * std::sin(2 * M_PI / 36) * kRadius * kRadius;
  EXPECT_NEAR(VolumeOf(closed), polygon * 2 * kHalfLength, 1e-9);
}

TEST(OpenSurface, WallKeepsTheOpeningsOpenAndPointsOutward) {
  constexpr double kWall = 0.003;
  RepairReport report;
  TriangleMesh tube = OpenTube();
  for (const bool reversed : {false, true}) {
    if (reversed) {
      for (Triangle& t : tube.triangles) {
        std::swap(t[1], t[2]);
      }
    }
    const TriangleMesh wall = RepairSurface(tube, {0, false, kWall}, "x", &report);
    const double inner = kRadius - kWall;
    EXPECT_NEAR(VolumeOf(wall), M_PI * (kRadius * kRadius - inner * inner) * 2 * kHalfLength, 0.03 * VolumeOf(wall));
    EXPECT_EQ(report.self_intersections, 0u);
  }
}

TEST(ClosedSurface, WallMakesItHollow) {
  // An ellipsoid: the ends of the open tube are contracted to points.
  TriangleMesh ellipsoid = CappedTube();
  for (Vec3d& p : ellipsoid.vertices) {
    const double latitude = 0.48 * M_PI * p.y() / kHalfLength;
    p = Vec3d(p.x() * std::cos(latitude), 0.02 * std::sin(latitude), p.z() * std::cos(latitude));
  }
  RepairReport report;
  const TriangleMesh shell = RepairSurface(ellipsoid, {0.0005, false, 0.002}, "x", &report);
  EXPECT_NEAR(VolumeOf(shell), 4.0 / 3 * M_PI * (0.012 * 0.012 * 0.020 - 0.010 * 0.010 * 0.018),
              0.05 * VolumeOf(ellipsoid));
  // Its tetrahedra leave the middle empty.
  const TetrahedralMesh mesh = Tetrahedralise(shell, TetsOfEdge(shell, 0.0025), "x");
  for (const Vec3d& p : mesh.vertices) {
    EXPECT_GT(p.norm(), 0.009);
  }
}

TEST(Wall, ThickerThanTheOrganIsRefused) {
  RepairReport report;
  try {
    (void)RepairSurface(OpenTube(), {0, false, 0.020}, "tube.stl", &report);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("choose a thinner wall"), std::string::npos) << error.what();
  }
}

TEST(TetrahedraOfAnEdge, HaveItOnAverage) {
  for (const double edge : {0.005, 0.007}) {
    const TetrahedralMesh mesh = Tetrahedralise(CappedTube(), TetsOfEdge(CappedTube(), edge), "x");
    double sum = 0;
    const auto edges = EdgesOf(mesh.tets);
    for (const auto& [a, b] : edges) {
      sum += (mesh.vertices[a] - mesh.vertices[b]).norm();
    }
    EXPECT_NEAR(sum / static_cast<double>(edges.size()) / edge, 1, 0.15);
  }
}

// -------------------------------------------------------------------------------------------------- tetrahedra

TEST(TetrahedraOfAFile, ComeBackUnchangedWhenSound) {
  TetRepairReport report;
  const TetrahedralMesh mesh = RepairTetrahedra(TubeFile(), "x", &report);
  EXPECT_EQ(mesh.tets.size(), TubeFile().tets.size());
  EXPECT_EQ(mesh.vertices.size(), TubeFile().vertices.size());
  EXPECT_EQ(report.turned + report.doubles_dropped + report.pieces_dropped + report.vertices_merged, 0u);
  EXPECT_GE(report.least_dihedral_deg, 9.9);
}

TEST(TetrahedraOfAFile, AreTurnedMergedAndFreedOfCrumbs) {
  MeshFile file = TubeFile();
  const std::size_t tets = file.tets.size(), vertices = file.vertices.size();
  for (std::size_t i = 0; i < 20; ++i) {
    std::swap(file.tets[i][0], file.tets[i][1]);
  }
  file.tets.push_back(file.tets[5]);    // Twice.
  file.tets.push_back({1, 1, 2, 3});    // A corner twice.
  file.vertices.emplace_back(9, 9, 9);  // Used by none.
  const auto crumb = static_cast<Index>(file.vertices.size());
  for (const Vec3d& p : {Vec3d(1, 0, 0), Vec3d(1.01, 0, 0), Vec3d(1, 0.01, 0), Vec3d(1, 0, 0.01)}) {
    file.vertices.push_back(p);
  }
  file.tets.push_back({crumb, crumb + 1, crumb + 2, crumb + 3});
  // One tetrahedron has separate corners at the same places, as where two parts were written separately.
  for (Index& v : file.tets[40]) {
    file.vertices.push_back(Vec3d(file.vertices[v]));
    v = static_cast<Index>(file.vertices.size() - 1);
  }
  TetRepairReport report;
  const TetrahedralMesh mesh = RepairTetrahedra(file, "x", &report);
  EXPECT_EQ(mesh.tets.size(), tets);
  EXPECT_EQ(mesh.vertices.size(), vertices);
  EXPECT_EQ(report.turned, 20u);
  EXPECT_EQ(report.doubles_dropped, 2u);
  EXPECT_EQ(report.pieces_dropped, 1u);
  EXPECT_EQ(report.vertices_merged, 4u);
  for (const Tetrahedron& t : mesh.tets) {
    EXPECT_GT(SignedVolume(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]), 0);
  }
}

TEST(TetrahedraOfAFile, BeyondRepairAreRefusedByNumber) {
  const auto refusal = [](const MeshFile& file) -> std::string {
    try {
      TetRepairReport report;
      (void)RepairTetrahedra(file, "x.msh", &report);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  const std::vector<Vec3d> x = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.1, 2}, {0.2, 0.2, -1}};
  EXPECT_EQ(refusal({x, {}, {{0, 1, 2, 3}, {0, 1, 2, 5}}, 0}), "");
  EXPECT_NE(refusal({x, {}, {{0, 1, 2, 3}, {0, 1, 2, 4}}, 0})
                .find("x.msh: tetrahedron 1 at (0, 0, 0): lies on the same side of a face as tetrahedron 0"),
            std::string::npos);
  EXPECT_NE(
      refusal({x, {}, {{0, 1, 2, 3}, {0, 1, 2, 5}, {0, 1, 2, 4}}, 0}).find("shares one face with tetrahedra 0 and 1"),
      std::string::npos);
  MeshFile flat{x, {}, {{0, 1, 2, 3}}, 0};
  flat.vertices[3] = Vec3d(0.3, 0.3, 0.001);
  EXPECT_NE(refusal(flat).find("tetrahedron 0 at (0, 0, 0): is flat (least dihedral angle 0.1"), std::string::npos)
      << refusal(flat);
}

// ------------------------------------------------------------------------------------------------ whole scenes

class OrganScene : public testing::Test {
 protected:
  OrganScene() {
    std::filesystem::create_directories(folder_);
    std::ofstream obj(folder_ / "tube.obj");
    obj.precision(9);
    const TriangleMesh tube = OpenTube();
    for (const Vec3d& p : tube.vertices) {
      obj << "v " << 1e3 * p.transpose() << "\n";
    }
    for (const Triangle& t : tube.triangles) {
      obj << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
    }
    std::ofstream vtk(folder_ / "tube.vtk");
    const MeshFile& file = TubeFile();
    vtk.precision(9);
    vtk << "# vtk DataFile Version 3.0\ntube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " << file.vertices.size()
        << " double\n";
    for (const Vec3d& p : file.vertices) {
      vtk << 1e3 * p.transpose() << "\n";
    }
    vtk << "CELLS " << file.tets.size() << " " << 5 * file.tets.size() << "\n";
    for (const Tetrahedron& t : file.tets) {
      vtk << "4 " << t[0] << " " << t[1] << " " << t[2] << " " << t[3] << "\n";
    }
    vtk << "CELL_TYPES " << file.tets.size() << "\n";
    for (std::size_t i = 0; i < file.tets.size(); ++i) {
      vtk << "10\n";
    }
  }
  ~OrganScene() override { std::filesystem::remove_all(folder_); }

  /// Compiles a scene whose organ has these keys.
  SceneData Build(const std::string& keys) {
    const std::string text =
        "name: x\norgan:\n  import:\n    centreline: {x_mm: [0, 0, 0], y_mm: [-38, 0, 38], z_mm: [0, 0, 0]}\n"
        "    from: 0.15\n    to: 0.85\n    bed_mm: 15\n" +
        keys +
        "membrane: {rows: 41, cols: 29, gap_mm: 4, bending_row_stride: 4, bending_col_stride: 4, binding_reach_mm: "
        "6}\n";
    return BuildScene(ParseSceneYaml(text, "x.yaml", folder_).settings, {});
  }
  std::string Refusal(const std::string& keys) {
    try {
      (void)Build(keys);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("fulcrum_organ_test_" + std::to_string(getpid()));
};

void ExpectSound(const SceneData& data) {
  const auto fault = FindFault(data.View());
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  const SceneQuality q = Measure(data.View());
  EXPECT_EQ(q.inverted_tets, 0u);
  EXPECT_GT(q.least_dihedral_deg, 5);
  EXPECT_LT(q.largest_dihedral_deg, 170);
  EXPECT_GT(q.bindings, 20u);
  EXPECT_LT(q.rms_flat_error, 0.05);
  EXPECT_GT(q.least_binding_m, 0.0005) << "the membrane does not touch the organ";
}

TEST_F(OrganScene, TetrahedraOfAFileAreTakenAsTheyAre) {
  const SceneData data = Build("    organ: tube.vtk\n");
  ExpectSound(data);
  EXPECT_EQ(data.View().tets.size(), TubeFile().tets.size());
  EXPECT_NEAR(Measure(data.View()).organ_volume_m3, VolumeOf(CappedTube()), 0.05 * VolumeOf(CappedTube()));
}

TEST_F(OrganScene, TetrahedraOfAFileCanBeFilledAnew) {
  const SceneData data = Build("    organ: tube.vtk\n    remesh: true\n    target_tets: 800\n");
  ExpectSound(data);
  EXPECT_NEAR(static_cast<double>(data.View().tets.size()), 800, 80);
}

TEST_F(OrganScene, OpenTubeBecomesAWall) {
  const SceneData data = Build("    organ: tube.obj\n    wall_mm: 4\n    tet_edge_mm: 5\n");
  ExpectSound(data);
  const SceneQuality q = Measure(data.View());
  EXPECT_NEAR(q.mean_edge_m, 0.005, 0.0009);
  EXPECT_NEAR(q.organ_volume_m3, M_PI * (0.012 * 0.012 - 0.008 * 0.008) * 0.080, 0.08 * q.organ_volume_m3);
}

TEST_F(OrganScene, OpenTubeBecomesABodyUnderCaps) {
  const SceneData data = Build("    organ: tube.obj\n    cap_openings: true\n    target_tets: 1500\n");
  ExpectSound(data);
  EXPECT_NEAR(Measure(data.View()).organ_volume_m3, VolumeOf(CappedTube()), 0.05 * VolumeOf(CappedTube()));
}

TEST_F(OrganScene, KeysThatDoNotGoTogetherAreRefused) {
  EXPECT_NE(Refusal("    organ: tube.obj\n").find("`cap_openings: true` closes its holes"), std::string::npos);
  EXPECT_NE(Refusal("    organ: tube.vtk\n    wall_mm: 3\n").find("this file holds tetrahedra"), std::string::npos);
  EXPECT_NE(Refusal("    organ: tube.obj\n    tet_edge_mm: 3\n    target_tets: 900\n").find("give one of them"),
            std::string::npos);
  EXPECT_NE(
      Refusal("    organ: tube.obj\n    cap_openings: true\n    tet_edge_mm: 0.1\n").find("valid: 100 to 1000000"),
      std::string::npos);
}

}  // namespace
}  // namespace fulcrum::scene
