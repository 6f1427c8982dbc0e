// Appearance of tools: meshes named in the description, in the compiled scene.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"
#include "tests/unit/scene/mesh_writers.h"

namespace fulcrum::scene {
namespace {

class ToolMeshTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("fulcrum_tool_mesh_test_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    // A body and two jaws of one triangle each; the jaws lie on either side of the plane y = 0.
    WriteStl("body.stl", {{0, 0, -300}, {2, 0, -300}, {0, 2, 0}});
    WriteStl("left.stl", {{0, -1, 0}, {1, -1, 0}, {0, -2, 18}});
    WriteStl("right.stl", {{0, 1, 0}, {1, 1, 0}, {0, 2, 18}});
    std::ifstream in(std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes/small.yaml");
    small_.assign(std::istreambuf_iterator<char>(in), {});
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void WriteStl(const char* name, const std::vector<Vec3d>& corners) const {
    std::ofstream(folder_ / name, std::ios::binary) << writers::Stl({corners, {{0, 1, 2}}}, true);
  }

  /// The small scene whose grasper and hook have these meshes ("" none).
  [[nodiscard]] std::filesystem::path Describe(const std::string& grasper, const std::string& hook) const {
    std::string text = small_;
    const auto add = [&](const std::string& tool, const std::string& meshes) {
      const std::size_t at = text.find('}', text.find(tool));
      if (!meshes.empty()) {
        text.insert(at, ", meshes: {" + meshes + "}");
      }
    };
    add("tool0: {", grasper);
    add("tool1: {", hook);
    std::ofstream(folder_ / "x.yaml") << text;
    return folder_ / "x.yaml";
  }
  [[nodiscard]] std::string Refusal(const std::string& grasper, const std::string& hook) const {
    try {
      (void)CompileScene(Describe(grasper, hook), {}, {});
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  static constexpr const char* kGrasper = "body: body.stl, jaws: [left.stl, right.stl], turn_deg: 90";
  std::filesystem::path folder_;
  std::string small_;
};

TEST_F(ToolMeshTest, LieInFrameTWithTheJawsAtTheHinge) {
  const CompiledScene scene = CompileScene(Describe(kGrasper, "body: body.stl, origin_mm: [0, 0, 5]"), {}, {});
  const SceneView view = scene.data.View();
  ASSERT_EQ(view.tool_meshes.size(), 4u);
  const float hinge_z = -view.tools[0].tip_length_m;
  const auto corner = [&](std::size_t mesh, std::size_t k) {
    return view.tool_vertices[view.tool_triangles[view.tool_meshes[mesh].first_triangle][k]];
  };
  EXPECT_EQ(view.tool_meshes[1].part, ToolPart::kJawPlus);
  EXPECT_TRUE(corner(1, 0).isApprox(Vec3f(0.001f, 0, hinge_z), 1e-5f)) << "turned to +x";
  EXPECT_TRUE(corner(2, 2).isApprox(Vec3f(-0.002f, 0, hinge_z + 0.018f), 1e-5f));
  EXPECT_EQ(view.tool_meshes[3].tool, 1u);
  EXPECT_TRUE(corner(3, 0).isApprox(Vec3f(0, 0, -0.295f), 1e-5f));
}

TEST_F(ToolMeshTest, AreKeptInTheFileAndChangeItsHash) {
  const CompiledScene scene = CompileScene(Describe(kGrasper, ""), {}, {});
  EXPECT_NE(scene.data.fixed.hash, BuildProcedural(Small()).fixed.hash);
  const std::uint64_t hash = WriteSceneFile(scene.data, scene.effective_yaml, folder_ / "x.scene");
  EXPECT_EQ(hash, scene.data.fixed.hash);
  const SceneFile file(folder_ / "x.scene");
  EXPECT_EQ(file.view().tool_meshes.size(), 3u);
  EXPECT_EQ(file.view().tool_vertices.size(), 9u);
  std::ofstream(folder_ / "again.yaml") << file.source_yaml();
  EXPECT_EQ(CompileScene(folder_ / "again.yaml", {}, {}).data.fixed.hash, hash);
}

TEST_F(ToolMeshTest, FaultsAreRefusedWithKeyOrFile) {
  const auto expect = [](const std::string& message, std::initializer_list<const char*> parts) {
    for (const char* part : parts) {
      EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
    }
  };
  expect(Refusal("body: none.stl, jaws: [left.stl, right.stl]", ""),
         {"tools.tool0.meshes.body", "'none.stl' is not at", "--data DIR"});
  expect(Refusal("jaws: [left.stl, right.stl]", ""), {"tools.tool0.meshes", "body"});
  expect(Refusal("body: body.stl", ""), {"tools.tool0.meshes", "jaws"});
  expect(Refusal("body: body.stl, jaws: [left.stl]", ""), {"tools.tool0.meshes.jaws"});
  expect(Refusal("", kGrasper), {"tools.tool1.meshes.jaws", "a hook has none"});
  expect(Refusal("", "body: body.stl, turn_deg: 400"), {"turn_deg", "-180 to 180"});
  expect(Refusal("", "body: body.stl, unit: m"), {"body.stl", "at most 1 m", "unit"});
  std::ofstream(folder_ / "broken.stl") << "solid x\nfacet";
  expect(Refusal("", "body: broken.stl"), {"broken.stl"});
}

}  // namespace
}  // namespace fulcrum::scene
