// Where the electrode touches the membrane, and whether there is tissue behind it.
#pragma once

#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {

class CauteryProbe {
 public:
  CauteryProbe(const SceneView& scene, const TissueModel* model, const ParticleStore* particles)
      : scene_(scene), model_(model), particles_(particles) {}

  /// Contact of hook `tool` after a step: place, rate, size, tented. Mode, power and stamps are the caller's.
  ///
  /// The place is the mean of the material coordinates of all touching points of the foot, weighted towards its free
  /// end (the one that an L-hook presses and lifts with), so that it moves smoothly from triangle to triangle.
  [[nodiscard]] CauteryContact Update(std::uint32_t tool, const ToolCollision& collision);

 private:
  [[nodiscard]] bool Tented(Index triangle, const std::array<float, 3>& barycentric) const;

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  bool was_touching_ = false;
  Vec2f last_material_ = Vec2f::Zero(), rate_ = Vec2f::Zero();
};

/// Barycentric coordinates of `p` in triangle abc of the plane, clamped into it.
[[nodiscard]] std::array<float, 3> BarycentricInPlane(const Vec2f& p, const Vec2f& a, const Vec2f& b, const Vec2f& c);

}  // namespace fulcrum::physics
