#include "render_node/scene_graph/surroundings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <osg/CullFace>
#include <span>
#include <vector>

#include "render_node/geometry/background_anatomy.h"
#include "render_node/geometry/surface.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"
#include "services/base/core/breathing.h"

namespace fulcrum::render {
namespace {

using Float4 = std::array<float, 4>;

/// Adds the sphere of the cavity, seen from inside.
void AppendCavity(const Cavity& cavity, std::vector<Vec3f>* positions, std::vector<Vec3f>* normals,
                  std::vector<Triangle>* triangles) {
  constexpr Index kMeridians = 48, kParallels = 24;
  const auto first = static_cast<Index>(positions->size());
  for (Index i = 0; i <= kParallels; ++i) {
    const float polar = std::numbers::pi_v<float> * static_cast<float>(i) / kParallels;
    for (Index k = 0; k <= kMeridians; ++k) {
      const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kMeridians;
      const Vec3f outward(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar));
      positions->push_back(cavity.centre + cavity.radius * outward);
      normals->push_back(-outward);
    }
  }
  for (Index i = 0; i < kParallels; ++i) {
    for (Index k = 0; k < kMeridians; ++k) {
      const Index a = first + i * (kMeridians + 1) + k, b = a + kMeridians + 1;
      triangles->push_back({a, b + 1, b});
      triangles->push_back({a, a + 1, b + 1});
    }
  }
}

/// Place of a pattern on a surface around the cavity's middle: a stereographic projection, which changes the pattern's
/// size but not its shape. Its one bad place lies behind the scope.
Vec2f PlaceAround(const Vec3f& from_middle, const Laparoscope& scope) {
  const Vec3f eye = scope.view.block<3, 3>(0, 0) * from_middle;
  const float distance = eye.norm();
  return 2 * distance * eye.head<2>() / std::max(0.05f * distance, distance - eye.z());
}

/// … and on any other one: an oblique projection, so that no anatomical plane is seen edge on.
Vec2f PlaceAcross(const Vec3f& p) { return {p.x() + 0.41f * p.z(), p.y() - 0.57f * p.z()}; }

Float4 DecorationColour(const BackgroundAnatomy::Vertex& vertex) {
  const float light = 1 + 0.08f * vertex.shade;
  if (vertex.fat > 0) return {0.86f * light, 0.50f * light, 0.19f * light, 1};
  return {0.82f * light, (0.25f + 0.03f * vertex.shade) * light, (0.18f + 0.02f * vertex.shade) * light, 0.05f};
}

/// Whether a surface lies around the middle like a wall: it faces it nearly everywhere.
bool LiesAround(std::span<const Vec3f> positions, std::span<const Vec3f> normals, const Vec3f& middle) {
  float facing = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) facing += normals[k].dot((middle - positions[k]).normalized());
  return facing > 0.75f * static_cast<float>(positions.size());
}

}  // namespace

std::array<float, 4> SurroundingColour(SurfaceRole role) {
  switch (role) {
    case SurfaceRole::kAbdominalWall:
      return {0.66f, 0.20f, 0.15f, 0.25f};
    case SurfaceRole::kRetroperitoneum:
      return {0.62f, 0.15f, 0.11f, 0.55f};
    case SurfaceRole::kPelvis:
      return {0.50f, 0.09f, 0.07f, 0.3f};
    case SurfaceRole::kBladder:
      return {0.70f, 0.33f, 0.25f, 0.1f};
    case SurfaceRole::kOther:
      break;
  }
  return {0.5f, 0.2f, 0.16f, 0.3f};
}

Surroundings::Surroundings(const SceneView& scene, const Laparoscope& scope, const Look& look) {
  AddMask(scope);
  const BackgroundAnatomy anatomy(scene, look.patterns);
  AddSurfaces(scene, scope, anatomy, "surroundings", false);
  if (scene.breathing.amplitude_m > 0) {
    AddSurfaces(scene, scope, anatomy, "breathing", true);
  }
}

