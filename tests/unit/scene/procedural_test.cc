// The built scenes: counts of the paper, valid elements, valid colours, bindings, embedding, rest lengths, script.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "services/base/core/error.h"
#include "services/base/core/operator_script.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/builder/quality.h"
#include "services/scene/format/colouring.h"

namespace fulcrum::scene {
namespace {

/// Each scene is built once for all tests.
const SceneData& Scene(const std::string& name) {
  static const SceneData built_in = BuildProcedural(BuiltIn());
  static const SceneData small = BuildProcedural(Small());
  return name == "built-in" ? built_in : small;
}

class ProceduralScene : public testing::TestWithParam<const char*> {
 protected:
  const SceneData& data_ = Scene(GetParam());
  const SceneView view_ = data_.View();
  [[nodiscard]] Vec3d X(Index i) const { return view_.rest_position[i].cast<double>(); }
};
INSTANTIATE_TEST_SUITE_P(Shipped, ProceduralScene, testing::Values("built-in", "small"),
                         [](const auto& test) { return test.index == 0 ? "BuiltIn" : "Small"; });

TEST(BuiltInScene, HasTheCountsOfTable3Within2Percent) {
  const SceneQuality q = Measure(Scene("built-in").View());
  const auto expect_near = [](double count, double paper) { EXPECT_NEAR(count / paper, 1.0, 0.02); };
  expect_near(static_cast<double>(q.vertices), 20556);
  expect_near(static_cast<double>(q.organ_springs + q.membrane_springs), 65279);
  expect_near(static_cast<double>(q.organ_springs + q.membrane_springs + q.bindings), 65279);
  expect_near(static_cast<double>(q.tets), 6105);
  expect_near(static_cast<double>(q.bending), 1853);
  EXPECT_EQ(q.membrane_springs, 54783u);
}

TEST(SmallScene, IsAboutATenth) {
  const SceneQuality q = Measure(Scene("small").View());
  EXPECT_NEAR(static_cast<double>(q.vertices), 2056, 200);
  EXPECT_NEAR(static_cast<double>(q.tets), 610, 61);
}

TEST_P(ProceduralScene, TetrahedraHavePositiveVolumeAndFillTheWall) {
  const SceneSettings settings = std::string(GetParam()) == "small" ? Small() : BuiltIn();
  const TubeSettings& tube = settings.tube;
  double volume = 0;
  for (const Tetrahedron& t : view_.tets) {
    const double v = SignedVolume(X(t[0]), X(t[1]), X(t[2]), X(t[3]));
    EXPECT_GT(v, 0);
    volume += v;
  }
  // Prism of the polygon's area; the bends and folds change the length by a few percent.
  const double outer = tube.outer_radius_m, inner = outer - tube.wall_m, n = tube.segments;
  const double polygon = 0.5 * n * std::sin(2 * M_PI / n);
  EXPECT_NEAR(volume / (polygon * (outer * outer - inner * inner) * tube.length_m), 1.0, 0.06);
}

TEST_P(ProceduralScene, SurfaceIsClosedAndPointsOutward) {
  // Closed: each directed edge has its opposite. Outward: the divergence theorem gives the volume.
  std::multiset<std::pair<Index, Index>> edges;
  double volume = 0, tet_volume = 0;
  for (const Triangle& t : view_.tube_surface) {
    for (int k = 0; k < 3; ++k) {
      edges.insert({t[k], t[(k + 1) % 3]});
    }
    volume += X(t[0]).dot(X(t[1]).cross(X(t[2]))) / 6;
  }
  for (const auto& [a, b] : edges) {
    EXPECT_EQ(edges.count({a, b}), 1u);
    EXPECT_EQ(edges.count({b, a}), 1u);
  }
  for (const Tetrahedron& t : view_.tets) {
    tet_volume += SignedVolume(X(t[0]), X(t[1]), X(t[2]), X(t[3]));
  }
  EXPECT_NEAR(volume, tet_volume, 1e-6 * tet_volume);
}

TEST_P(ProceduralScene, AtlasMetricGivesTheLengthsOfTheSheet) {
  const std::vector<AtlasMetric> metrics = MeasureAtlas(view_);
  const std::size_t cols = view_.membrane.cols;
  ASSERT_EQ(metrics.size(), (view_.membrane.rows - 1) * (cols - 1));
  double worst = 0;
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    const std::size_t r = i / (cols - 1), c = i % (cols - 1), n = r * cols + c;
    // Between the middles of the cell's sides, where the bilinear map's derivative holds exactly.
    for (const auto& [a, b, d, e] :
         {std::array{n, n + cols, n + 1, n + cols + 1}, {n, n + 1, n + cols, n + cols + 1}}) {
      const Vec2f m = view_.membrane_material[d] + view_.membrane_material[e] - view_.membrane_material[a] -
                      view_.membrane_material[b];
      const auto p = [&](std::size_t k) { return X(view_.membrane.first + static_cast<Index>(k)); };
      const double length = (p(d) + p(e) - p(a) - p(b)).norm();
      const AtlasMetric& g = metrics[i];
      const double told = std::sqrt(g.ss * m.x() * m.x() + 2 * g.st * m.x() * m.y() + g.tt * m.y() * m.y());
      worst = std::max(worst, std::abs(told / length - 1));
    }
  }
  EXPECT_LT(worst, 1e-4) << "rounding of the float positions";
}

TEST(AtlasMetric, TellsStretchesAndArea) {
  const AtlasMetric shear{1, 0.5, 1.25};  // Metric of the map (s + t/2, t).
  EXPECT_NEAR(shear.area(), 1, 1e-12);
  EXPECT_NEAR(shear.stretches()[0] * shear.stretches()[1], 1, 1e-12);
  const AtlasMetric stretched{4, 0, 0.25};
  EXPECT_NEAR(stretched.stretches()[0], 0.5, 1e-12);
  EXPECT_NEAR(stretched.stretches()[1], 2, 1e-12);
}

TEST(SplitInFive, FillsTheWallWithFacesThatMatchAlsoRoundTheRing) {
  SceneSettings settings = BuiltIn();
  settings.tube.split = BrickSplit::kFive;
  const SceneData five = BuildProcedural(settings);
  const SceneQuality q = Measure(five.View()), six = Measure(Scene("built-in").View());
  EXPECT_EQ(q.tets, 42u * 24u * 5u);
  EXPECT_EQ(q.organ_vertices, six.organ_vertices);
  EXPECT_GT(q.least_tet_volume_m3, 0);
  EXPECT_NEAR(q.organ_volume_m3 / six.organ_volume_m3, 1, 0.005) << "the sides of bricks are not exactly flat";
  // Two triangles for every outer face of a brick: faces that do not match would give more.
  EXPECT_EQ(five.View().tube_surface.size(), 2u * (2 * 42 * 24 + 2 * 24));
  std::multiset<std::pair<Index, Index>> edges;
  for (const Triangle& t : five.View().tube_surface) {
    for (std::size_t k = 0; k < 3; ++k) {
      edges.insert({t[k], t[(k + 1) % 3]});
    }
  }
  for (const auto& [a, b] : edges) {
    EXPECT_EQ(edges.count({a, b}), 1u);
    EXPECT_EQ(edges.count({b, a}), 1u);
  }
}

TEST(SplitInFive, NeedsAnEvenNumberOfSegments) {
  SceneSettings settings = Small();
  settings.tube.split = BrickSplit::kFive;
  settings.tube.segments = 15;
  EXPECT_THROW((void)BuildProcedural(settings), InputError);
}

template <class Constraint>
void ExpectValidColours(std::span<const Constraint> constraints, std::span<const Index> offsets) {
  ASSERT_EQ(offsets.front(), 0u);
  ASSERT_EQ(offsets.back(), constraints.size());
  for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
    std::set<Index> seen;
    for (Index i = offsets[k]; i < offsets[k + 1]; ++i) {
      for (const Index p : ParticlesOf(constraints[i])) {
        EXPECT_TRUE(seen.insert(p).second) << "particle " << p << " twice in colour " << k;
      }
    }
  }
}

