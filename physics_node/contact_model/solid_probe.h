// Contact of the electrode with the surface of a solid: footprint of the hook's bare metal in the solids' charts.
#pragma once

#include <array>
#include <vector>

#include "physics_node/collision/tool_collision.h"
#include "physics_node/contact_model/gap_box.h"
#include "services/base/core/solid_charts.h"

namespace fulcrum::physics {

class SolidProbe {
 public:
  SolidProbe(const TissueScene& scene, const ParticleStore* particles);

  /// Contact of hook `tool` after a step in which it touches no membrane: on_solid, place, rate and footprint, else as
  /// it is. Only one chart is touched at a time, that of the nearest triangle.
  void Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision, float step_s,
              CauteryContact* contact);
  /// The hook touches a membrane.
  void Leave() { was_touching_ = false; }

 private:
  struct Nearest {
    Index triangle = kNoIndex;
    std::array<float, 3> barycentric{};
    float distance_sq = 0;
  };
  /// Fills near_ and finds the nearest triangle.
  [[nodiscard]] Nearest FindNear(std::uint32_t tool, const ToolCollision& collision);
  [[nodiscard]] SurfaceTriangle At(Index triangle) const;

  TissueScene scene_;
  const ParticleStore* particles_;
  SolidCharts charts_;
  float cushion_m_;  ///< Distance at which collision holds tissue from the metal, and kContactSlack.
  std::vector<Index> near_;
  GapBox gaps_;
  bool was_touching_ = false;
  Index last_chart_ = kNoIndex;
  Vec2f last_material_ = Vec2f::Zero(), rate_ = Vec2f::Zero();
};

}  // namespace fulcrum::physics
