// Where the membrane ends in tissue: sides of the sheet that the retroperitoneum continues, or that lie on the organ.
// Pure.
#pragma once

#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::render {

/// For each node of the membrane's grid: 1 on a side that continues, falling to 0 at 21 mm from it, or at a third of
/// the sheet if that is less. A side continues if the retroperitoneum is within 3 mm of most of it. Where none does,
/// sides most of which are within 3 mm of the organ are fused with it: their nodes fall in the same way from -1.
[[nodiscard]] std::vector<float> SheetRim(const SceneView& scene);

}  // namespace fulcrum::render
