// From a surface to an organ: repair, decimation, tetrahedra, draping.
#include <gtest/gtest.h>

#include <cmath>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/drape.h"
#include "services/scene/compiler/mesh_repair.h"
#include "services/scene/compiler/tetrahedralise.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {
namespace {

/// A closed tube-like body round the y axis: `rings` x `segments` and two poles.
TriangleMesh Capsule(int rings, int segments, double radius, double half_length) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, -half_length - radius, 0);
  for (int r = 0; r < rings; ++r) {
    const double latitude = M_PI * (r + 1) / (rings + 1) - M_PI / 2;
    for (int s = 0; s < segments; ++s) {
      const double a = 2 * M_PI * s / segments;
      mesh.vertices.emplace_back(radius * std::cos(latitude) * std::sin(a),
                                 radius * std::sin(latitude) + std::copysign(half_length, latitude),
                                 radius * std::cos(latitude) * std::cos(a));
    }
  }
  mesh.vertices.emplace_back(0, half_length + radius, 0);
  const auto id = [&](int r, int s) { return static_cast<Index>(1 + r * segments + s % segments); };
  const auto last = static_cast<Index>(mesh.vertices.size() - 1);
  for (int s = 0; s < segments; ++s) {
    mesh.triangles.push_back({0, id(0, s + 1), id(0, s)});
    mesh.triangles.push_back({last, id(rings - 1, s), id(rings - 1, s + 1)});
    for (int r = 0; r + 1 < rings; ++r) {
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

// ------------------------------------------------------------------------------------------------------- repair

TEST(Repair, TurnsFlippedFacesAndDropsSlivers) {
  TriangleMesh mesh = Capsule(9, 14, 0.010, 0.020);
  const double volume = VolumeOf(mesh);
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 5) {
    std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  }
  // A sliver: an edge split very near its end, in both of its triangles.
  const Triangle t = mesh.triangles[40];
  const auto middle = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.emplace_back(mesh.vertices[t[0]] + 0.001 * (mesh.vertices[t[1]] - mesh.vertices[t[0]]));
  for (std::size_t i = 0, count = mesh.triangles.size(); i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Index a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3], c = mesh.triangles[i][(k + 2) % 3];
      if ((a == t[0] && b == t[1]) || (a == t[1] && b == t[0])) {
        mesh.triangles[i] = {a, middle, c};
        mesh.triangles.push_back({middle, b, c});
        break;
      }
    }
  }
  RepairReport report;
  const TriangleMesh repaired = RepairSurface(mesh, {0.0003, false, 0}, "x", &report);
  EXPECT_NEAR(VolumeOf(repaired), volume, 0.01 * volume);
  EXPECT_GE(report.edges_collapsed, 1u);
  EXPECT_GE(report.least_edge, 0.0003);
  EXPECT_EQ(report.self_intersections, 0u);
}

TEST(Repair, KeepsTheLargestPieceAndRefusesHoles) {
  TriangleMesh mesh = Capsule(9, 14, 0.010, 0.020);
  const std::size_t count = mesh.triangles.size();
  TriangleMesh crumb = Capsule(3, 6, 0.001, 0.001);
  const auto shift = static_cast<Index>(mesh.vertices.size());
  for (const Vec3d& p : crumb.vertices) {
    mesh.vertices.emplace_back(p + Vec3d(0.1, 0, 0));
  }
  for (const Triangle& t : crumb.triangles) {
    mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
  RepairReport report;
  EXPECT_EQ(RepairSurface(mesh, {1e-5, false, 0}, "x", &report).triangles.size(), count);
  EXPECT_EQ(report.pieces_dropped, 1u);
  mesh = Capsule(9, 14, 0.010, 0.020);
  mesh.triangles.pop_back();
  try {
    (void)RepairSurface(mesh, {1e-5, false, 0}, "open.stl", &report);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("open.stl: the surface is not closed (3 open edges in 1 opening, the longest around ("),
              std::string::npos)
        << error.what();
  }
  EXPECT_THROW((void)RepairSurface({{Vec3d::Zero()}, {{0, 0, 0}}}, {1e-5, false, 0}, "x", &report), InputError);
}

TEST(Decimation, ReachesItsCountAndKeepsTheShape) {
  const TriangleMesh mesh = Capsule(40, 60, 0.010, 0.020);
  const TriangleMesh coarse = Decimate(mesh, 600);
  EXPECT_LE(coarse.triangles.size(), 600u);
  EXPECT_GT(coarse.triangles.size(), 500u);
  EXPECT_NEAR(VolumeOf(coarse), VolumeOf(mesh), 0.02 * VolumeOf(mesh));
  EXPECT_EQ(Decimate(mesh, 100000).triangles.size(), mesh.triangles.size());
}