void Surroundings::AddMask(const Laparoscope& scope) {
  Mesh mask("mask", false);
  mask.state()->setAttributeAndModes(MakeProgram("mask.vert", "mask.frag"));
  DrawIn(Order::kMask, mask.state());
  constexpr Index kRimSides = 128;
  std::vector<Vec3f> positions;
  std::vector<Triangle> triangles;
  for (Index k = 0; k < kRimSides; ++k) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kRimSides;
    for (const float radius : {1.0f, 4 * scope.picture_centre.maxCoeff() / scope.circle_radius}) {
      positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0.0f);
    }
    const Index a = 2 * k, b = 2 * ((k + 1) % kRimSides);
    triangles.push_back({a, a + 1, b + 1});
    triangles.push_back({a, b + 1, b});
  }
  mask.SetPositions(positions);
  mask.SetTriangles(triangles);
  fixed_->addDrawable(mask.geometry());
}

/// Adds the breathing surfaces, or all other fixed surfaces, the cavity and the decoration.
void Surroundings::AddSurfaces(const SceneView& scene, const Laparoscope& scope, const BackgroundAnatomy& anatomy,
                               const char* name, bool breathing) {
  constexpr float kWet = 0.7f, kMatt = 0.02f;
  std::vector<Vec3f> positions, normals;
  std::vector<Float4> colours, coordinates;
  std::vector<Triangle> triangles;
  const auto add = [&](std::size_t first, Float4 colour, float wet) {
    const std::span<const Vec3f> of_it(positions.data() + first, positions.size() - first);
    const Vec3f& middle = anatomy.cavity().centre;
    const bool around = LiesAround(of_it, std::span(normals).subspan(first), middle);
    for (std::size_t k = first; k < positions.size(); ++k) {
      const Vec3f& p = positions[k];
      const Vec2f place = around ? 0.5f * PlaceAround(p - middle, scope) : PlaceAcross(p);
      coordinates.push_back({place.x(), place.y(), wet, anatomy.Openness(p, normals[k])});
      colours.push_back(colour);
    }
  };
  if (!breathing) {
    // Near before far, so that what is hidden is not shaded: the decoration hides walls, its last parts the first ones.
    for (const BackgroundAnatomy::Vertex& vertex : anatomy.vertices()) {
      positions.push_back(vertex.p_W);
      normals.push_back(vertex.normal);
      colours.push_back(DecorationColour(vertex));
      coordinates.push_back({vertex.place.x(), vertex.place.y(), vertex.fat > 0 ? 0.35f : 0.6f, vertex.openness});
    }
    triangles.assign(anatomy.triangles().rbegin(), anatomy.triangles().rend());
  }
  for (const StaticSurface& surface : scene.static_surfaces) {
    if ((scene.breathing.amplitude_m > 0 && Breathes(surface.role)) != breathing) {
      continue;
    }
    const auto first = static_cast<Index>(positions.size());
    const auto vertices = scene.static_vertices.subspan(surface.first_vertex, surface.vertex_count);
    positions.insert(positions.end(), vertices.begin(), vertices.end());
    const std::size_t first_triangle = triangles.size();
    for (Index k = 0; k < surface.triangle_count; ++k) {
      Triangle t = scene.static_triangles[surface.first_triangle + k];
      for (Index& corner : t) {
        corner = corner - surface.first_vertex + first;
      }
      triangles.push_back(t);
    }
    normals.resize(positions.size());
    std::vector<Triangle> own(triangles.begin() + static_cast<std::ptrdiff_t>(first_triangle), triangles.end());
    for (Triangle& t : own) {
      for (Index& corner : t) corner -= first;
    }
    ComputeNormals(vertices, own, std::span(normals).subspan(first));
    add(first, SurroundingColour(surface.role), kWet);
  }
  if (!breathing) {
    const std::size_t first = positions.size();
    AppendCavity(anatomy.cavity(), &positions, &normals, &triangles);
    add(first, {0.60f, 0.11f, 0.085f, 0.4f}, kMatt);
  }
  Mesh mesh(name, false);
  mesh.state()->setAttributeAndModes(MakeProgram("surface.vert", "surroundings.frag"));
  DrawIn(Order::kSurroundings, mesh.state());
  if (breathing) {
    mesh.state()->addUniform(shift_);
  }
  // Walls are culled from behind, because the scope may be outside of them.
  mesh.state()->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
  mesh.SetPositions(positions);
  mesh.SetNormals(normals);
  mesh.SetColours(colours);
  mesh.SetCoordinates(coordinates);
  mesh.SetTriangles(triangles);
  (breathing ? breathing_ : fixed_)->addDrawable(mesh.geometry());
}

}  // namespace fulcrum::render
