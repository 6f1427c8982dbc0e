#include <gtest/gtest.h>

#include <cstdio>

#include "services/scene/build.h"

namespace fulcrum::scene {
TEST(Procedural, Counts) {
  for (const auto& settings : {BuiltIn(), Small()}) {
    const SceneData scene = BuildProcedural(settings);
    const SceneView v = scene.View();
    std::size_t springs = 0;
    for (float l : v.membrane_rest_length) springs += l > 0;
    printf("%s vertices %zu tets %zu edges %zu springs %zu bending %zu bindings %zu stretch %zu surface %zu/%zu\n",
           v.name, v.rest_position.size(), v.tets.size(), v.tube_edges.size(), springs, v.bending.size(),
           v.bindings.size(), v.tube_edges.size() + springs, v.surface_vertices.size(), v.surface_triangles.size());
    printf("colours %zu %zu %zu %zu\n", v.tet_colours.size() - 1, v.tube_edge_colours.size() - 1,
           v.bending_colours.size() - 1, v.binding_colours.size() - 1);
    float lo = 1, hi = 0;
    for (auto& b : v.bindings) {
      lo = std::min(lo, b.rest_length);
      hi = std::max(hi, b.rest_length);
    }
    printf("binding length %g..%g mm\n", 1e3 * lo, 1e3 * hi);
    Vec2f m = Vec2f::Zero();
    for (auto& x : v.membrane_material) m = m.cwiseMax(x);
    printf("material max %g %g mm\n", 1e3 * m.x(), 1e3 * m.y());
    for (auto& k : v.script)
      printf("t %5.1f tool %u p %6.1f %6.1f %6.1f jaw %.2f\n", k.time_s, k.tool, 1e3 * k.p_W.x(), 1e3 * k.p_W.y(),
             1e3 * k.p_W.z(), k.jaw_rad);
  }
}
}  // namespace fulcrum::scene