TEST_P(ProceduralScene, NoTwoConstraintsOfAColourShareAParticle) {
  ExpectValidColours(view_.tets, view_.tet_colours);
  ExpectValidColours(view_.tube_edges, view_.tube_edge_colours);
  ExpectValidColours(view_.bending, view_.bending_colours);
  ExpectValidColours(view_.bindings, view_.binding_colours);
}

TEST_P(ProceduralScene, RestLengthsAreTheDistancesAtRest) {
  for (const StretchConstraint& e : view_.tube_edges) {
    EXPECT_NEAR(e.rest_length, (X(e.a) - X(e.b)).norm(), 1e-8);
  }
  const MembraneGrid& m = view_.membrane;
  const Index step[3] = {1, m.cols, m.cols + 1};
  for (Index i = 0; i < 3 * m.node_count(); ++i) {
    const Index r = i / 3 / m.cols, c = i / 3 % m.cols, k = i % 3;
    const bool exists = (k == 0 || r + 1 < m.rows) && (k == 1 || c + 1 < m.cols);
    const float length = view_.membrane_rest_length[i];
    const Index a = m.first + i / 3;
    EXPECT_NEAR(length, exists ? (X(a) - X(a + step[k])).norm() : 0, 1e-8);
  }
}

TEST_P(ProceduralScene, BendingAnglesAreThoseAtRestAndSmall) {
  for (const BendingConstraint& b : view_.bending) {
    EXPECT_NEAR(b.rest_angle, DihedralAngle(X(b.v[0]), X(b.v[1]), X(b.v[2]), X(b.v[3])), 1e-5);
    EXPECT_LT(std::abs(b.rest_angle), 1.2);
  }
}