TEST(Tetrahedra, FillTheSurfaceWithTheCountAskedAndRepeatThemselves) {
  const TriangleMesh mesh = Capsule(21, 32, 0.012, 0.030);
  const TetrahedralMesh a = Tetrahedralise(mesh, 1500, "x");
  EXPECT_NEAR(static_cast<double>(a.tets.size()), 1500, 150);
  double volume = 0;
  for (const Tetrahedron& t : a.tets) {
    const double v = SignedVolume(a.vertices[t[0]], a.vertices[t[1]], a.vertices[t[2]], a.vertices[t[3]]);
    EXPECT_GT(v, 0);
    volume += v;
  }
  EXPECT_NEAR(volume, VolumeOf(mesh), 0.05 * VolumeOf(mesh));
  const TetrahedralMesh b = Tetrahedralise(mesh, 1500, "x");
  EXPECT_EQ(a.tets, b.tets);
  EXPECT_EQ(a.vertices, b.vertices);
}

// -------------------------------------------------------------------------------------------------------- drape

TEST(CentreLineOfPoints, RunsByArcLengthAndProjects) {
  const CentreLine line({Vec3d(0, 0, 0), Vec3d(0, 0.03, 0), Vec3d(0, 0.05, 0), Vec3d(0, 0.10, 0)});
  EXPECT_NEAR(line.length(), 0.10, 1e-9);
  EXPECT_NEAR((line.At(0.37) - Vec3d(0, 0.037, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR(line.Project(Vec3d(0.01, 0.04, 0.02)), 0.4, 0.02);
  EXPECT_NEAR((line.Tangent(0.9) - Vec3d::UnitY()).norm(), 0, 1e-9);
}

struct Draped {
  MembraneSettings membrane;
  TriangleMesh organ = Capsule(31, 48, 0.012, 0.030);
  std::vector<Vec3d> sheet;
};

Draped Drape() {
  Draped d;
  d.membrane.rows = 41;
  d.membrane.cols = 31;
  d.membrane.gap_m = 0.004;
  ImportSettings import;
  import.from = 0.2;
  import.to = 0.8;
  const CentreLine line({Vec3d(0, -0.035, 0), Vec3d(0, 0, 0), Vec3d(0, 0.035, 0)});
  d.sheet = DrapeMembrane(import, d.membrane, line, Vec3d::UnitZ(), d.organ, "x");
  return d;
}

TEST(Draping, KeepsTheGapAndTheDirections) {
  const Draped d = Drape();
  const TriangleLocator locator(d.organ.vertices, d.organ.triangles);
  const auto at = [&](int r, int c) { return d.sheet[static_cast<std::size_t>(r) * d.membrane.cols + c]; };
  for (int r = 8; r < d.membrane.rows - 8; ++r) {
    const auto hit = locator.Closest(at(r, 15), 0.05);
    EXPECT_NEAR(hit.closest.distance, d.membrane.gap_m, 0.0012);
  }
  // Columns along +x, rows along +y, outward +z.
  EXPECT_GT(at(20, 16).x(), at(20, 15).x());
  EXPECT_GT(at(21, 15).y(), at(20, 15).y());
  EXPECT_GT(at(20, 15).z(), 0.012);
  // Regular: neighbours in a row have nearly equal distances.
  for (int c = 1; c < d.membrane.cols; ++c) {
    EXPECT_NEAR((at(20, c) - at(20, c - 1)).norm() / (at(20, 1) - at(20, 0)).norm(), 1, 0.15);
  }
}

TEST(Draping, BedContinuesBothRims) {
  const Draped d = Drape();
  const TriangleMesh bed = ContinueSideways(d.membrane.rows, d.membrane.cols, d.sheet, 0.02);
  double low = 0, high = 0;
  for (const Vec3d& p : bed.vertices) {
    low = std::min(low, p.x());
    high = std::max(high, p.x());
  }
  EXPECT_NEAR(low, -high, 0.002);
  EXPECT_GT(high, d.sheet[31].x() + 0.01);
  EXPECT_FALSE(bed.triangles.empty());
}

/// A uterus with child, a distended stomach: thicker than a hand is wide.
TEST(Draping, GoesOverAThickOrgan) {
  const TriangleMesh organ = Capsule(31, 48, 0.085, 0.115);
  MembraneSettings membrane;
  membrane.rows = 41;
  membrane.cols = 31;
  membrane.gap_m = 0.005;
  const CentreLine line({Vec3d(0, -0.19, 0), Vec3d(0, 0, 0), Vec3d(0, 0.19, 0)});
  ImportSettings import;
  import.from = 0.3;
  import.to = 0.7;
  const auto sheet = DrapeMembrane(import, membrane, line, Vec3d::UnitZ(), organ, "x");
  EXPECT_NEAR(sheet[20 * 31 + 15].z(), 0.090, 0.002);
}

TEST(Draping, CentreLineOutsideTheOrganIsRefused) {
  const TriangleMesh organ = Capsule(31, 48, 0.012, 0.030);
  MembraneSettings membrane;
  membrane.rows = 41;
  membrane.cols = 31;
  const CentreLine line({Vec3d(0.1, -0.035, 0), Vec3d(0.1, 0.035, 0)});
  try {
    (void)DrapeMembrane(ImportSettings(), membrane, line, Vec3d::UnitZ(), organ, "x.stl");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("x.stl: 100 % of the rays"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace fulcrum::scene
