#include "render_node/scene_graph/surroundings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <osg/CullFace>
#include <vector>

#include "render_node/geometry/surface.h"
#include "render_node/scene_graph/mesh.h"
#include "render_node/scene_graph/order.h"
#include "render_node/scene_graph/program.h"
#include "services/base/core/breathing.h"

namespace fulcrum::render {
namespace {

using Float4 = std::array<float, 4>;

/// Adds a sphere of tissue around everything, seen from inside, as background where the scene's surfaces end.
void AppendCavity(const SceneView& scene, std::vector<Vec3f>* positions, std::vector<Vec3f>* normals,
                  std::vector<Triangle>* triangles) {
  constexpr Index kMeridians = 48, kParallels = 24;
  const Vec3f centre = scene.render.scope_target_W;
  float radius = (scene.render.scope_tip_W - centre).norm();
  for (const auto& points : {scene.rest_position, scene.static_vertices}) {
    for (const Vec3f& p : points) {
      radius = std::max(radius, (p - centre).norm());
    }
  }
  radius += scene.breathing.amplitude_m;
  radius *= 1.02f;  // Slightly larger, so that its facets also lie outside.
  const auto first = static_cast<Index>(positions->size());
  for (Index i = 0; i <= kParallels; ++i) {
    const float polar = std::numbers::pi_v<float> * static_cast<float>(i) / kParallels;
    for (Index k = 0; k <= kMeridians; ++k) {
      const float turn = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kMeridians;
      const Vec3f outward(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar));
      positions->push_back(centre + radius * outward);
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

Surroundings::Surroundings(const SceneView& scene, const Laparoscope& scope) {
  AddMask(scope);
  AddSurfaces(scene, "surroundings", false);
  if (scene.breathing.amplitude_m > 0) {
    AddSurfaces(scene, "breathing", true);
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

/// Adds the breathing surfaces, or all other fixed surfaces and the cavity.
void Surroundings::AddSurfaces(const SceneView& scene, const char* name, bool breathing) {
  std::vector<Vec3f> positions, normals;
  std::vector<Float4> colours, coordinates;
  std::vector<Triangle> triangles;
  for (const StaticSurface& surface : scene.static_surfaces) {
    if ((scene.breathing.amplitude_m > 0 && Breathes(surface.role)) != breathing) {
      continue;
    }
    const auto first = static_cast<Index>(positions.size());
    for (Index k = 0; k < surface.vertex_count; ++k) {
      const Vec3f& p = scene.static_vertices[surface.first_vertex + k];
      positions.push_back(p);
      coordinates.push_back({p.x(), p.y(), p.z(), 0});
      colours.push_back(SurroundingColour(surface.role));
    }
    for (Index k = 0; k < surface.triangle_count; ++k) {
      Triangle t = scene.static_triangles[surface.first_triangle + k];
      for (Index& corner : t) {
        corner = corner - surface.first_vertex + first;
      }
      triangles.push_back(t);
    }
  }
  normals.resize(positions.size());
  ComputeNormals(positions, triangles, normals);
  if (!breathing) {
    AppendCavity(scene, &positions, &normals, &triangles);
  }
  for (std::size_t k = coordinates.size(); k < positions.size(); ++k) {
    coordinates.push_back({positions[k].x(), positions[k].y(), positions[k].z(), 1});
    colours.push_back({0.60f, 0.11f, 0.085f, 0.4f});
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
