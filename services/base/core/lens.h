// How much the lens of a held scope is soiled: steam of a cut fogs it, tissue that it touches smears it, and drawn back
// to its trocar it is wiped. One model for the picture and for the assessment. The rates are assumed.
#pragma once

#include <cstddef>
#include <optional>

#include "services/base/core/scene_view.h"

namespace fulcrum {

class Lens {
 public:
  /// Without a scope in the scene the lens stays clear. The arrays of `scene` must outlive it.
  explicit Lens(const SceneView& scene);

  /// Takes the tools at a session time. Tissue counts at its rest, so that ToolState alone decides.
  /// @param delivers current flows into tissue at the hook.
  void Step(double time_s, const ToolState& tools, bool delivers);

  /// 0 clear … 1 nothing to be seen.
  [[nodiscard]] float soil() const { return soil_; }

 private:
  [[nodiscard]] bool Touches(const Vec3f& lens_W) const;

  SceneView scene_;
  std::optional<std::size_t> scope_, hook_;  ///< Tools.
  double last_s_ = -1;
  float soil_ = 0;
};

}  // namespace fulcrum