TEST_P(ProceduralScene, BindingsReachTheSurfaceFromTheNodeByTheirRestLength) {
  for (const Binding& b : view_.bindings) {
    Vec3d p = Vec3d::Zero();
    float sum = 0;
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(b.barycentric[k], 0);
      sum += b.barycentric[k];
      p += b.barycentric[k] * X(b.surface[k]);
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_NEAR((X(b.membrane) - p).norm(), b.rest_length, 1e-7);
    EXPECT_GT(view_.inverse_mass[b.membrane], 0);
  }
}

TEST_P(ProceduralScene, MembraneLiesOutsideTheOrganWithFatBetween) {
  const SceneQuality q = Measure(view_);
  EXPECT_GT(q.least_binding_m, 0.0035);
  EXPECT_LT(q.largest_binding_m, 0.0070);
  for (const Binding& b : view_.bindings) {
    const Vec3d n = (X(b.surface[1]) - X(b.surface[0])).cross(X(b.surface[2]) - X(b.surface[0]));
    EXPECT_GT(n.dot(X(b.membrane) - X(b.surface[0])), 0);
  }
}

TEST_P(ProceduralScene, EmbeddedSurfaceFollowsTheTetrahedra) {
  // Weights reproduce positions: the surface follows any affine map of the particles exactly.
  const Eigen::Matrix3d map = (Eigen::Matrix3d() << 1.1, 0.2, 0, -0.1, 0.9, 0.3, 0.2, 0, 1.2).finished();
  for (std::size_t i = 0; i < view_.surface_vertices.size(); i += 37) {
    const EmbeddedVertex& v = view_.surface_vertices[i];
    const Tetrahedron& t = view_.tets[v.tetrahedron];
    Vec3d rest = Vec3d::Zero(), moved = Vec3d::Zero();
    for (int k = 0; k < 4; ++k) {
      rest += v.barycentric[k] * X(t[k]);
      moved += v.barycentric[k] * (map * X(t[k]));
    }
    EXPECT_NEAR((map * rest - moved).norm(), 0, 1e-7);
  }
  EXPECT_GT(Measure(view_).least_weight, -1.0);
}

TEST_P(ProceduralScene, EndsAndRimsAreFixedAndNothingElse) {
  const MembraneGrid& m = view_.membrane;
  for (Index i = 0; i < m.node_count(); ++i) {
    const Index r = i / m.cols, c = i % m.cols;
    const bool rim = r == 0 || c == 0 || r + 1 == m.rows || c + 1 == m.cols;
    EXPECT_EQ(view_.inverse_mass[m.first + i] == 0, rim);
  }
  const SceneSettings settings = std::string(GetParam()) == "small" ? Small() : BuiltIn();
  const Index ring = 2 * static_cast<Index>(settings.tube.segments);
  for (Index i = 0; i < view_.tube_vertex_count; ++i) {
    EXPECT_EQ(view_.inverse_mass[i] == 0, i < ring || i >= view_.tube_vertex_count - ring);
  }
}

