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
};

/// Variation `index` of a seed. The scope keeps its target within 4 mm and turns about it by up to 10 degrees, is up to
/// 10 % nearer or farther, rolls by up to 12 degrees and has a field of view up to 10 % narrower or wider; light has
/// 0.6 to 1.5 times its strength and another white; tissue another tint and another pattern. The same on each machine.
/// A scope that the session itself holds stays where it was.
[[nodiscard]] Variation VariationOf(const RenderParams& camera, std::uint32_t seed, std::uint32_t index);

/// A line of variations.jsonl.
[[nodiscard]] std::string VariationText(std::uint32_t index, const Variation& variation);

}  // namespace fulcrum::replay
