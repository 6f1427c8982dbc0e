#include "render_node/geometry/sheet_rim.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "services/scene/builder/build.h"

namespace fulcrum::render {
namespace {

TEST(SheetRim, FallsFromTheSidesThatGoOn) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  const std::vector<float> rim = SheetRim(scene);
  const std::uint32_t rows = scene.membrane.rows, cols = scene.membrane.cols;
  ASSERT_EQ(rim.size(), scene.membrane.node_count());
  EXPECT_FLOAT_EQ(rim[rows / 2 * cols], 1);
  EXPECT_FLOAT_EQ(rim[rows / 2 * cols + cols - 1], 1);
  EXPECT_FLOAT_EQ(rim[cols / 2], 1);
  EXPECT_FLOAT_EQ(rim[(rows - 1) * cols + cols / 2], 1);
  EXPECT_FLOAT_EQ(rim[rows / 2 * cols + cols / 2], 0) << "the middle stays translucent";
  EXPECT_GT(rim[rows / 2 * cols + 2], rim[rows / 2 * cols + 4]);
}

TEST(SheetRim, ASideWithoutRetroperitoneumEndsAsItIs) {
  scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  for (StaticSurface& surface : data.static_surfaces) {
    if (surface.role != SurfaceRole::kRetroperitoneum) continue;
    // As of an imported cavity: far away on all sides.
    for (Index k = 0; k < surface.vertex_count; ++k) data.static_vertices[surface.first_vertex + k] *= 3;
  }
  const auto ends = [](const std::vector<float>& rim) {
    return std::ranges::all_of(rim, [](float value) { return value == 0; });
  };
  EXPECT_TRUE(ends(SheetRim(data.View())));
  data.static_surfaces.clear();
  EXPECT_TRUE(ends(SheetRim(data.View())));
}

TEST(SheetRim, SidesThatLieOnTheOrganAreFusedWithIt) {
  scene::SceneSettings settings = scene::BuiltIn();
  scene::SceneData data = scene::BuildProcedural(settings);
  data.static_surfaces.clear();
  const SceneView before = data.View();
  EXPECT_TRUE(std::ranges::all_of(SheetRim(before), [](float value) { return value == 0; }));
  // One side brought down to the organ.
  const std::uint32_t rows = before.membrane.rows, cols = before.membrane.cols;
  for (std::uint32_t row = 0; row < rows; ++row) {
    data.rest_position[before.membrane.first + row * cols] = data.rest_position[before.tube_surface[row][0]];
  }
  const std::vector<float> rim = SheetRim(data.View());
  EXPECT_FLOAT_EQ(rim[rows / 2 * cols], -1);
  EXPECT_FLOAT_EQ(rim[rows / 2 * cols + cols - 1], 0);
}

}  // namespace
}  // namespace fulcrum::render