TEST_P(ProceduralScene, MassIsThatOfDensityTimesAreaInside) {
  // An inner node's mass: density times a third of the six triangles round it.
  const MembraneGrid& m = view_.membrane;
  const Index n = m.first + (m.rows / 2) * m.cols + m.cols / 2;
  const auto area = [&](Index a, Index b, Index c) { return (X(b) - X(a)).cross(X(c) - X(a)).norm() / 2; };
  const Index up = n + m.cols, down = n - m.cols;
  const double sum = area(n, n + 1, up + 1) + area(n, up + 1, up) + area(n, up, n - 1) + area(n, n - 1, down - 1) +
                     area(n, down - 1, down) + area(n, down, n + 1);
  EXPECT_NEAR(1 / view_.inverse_mass[n] / (0.5 * sum / 3), 1, 1e-5);
}

TEST_P(ProceduralScene, MaterialCoordinatesKeepLengths) {
  const SceneQuality q = Measure(view_);
  EXPECT_LT(q.rms_flat_error, 0.02);
  EXPECT_GT(q.least_flat_ratio, 0.92);
  EXPECT_LT(q.largest_flat_ratio, 1.08);
  EXPECT_LT(std::max(q.sheet_m[0], q.sheet_m[1]), kAtlasTexels * view_.membrane.texel_m);
}

TEST_P(ProceduralScene, ScriptGraspsThenCutsWithinTheWorkspace) {
  float cut_s = 0, closed_s = 0;
  Vec3f cut_from = Vec3f::Zero(), cut_to = Vec3f::Zero();
  for (const ScriptKey& key : view_.script) {
    const float reach = (key.p_W - view_.tools[key.tool].p_WP).norm();
    EXPECT_GT(reach, 0.015f);
    EXPECT_LT(reach, view_.tools[key.tool].shaft_length_m - 0.015f);
    if (key.tool == 0 && key.jaw_rad == 0 && closed_s == 0) {
      closed_s = key.time_s;
    }
    if (key.pedals == kPedalCut) {
      EXPECT_EQ(key.tool, 1u);
      cut_from = cut_s == 0 ? key.p_W : cut_from;
      cut_s = cut_s == 0 ? key.time_s : cut_s;
      cut_to = key.p_W;
    }
  }
  EXPECT_GT(closed_s, 0);
  EXPECT_GT(cut_s, closed_s);
  EXPECT_GT((cut_to - cut_from).norm(), std::string(GetParam()) == "small" ? 0.008f : 0.028f);
  // No tool is faster than a hand.
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    for (double t = 0; t < view_.script_duration_s; t += 0.01) {
      const Vec3f a = EvaluateScript(view_.script, tool, t).p_W, b = EvaluateScript(view_.script, tool, t + 0.01).p_W;
      EXPECT_LT((b - a).norm() / 0.01f, 0.12f);
    }
  }
}

TEST_P(ProceduralScene, ProtectedStructuresRunUnderTheMembrane) {
  ASSERT_GE(view_.protected_structures.size(), 2u);
  for (const ProtectedPoint& p : view_.protected_points) {
    float nearest = 1;
    Index node = 0;
    for (Index i = 0; i < view_.membrane.node_count(); ++i) {
      const float d = (view_.rest_position[view_.membrane.first + i] - p.p_W).norm();
      if (d < nearest) {
        nearest = d;
        node = i;
      }
    }
    EXPECT_LT(nearest, 0.006f);
    EXPECT_LT((view_.membrane_material[node] - p.material).norm(), 0.005f);
  }
}

TEST(SceneBuild, SameSettingsGiveTheSameHash) {
  EXPECT_EQ(BuildProcedural(Small()).fixed.hash, Scene("small").fixed.hash);
  SceneSettings other = Small();
  other.physics.k_bending += 0.01f;
  EXPECT_NE(BuildProcedural(other).fixed.hash, Scene("small").fixed.hash);
}

