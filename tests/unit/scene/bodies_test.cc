// Scenes with several deformable bodies: shapes, tubes, what joins them, materials, and what is refused.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <set>

#include "services/base/core/error.h"
#include "services/base/core/solids.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/compiler/shapes.h"
#include "services/scene/compiler/tetrahedralise.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

/// The small scene with these further lines.
SceneSettings SmallWith(const std::string& lines) {
  return ParseSceneYaml(
             "name: several\norgan: {procedural: {rings: 22, segments: 10, length_mm: 100}}\n"
             "membrane: {rows: 41, cols: 22}\nphysics: {mode: accurate}\n" +
                 lines,
             "x.yaml", {})
      .settings;
}

std::string RefusalOf(const std::string& lines) {
  try {
    (void)BuildScene(SmallWith(lines), {});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

constexpr const char* kBodies =
    "bodies:\n"
    "  - {name: lobe, material: liver, shape: {ellipsoid_mm: [15, 20, 10], at_mm: [0, 0, 60]}, tet_edge_mm: 7,\n"
    "     held_side: [0, 0, 1]}\n"
    "  - {name: duct, material: bile_duct, look: vein, tube: {x_mm: [0, 5, 0], y_mm: [21, 40, 60],\n"
    "     z_mm: [60, 62, 70], radius_mm: [2, 1.5, 1]}, held_ends: last}\n"
    "attach: [{from: duct, to: lobe, reach_mm: 3, youngs_modulus_kPa: 20}]\n";

TEST(Bodies, AreRangesOfOneMesh) {
  const SceneData data = BuildScene(SmallWith(kBodies), {});
  const SceneView scene = data.View();
  EXPECT_FALSE(FindFault(scene));
  ASSERT_EQ(scene.solids.size(), 3u);
  EXPECT_STREQ(scene.solids[0].name, "organ");
  EXPECT_STREQ(scene.solids[1].name, "lobe");
  EXPECT_EQ(scene.solids[1].look, SolidLook::kLiver);
  EXPECT_EQ(scene.solids[2].look, SolidLook::kVein);
  EXPECT_FLOAT_EQ(scene.solids[1].youngs_modulus_Pa, 5400);
  // Only the upper part of the lobe and the last ring of the duct are fixed.
  const Solid &lobe = scene.solids[1], &duct = scene.solids[2];
  int held = 0;
  for (Index v = lobe.first_vertex; v < lobe.first_vertex + lobe.vertex_count; ++v) {
    const bool upper = scene.rest_position[v].z() > 0.063f;
    EXPECT_EQ(scene.inverse_mass[v] == 0, upper) << scene.rest_position[v].z();
    held += upper ? 1 : 0;
  }
  EXPECT_GT(held, 10);
  for (Index v = duct.first_vertex; v < duct.first_vertex + duct.vertex_count; ++v) {
    EXPECT_EQ(scene.inverse_mass[v] == 0, v + 7 >= duct.first_vertex + duct.vertex_count);
  }
  // The duct begins a millimetre beside the lobe.
  EXPECT_GT(scene.attachments.size(), 3u);
  for (const Attachment& a : scene.attachments) {
    EXPECT_GE(a.vertex, duct.first_vertex);
    EXPECT_LT(scene.rest_position[a.vertex].y(), 0.03f);
    EXPECT_GT(a.stiffness_N_per_m, 0);
  }
}

TEST(Bodies, AreWrittenAndReadAgain) {
  const SceneData data = BuildScene(SmallWith(kBodies), {});
  const auto file = std::filesystem::temp_directory_path() / ("bodies." + std::to_string(getpid()));
  const std::uint64_t hash = WriteSceneFile(data, "", file);
  const SceneFile read(file);
  EXPECT_EQ(read.view().hash, hash);
  EXPECT_EQ(read.view().solids.size(), 3u);
  EXPECT_EQ(read.view().attachments.size(), data.attachments.size());
  SceneData other = data;
  other.solids[1].youngs_modulus_Pa *= 2;
  EXPECT_NE(ContentHash(other.View()), hash);
  std::filesystem::remove(file);
}

/// Two flat blocks beside the organ, one lying on the other, with these further lines.
std::string Stacked(const std::string& attach) {
  return "bodies:\n"
         "  - {name: below, material: liver, tet_edge_mm: 6, held_side: [0, 0, -1],\n"
         "     shape: {ellipsoid_mm: [30, 25, 10], at_mm: [0, 0, 60]}}\n"
         "  - {name: above, material: bowel, tet_edge_mm: 6, held_side: [0, 0, 1],\n"
         "     shape: {ellipsoid_mm: [20, 20, 8], at_mm: [0, 0, 79]}}\n"
         "regions:\n"
         "  - {name: left, box_mm: [20, 60, 60], at_mm: [-10, 0, 70]}\n"
         "  - {name: far, ellipsoid_mm: [5, 5, 5], at_mm: [0, 0, 120]}\n"
         "  - {name: turned, box_mm: [60, 20, 60], at_mm: [-10, 0, 70], turn_deg: [0, 0, 90]}\n" +
         attach;
}

TEST(Attachments, AreGluedUnlessTheySlide) {
  const std::string pair = "{from: above, to: below, reach_mm: 5";
  const SceneData glued = BuildScene(SmallWith(Stacked("attach: [" + pair + "}]\n")), {});
  const SceneData named = BuildScene(SmallWith(Stacked("attach: [" + pair + ", kind: glued}]\n")), {});
  const SceneData sliding = BuildScene(SmallWith(Stacked("attach: [" + pair + ", kind: sliding}]\n")), {});
  EXPECT_EQ(glued.fixed.hash, named.fixed.hash);
  EXPECT_NE(glued.fixed.hash, sliding.fixed.hash);
  EXPECT_FALSE(FindFault(sliding.View()));
  ASSERT_GT(sliding.attachments.size(), 3u);
  EXPECT_LE(sliding.attachments.size(), glued.attachments.size());
  for (const Attachment& a : glued.attachments) EXPECT_TRUE(a.normal.isZero(0.0f));
  for (const Attachment& a : sliding.attachments) {
    EXPECT_NEAR(a.normal.norm(), 1, 1e-6);
    EXPECT_GT(a.normal.z(), 0.6f);
    const auto at = std::ranges::find(glued.attachments, a.vertex, &Attachment::vertex);
    ASSERT_NE(at, glued.attachments.end());
    EXPECT_EQ(at->surface, a.surface);
    EXPECT_EQ(at->stiffness_N_per_m, a.stiffness_N_per_m);
  }
}

TEST(Attachments, GluedOnesAreHashedWithoutTheirNormals) {
  const std::string pair = "{from: above, to: below, reach_mm: 5";
  const SceneData glued = BuildScene(SmallWith(Stacked("attach: [" + pair + "}]\n")), {});
  std::vector<std::byte> bytes;  // As of a scene file before version 16.
  for (const Attachment& a : glued.attachments) {
    const auto of = std::as_bytes(std::span(&a, 1)).first(32);
    bytes.insert(bytes.end(), of.begin(), of.end());
  }
  Hash64 before, now;
  before.Add(std::span<const std::byte>(bytes));
  AddToHash(glued.attachments, &now);
  EXPECT_EQ(now.value(), before.value());
}

TEST(Sheets, AreHashedWithoutHeatOfTheirOwnUnlessOneHasIt) {
  std::array<SheetPart, 2> sheets{SheetPart{"a", 0, 9, 9, 0}, SheetPart{"b", 17, 9, 9, 0}};
  const auto hash_of = [&] {
    Hash64 hash;
    AddToHash(sheets, &hash);
    return hash.value();
  };
  std::vector<std::byte> bytes;  // As of a scene file before version 16.
  for (const SheetPart& sheet : sheets) {
    const auto of = std::as_bytes(std::span(&sheet, 1)).first(64);
    bytes.insert(bytes.end(), of.begin(), of.end());
  }
  Hash64 before;
  before.Add(std::span<const std::byte>(bytes));
  EXPECT_EQ(hash_of(), before.value());
  std::set<std::uint64_t> different{before.value()};
  for (float SheetPart::*own : {&SheetPart::thickness_m, &SheetPart::conductivity_W_mK, &SheetPart::sigma_S_m}) {
    sheets[1].*own = 0.4f;
    different.insert(hash_of());
    sheets[1].*own = 0;
  }
  EXPECT_EQ(different.size(), 4u);
}

TEST(Attachments, StayWithinARegion) {
  const auto of = [](const std::string& more) {
    return BuildScene(SmallWith(Stacked("attach: [{from: above, to: below, reach_mm: 5" + more + "}]\n")), {});
  };
  const SceneData all = of(""), from = of(", from_region: left"), to = of(", to_region: left"),
                  turned = of(", from_region: turned");
  const auto left_of = [](const SceneData& scene) {
    return std::ranges::count_if(scene.attachments,
                                 [&](const Attachment& a) { return scene.rest_position[a.vertex].x() <= 0; });
  };
  EXPECT_GT(left_of(all), 3);
  EXPECT_LT(left_of(all), std::ssize(all.attachments));
  EXPECT_EQ(std::ssize(from.attachments), left_of(all));
  EXPECT_EQ(left_of(from), left_of(all));
  EXPECT_EQ(turned.fixed.hash, from.fixed.hash);
  for (const Attachment& a : to.attachments) {
    EXPECT_TRUE(std::ranges::any_of(a.surface, [&](Index v) { return to.rest_position[v].x() <= 1e-6f; }));
  }
}

TEST(Attachments, BadOnesAreRefusedWithWhatIsNear) {
  const auto refusal = [](const std::string& entry) { return RefusalOf(Stacked("attach: [" + entry + "]\n")); };
  const auto expect = [](const std::string& text, std::initializer_list<const char*> parts) {
    for (const char* part : parts) EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(refusal("{from: above, to: below, kind: fat}"), {"kind", "glued", "sliding"});
  expect(refusal("{from: above, to: below, from_region: right}"), {"from_region", "'right'", "left, far, turned"});
  expect(refusal("{from: above, to: below, from_region: far}"), {"'above' lies in region 'far'", "mm outside, at"});
  expect(refusal("{from: above, to: below, to_region: far}"), {"'below' lies in region 'far'", "mm outside, at"});
  expect(refusal("{from: above, to: below, reach_mm: 0.1}"),
         {"within 0.1 mm", "the nearest, at", "mm away", "reach_mm"});
  expect(RefusalOf("regions: [{name: a}]\n"), {"box_mm", "ellipsoid_mm"});
  expect(RefusalOf("regions: [{name: a, box_mm: [1, 1, 0]}]\n"), {"box_mm", "0.1"});
  expect(RefusalOf("regions: [{name: a, box_mm: [1, 1, 1]}, {name: a, box_mm: [1, 1, 1]}]\n"), {"'a' is there twice"});
}

TEST(Attachments, FaultsOfSlidingOnesAreFound) {
  const SceneData good =
      BuildScene(SmallWith(Stacked("attach: [{from: above, to: below, reach_mm: 5, kind: sliding}]\n")), {});
  const std::vector<std::function<void(Attachment&)>> faults = {
      [](Attachment& a) { a.normal *= 2; },
      [](Attachment& a) { a.normal.x() = NAN; },
      [](Attachment& a) { std::swap(a.surface[0], a.surface[1]); },
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SceneData bad = good;
    faults[i](bad.attachments[0]);
    const auto fault = FindFault(bad.View());
    ASSERT_TRUE(fault) << i;
    EXPECT_EQ(fault->section, "attachments") << fault->reason;
  }
}

TEST(Bodies, OneOrganNeedsNoList) {
  const SceneData data = BuildScene(SmallWith(""), {});
  EXPECT_TRUE(data.solids.empty());
  EXPECT_TRUE(data.attachments.empty());
  EXPECT_EQ(SolidCount(data.View()), 1u);
  SceneSettings liver = SmallWith("");
  liver.organ_look = SolidLook::kLiver;
  EXPECT_EQ(BuildScene(liver, {}).solids.size(), 1u);
}

TEST(Bodies, ATubeFollowsItsLine) {
  ShapeSettings shape;
  shape.line_m = {Vec3f(0, 0, 0), Vec3f(0.03f, 0, 0.01f), Vec3f(0.06f, 0.02f, 0)};
  shape.radius_m = {0.003, 0.002, 0.001};
  const TubeBody tube = TubeOfShape(shape, 0.004);
  double volume = 0;
  for (const Tetrahedron& t : tube.tets.tets) {
    const auto& x = tube.tets.vertices;
    const double v = SignedVolume(x[t[0]], x[t[1]], x[t[2]], x[t[3]]);
    EXPECT_GT(v, 0);
    volume += v;
  }
  // Each face belongs to one or two tetrahedra, and what the surface encloses is what they fill.
  const TriangleMesh boundary{tube.tets.vertices, BoundaryOf(tube.tets.tets)};
  EXPECT_NEAR(EnclosedVolume(boundary), volume, 1e-12);
  EXPECT_NEAR(EnclosedVolume(tube.surface) / volume, std::numbers::pi / (1.5 * std::sqrt(3.0)), 0.08);
}

TEST(Bodies, ATubeThatFoldsIsRefused) {
  ShapeSettings shape;
  shape.line_m = {Vec3f(0, 0, 0), Vec3f(0.015f, 0, 0), Vec3f(0.015f, 0.015f, 0)};
  shape.radius_m = {0.006, 0.006, 0.006};
  EXPECT_THROW((void)TubeOfShape(shape, 0.012), InputError);
  for (double& r : shape.radius_m) r = 0.002;
  const TubeBody tube = TubeOfShape(shape, 0.002);
  double volume = 0;
  for (const Tetrahedron& t : tube.tets.tets) {
    const auto& x = tube.tets.vertices;
    volume += SignedVolume(x[t[0]], x[t[1]], x[t[2]], x[t[3]]);
  }
  EXPECT_NEAR(EnclosedVolume({tube.tets.vertices, BoundaryOf(tube.tets.tets)}), volume, 1e-12);
  shape.line_m = {Vec3f(-5, 0, 0), Vec3f(5, 0, 0)};
  shape.radius_m = {0.0003, 0.0003};
  EXPECT_THROW((void)SurfaceOfShape(shape), InputError) << "too many rings";
}

TEST(Bodies, TheMembraneIsBoundToTheOrganOnly) {
  // A body within reach of the membrane, on its other side.
  const SceneData data = BuildScene(SmallWith("bodies: [{name: a, material: liver, tet_edge_mm: 5,\n"
                                              "  shape: {ellipsoid_mm: [12, 12, 6], at_mm: [0, 0, 36]}}]\n"),
                                    {});
  ASSERT_EQ(data.solids.size(), 2u);
  for (const Binding& binding : data.bindings) EXPECT_LT(binding.surface[0], data.solids[1].first_vertex);
}

TEST(Bodies, ASweptShapeIsClosedAndRound) {
  ShapeSettings shape;
  shape.line_m = {Vec3f(0, 0, 0), Vec3f(0, 0.05f, 0)};
  shape.radius_m = {0.01, 0.01};
  const double round = std::numbers::pi * (0.01 * 0.01 * 0.05 + 4.0 / 3 * 1e-6);
  EXPECT_NEAR(EnclosedVolume(SurfaceOfShape(shape)), round, 0.02 * round);
  shape.radii_m = Vec3f(0.02f, 0.03f, 0.01f);
  shape.turn_rad = Vec3f(0.3f, -0.4f, 1.0f);
  const double ellipsoid = 4.0 / 3 * std::numbers::pi * 6e-6;
  EXPECT_NEAR(EnclosedVolume(SurfaceOfShape(shape)), ellipsoid, 0.02 * ellipsoid);
}

struct Refused {
  const char *lines, *reason;
};

TEST(Bodies, FixedSurfacesNeedNoOrgan) {
  const SceneSettings settings = ParseSceneYaml(
                                     "name: fixed\nphysics: {mode: accurate}\n"
                                     "bodies:\n"
                                     "  - {name: lobe, material: liver, shape: {ellipsoid_mm: [15, 20, 10]}}\n"
                                     "fixed:\n"
                                     "  - {name: wall, shape: {ellipsoid_mm: [90, 80, 70]}, inside: true,\n"
                                     "     role: abdominal_wall, triangles_max: 500}\n"
                                     "  - {name: spleen, shape: {ellipsoid_mm: [12, 12, 12], at_mm: [40, 0, 0]},\n"
                                     "     offset_mm: [0, 5, 0], collides: true}\n",
                                     "x.yaml", {})
                                     .settings;
  const SceneData data = BuildScene(settings, {});
  const SceneView scene = data.View();
  EXPECT_FALSE(FindFault(scene));
  ASSERT_EQ(scene.static_surfaces.size(), 2u);
  const auto check = [&](const StaticSurface& surface, const Vec3f& centre, float least_m, float most_m, float side) {
    for (Index k = 0; k < surface.triangle_count; ++k) {
      const Triangle& t = scene.static_triangles[surface.first_triangle + k];
      const Vec3f &a = scene.static_vertices[t[0]], &b = scene.static_vertices[t[1]], &c = scene.static_vertices[t[2]];
      const Vec3f middle = (a + b + c) / 3 - centre;
      EXPECT_GT(side * (b - a).cross(c - a).dot(middle), 0.0f) << surface.name << " faces the wrong side";
      EXPECT_GT(middle.norm(), least_m);
      EXPECT_LT(middle.norm(), most_m);
    }
  };
  const StaticSurface &wall = scene.static_surfaces[0], &spleen = scene.static_surfaces[1];
  EXPECT_STREQ(wall.name, "wall");
  EXPECT_EQ(wall.role, SurfaceRole::kAbdominalWall);
  EXPECT_EQ(wall.collides, 0u);
  EXPECT_LE(wall.triangle_count, 500u);
  check(wall, Vec3f::Zero(), 0.06f, 0.091f, -1);
  EXPECT_EQ(spleen.collides, 1u);
  check(spleen, Vec3f(0.040f, 0.005f, 0), 0.011f, 0.0121f, 1);
}

TEST(Bodies, BadFixedSurfacesAreRefused) {
  const auto of = [](const std::string& entry) { return RefusalOf("fixed: [" + entry + "]\n"); };
  EXPECT_NE(of("{name: a}").find("needs either `mesh` or `shape`"), std::string::npos) << of("{name: a}");
  const std::string twice = "{name: a, shape: {ellipsoid_mm: [9, 9, 9]}}";
  EXPECT_NE(of(twice + ", " + twice).find("'a' is there twice"), std::string::npos);
  for (const char* name : {"membrane", "cavity"}) {
    const std::string refusal = of("{name: " + std::string(name) + ", shape: {ellipsoid_mm: [9, 9, 9]}}");
    EXPECT_NE(refusal.find("'" + std::string(name) + "' is the name of another surface"), std::string::npos) << refusal;
  }
  EXPECT_NE(of("{name: a, role: spleen, shape: {ellipsoid_mm: [9, 9, 9]}}").find("role"), std::string::npos);
  EXPECT_NE(of("{name: a, mesh: nowhere.stl}").find("nowhere.stl"), std::string::npos);
}

TEST(Bodies, BadOnesAreRefused) {
  const std::vector<Refused> all = {
      {"bodies: [{name: a, material: cheese, tube: {x_mm: [0, 1], y_mm: [0, 0], z_mm: [0, 0], radius_mm: [1]}}]\n",
       "artery, bile_duct"},
      {"bodies: [{name: a, material: liver}]\n", "needs one of"},
      {"bodies: [{name: a, material: liver, mesh: nowhere.stl}]\n", "nowhere.stl"},
      {"bodies: [{name: organ, material: liver, shape: {ellipsoid_mm: [9, 9, 9]}}]\n", "'organ' is there twice"},
      {"bodies: [{name: a, material: liver, tube: {x_mm: [0, 1], y_mm: [0, 0], z_mm: [0, 1, 2], radius_mm: [1]}}]\n",
       "as many entries"},
      {"bodies: [{name: a, material: liver, tube: {x_mm: [0, 0], y_mm: [0, 0], z_mm: [0, 0], radius_mm: [1]}}]\n",
       "apart"},
      {"attach: [{from: organ, to: moon}]\n", "'moon'"},
      {"attach: [{from: organ, to: organ}]\n", "another body"},
      {"bodies: [{name: a, material: liver, shape: {ellipsoid_mm: [15, 15, 15], at_mm: [0, 0, 150]}}]\n"
       "attach: [{from: a, to: organ, reach_mm: 2}]\n",
       "within 2 mm"},
      {"bodies: [{name: bent, material: artery, tet_edge_mm: 12, tube: {x_mm: [0, 15, 15], y_mm: [0, 0, 15],\n"
       "  z_mm: [90, 90, 90], radius_mm: [6]}}]\n",
       "body 'bent': bends more tightly"},
      {"bodies: [{name: a, material: liver, shape: {ellipsoid_mm: [9, 9, 9]}, mesh: a.stl}]\n", "one too many"},
  };
  for (const Refused& refused : all) {
    EXPECT_NE(RefusalOf(refused.lines).find(refused.reason), std::string::npos)
        << refused.lines << RefusalOf(refused.lines);
  }
}

TEST(Bodies, FaultsOfAFileAreFound) {
  const SceneData good = BuildScene(SmallWith(kBodies), {});
  const std::vector<std::pair<const char*, std::function<void(SceneData&)>>> faults = {
      {"solids", [](SceneData& s) { s.solids[1].first_vertex += 1; }},
      {"solids", [](SceneData& s) { s.solids[2].vertex_count -= 1; }},
      {"solids", [](SceneData& s) { s.solids[0].surface_triangle_count += 1; }},
      {"solids", [](SceneData& s) { s.solids[1].youngs_modulus_Pa = NAN; }},
      {"solids", [](SceneData& s) { s.solids[1].look = static_cast<SolidLook>(99); }},
      {"solids", [](SceneData& s) { std::fill(std::begin(s.solids[1].name), std::end(s.solids[1].name), 'x'); }},
      {"attachments", [](SceneData& s) { s.attachments[0].vertex = s.fixed.tube_vertex_count; }},
      {"attachments", [](SceneData& s) { s.attachments[0].surface[1] = 0; }},
      {"attachments", [](SceneData& s) { s.attachments[0].vertex = s.attachments[0].surface[0]; }},
      {"attachments", [](SceneData& s) { s.attachments[0].stiffness_N_per_m = INFINITY; }},
      {"attachments", [](SceneData& s) { s.fixed.physics.mode = PhysicsMode::kXpbd; }},
      {"tets", [](SceneData& s) { std::swap(s.tets[0][0], s.tets[s.tets.size() - 1][0]); }},
      {"solids", [](SceneData& s) { s.solids.pop_back(); }},
      {"solids", [](SceneData& s) { s.solids.resize(kMaxSolids + 1, s.solids[2]); }},
      {"bindings", [](SceneData& s) { s.bindings[0].surface[1] = s.solids[1].first_vertex; }},
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SceneData bad = good;
    faults[i].second(bad);
    const auto fault = FindFault(bad.View());
    ASSERT_TRUE(fault) << i;
    EXPECT_EQ(fault->section, faults[i].first) << i << ": " << fault->reason;
  }
}

}  // namespace
}  // namespace fulcrum::scene
