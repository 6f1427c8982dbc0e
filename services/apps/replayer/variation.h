// Another look of the same session for a data set: light, tissue and scope, by a seed.
#pragma once

#include <cstdint>
#include <string>

#include "render_node/geometry/look.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

struct Variation {
  render::Look look;
  RenderParams camera;
  bool scope_varies = true;
};

/// Variation `index` of a seed, the same on one machine. The scope's target moves by up to 4 mm along each axis; the
/// scope turns about it by up to 10 degrees sideways and 10 up or down, is up to 10 % nearer or farther, and rolls by
/// up to 12 degrees; its field of view is up to 10 % narrower or wider, within what a scene may have. Light has 0.6
/// to 1.5 times its strength and another white; tissue another tint and another pattern. A scope that the session
/// itself holds keeps its pose: only light, tissue and field of view vary.
[[nodiscard]] Variation VariationOf(const SceneView& scene, std::uint32_t seed, std::uint32_t index);

/// A line of variations.jsonl.
[[nodiscard]] std::string VariationText(std::uint32_t seed, std::uint32_t index, const Variation& variation);

}  // namespace fulcrum::replay