std::string Refusal(const SceneSettings& settings) {
  try {
    (void)BuildProcedural(settings);
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(SceneBuild, RefusesWhatDoesNotFit) {
  SceneSettings many = Small();
  many.membrane.rows = 4001;
  many.membrane.cols = 64;
  EXPECT_NE(Refusal(many).find("would need 982 MB; valid: at most 250000."), std::string::npos) << Refusal(many);
  SceneSettings wide = Small();
  wide.tube.length_m = 0.45;
  EXPECT_NE(Refusal(wide).find("the atlas"), std::string::npos) << Refusal(wide);
  SceneSettings unbound = Small();
  unbound.membrane.binding_reach_m = 0.001;
  EXPECT_NE(Refusal(unbound).find("binding_reach"), std::string::npos);
  SceneSettings stride = Small();
  stride.membrane.bending_row_stride = 5;
  EXPECT_NE(Refusal(stride).find("must divide rows - 1 = 72"), std::string::npos);
  SceneSettings far = Small();
  far.script[0].world_m = Vec3f(0, 0, -0.4f);
  EXPECT_NE(Refusal(far).find("from the trocar"), std::string::npos);
  SceneSettings toolless = Small();
  toolless.tools[1].kind = ToolKind::kNone;
  EXPECT_NE(Refusal(toolless).find("no tool 1"), std::string::npos);
}

TEST(Embedding, ReproducesPointsInsideAndOutside) {
  const SceneData& scene = Scene("small");
  std::vector<Vec3d> vertices, points;
  for (const Vec3f& p : scene.rest_position) {
    vertices.push_back(p.cast<double>());
  }
  vertices.resize(scene.fixed.tube_vertex_count);
  for (std::size_t i = 0; i < scene.tets.size(); i += 7) {
    const Tetrahedron& t = scene.tets[i];
    points.push_back(0.1 * vertices[t[0]] + 0.2 * vertices[t[1]] + 0.3 * vertices[t[2]] + 0.4 * vertices[t[3]]);
  }
  const std::size_t inside = points.size();
  points.emplace_back(0.5, 0.5, 0.5);
  points.emplace_back(0, 0, 0.02);
  const auto embedded = EmbedPoints(vertices, scene.tets, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec3d p = Vec3d::Zero();
    for (int k = 0; k < 4; ++k) {
      p += embedded[i].barycentric[k] * vertices[scene.tets[embedded[i].tetrahedron][k]];
      if (i < inside) {
        EXPECT_GT(embedded[i].barycentric[k], -1e-9);
      }
    }
    EXPECT_NEAR((p - points[i]).norm(), 0, 1e-9);
  }
}

TEST(TriangleLocator, AgreesWithBruteForce) {
  const SceneData& scene = Scene("small");
  std::vector<Vec3d> vertices;
  for (const Vec3f& p : scene.rest_position) {
    vertices.push_back(p.cast<double>());
  }
  const TriangleLocator locator(vertices, scene.tube_surface);
  for (int i = 0; i < 200; ++i) {
    const Vec3d p(0.02 * std::sin(1.3 * i), 0.045 * std::sin(0.7 * i), 0.02 * std::cos(2.1 * i));
    double nearest = 1;
    for (const Triangle& t : scene.tube_surface) {
      nearest = std::min(nearest, ClosestOnTriangle(p, vertices[t[0]], vertices[t[1]], vertices[t[2]]).distance);
    }
    const auto hit = locator.Closest(p, 0.05);
    ASSERT_NE(hit.triangle, kNoIndex);
    EXPECT_NEAR(hit.closest.distance, nearest, 1e-12);
    EXPECT_EQ(locator.Closest(p, 0.9 * nearest).triangle, kNoIndex);
  }
}

TEST(DihedralAngle, IsZeroWhenFlatAndSignedOtherwise) {
  const Vec3d a(0, 0, 0), b(1, 0, 0), up(0.5, 1, 0);
  EXPECT_NEAR(DihedralAngle(a, b, up, Vec3d(0.5, -1, 0)), 0, 1e-12);
  const double bent = DihedralAngle(a, b, up, Vec3d(0.5, -1, 0.2));
  EXPECT_NEAR(DihedralAngle(a, b, up, Vec3d(0.5, -1, -0.2)), -bent, 1e-12);
  EXPECT_NEAR(std::abs(bent), std::atan(0.2), 1e-12);
}

}  // namespace
}  // namespace fulcrum::scene
