// Where the electrode touches the membrane, and whether there is tissue behind it.
#pragma once

#include <vector>

#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {

class CauteryProbe {
 public:
  CauteryProbe(const SceneView& scene, const TissueModel* model, const ParticleStore* particles);

  /// Contact of hook `tool` after a step: place, rate, size, tented. Mode, power and stamps are the caller's.
  ///
  /// The bare metal is the foot and the end of the neck. The current leaves it at one spot and the cut is the path of
  /// that spot: where it first touched, then wherever along the metal the membrane ahead of it touches. Membrane that
  /// touches elsewhere, such as the sides of the slit, counts little or not at all. The place is the mean of the
  /// material coordinates of the points that count, so that it moves smoothly from triangle to triangle.
  [[nodiscard]] CauteryContact Update(std::uint32_t tool, const ToolPose& last_pose, const ToolPose& pose,
                                      const ToolCollision& collision);

 private:
  /// A point of the membrane that touches the metal.
  struct Touch {
    const ContactPair* pair;
    float along;      ///< On the metal from the heel: positive on the foot, negative up the neck [m].
    float closeness;  ///< How much nearer than the reach of the current [m].
    float metal;      ///< How much nearer than where the metal itself touches; negative: an arc at most [m].
    Vec3f place;
  };
  /// Nothing has touched for a while.
  [[nodiscard]] bool IsFresh() const;
  void FindTouches(std::uint32_t tool, const ToolCollision& collision);
  void FollowSpot(const ToolPose& pose, const ToolPose& last_pose, const ToolDescription& tool);
  /// 1 at the aim, 0 out of the spot's reach.
  [[nodiscard]] float Nearness(const Touch& touch) const;
  [[nodiscard]] float Weight(const Touch& touch) const;
  [[nodiscard]] Vec2f MaterialOf(const Touch& touch) const;
  /// Half of the line along which the foot itself touches near the spot, in material coordinates: its direction by
  /// least squares of the touching points over their places on the metal, as long as an even line of their spread.
  [[nodiscard]] Vec2f HalfLine() const;
  [[nodiscard]] bool Tented(Index triangle, const std::array<float, 3>& barycentric) const;

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  float spacing_ = 0;  ///< Mean length of the membrane's edges [m].
  bool was_touching_ = false;
  std::vector<Touch> touches_;
  float spot_ = 0;                ///< Along the metal, as in Touch [m].
  Vec3f aim_ = Vec3f::Zero();     ///< A little ahead of the spot.
  Vec3f motion_ = Vec3f::Zero();  ///< Of the tool, low-passed [m/s].
  int steps_away_ = 1000;         ///< Since anything touched.
  Vec2f last_material_ = Vec2f::Zero(), rate_ = Vec2f::Zero();
  Vec2f half_ = Vec2f::Zero();  ///< HalfLine, low-passed.
};

/// Barycentric coordinates of `p` in triangle abc of the plane, clamped into it.
[[nodiscard]] std::array<float, 3> BarycentricInPlane(const Vec2f& p, const Vec2f& a, const Vec2f& b, const Vec2f& c);

}  // namespace fulcrum::physics
