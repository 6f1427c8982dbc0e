// The text that a compiled scene carries, what replaces values of a base, and changes from a command line.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "services/base/core/error.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::scene {
namespace {

const std::filesystem::path kScenes = std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes";

class Effective : public testing::Test {
 protected:
  Effective() { std::filesystem::create_directories(folder_); }
  ~Effective() override { std::filesystem::remove_all(folder_); }
  SceneDescription Read(const std::string& text, const std::vector<std::string>& changes = {}) const {
    std::ofstream(folder_ / "x.yaml") << text;
    return ReadSceneYaml(folder_ / "x.yaml", {}, changes);
  }
  std::string Refusal(const std::string& text, const std::vector<std::string>& changes = {}) const {
    try {
      (void)Read(text, changes);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }
  void Touch(const std::string& name) const { std::ofstream(folder_ / name) << "solid"; }
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("effective_yaml_" + std::to_string(getpid()));
};

TEST_F(Effective, OfEveryShippedSceneReadsBackToItself) {
  int read = 0;
  for (const SceneSummary& summary : ListScenes(kScenes)) {
    std::string effective;
    try {
      effective = ReadSceneYaml(summary.file, {}).effective_yaml;
    } catch (const InputError&) {  // The OpenHELP meshes are not beside the project.
      continue;
    }
    ++read;
    EXPECT_EQ(ParseSceneYaml(effective, summary.name, {}, MeshFiles::kNotRead).effective_yaml, effective)
        << summary.name;
  }
  EXPECT_GE(read, 19);
}

constexpr const char* kOrgan = "name: x\norgan: {import: {organ: my liver.obj, patch: {}}}\n";

TEST_F(Effective, OfAnImportReadsBackToItself) {
  Touch("my liver.obj");
  for (const std::string size :
       {"", ", tet_edge_mm: 5", ", target_tets: 3000", ", target_tets: 3000, tet_edge_mm: 0"}) {
    std::string text = kOrgan;
    text.insert(text.find(", patch"), size);
    const SceneDescription read = Read(text);
    const SceneDescription again = ParseSceneYaml(read.effective_yaml, "again.yaml", folder_);
    EXPECT_EQ(again.effective_yaml, read.effective_yaml) << size;
    EXPECT_EQ(again.settings.import->tet_edge_m, read.settings.import->tet_edge_m) << size;
    EXPECT_EQ(again.settings.import->target_tets, read.settings.import->target_tets) << size;
  }
  std::string both = kOrgan;
  both.insert(both.find(", patch"), ", tet_edge_mm: 5, target_tets: 3000");
  EXPECT_NE(Refusal(both).find("give one of them"), std::string::npos);
}

TEST_F(Effective, NeedsNoMeshFilesWhereTheyAreNotRead) {
  const SceneDescription read =
      ParseSceneYaml(std::string(kOrgan) +
                         "physics: {mode: accurate, grip_force_N: 3}\n"
                         "bodies: [{name: o, material: liver, mesh: other.stl}]\n"
                         "fixed: [{name: f, mesh: third.stl}]\n"
                         "tools: {tool0: {kind: hook, trocar_mm: [9, 9, 9], meshes: {body: hook.stl}}}\n",
                     "x.yaml", {}, MeshFiles::kNotRead);
  EXPECT_EQ(read.settings.physics.grip_force_N, 3.0f);
  EXPECT_THROW((void)ParseSceneYaml(kOrgan, "x.yaml", {}), InputError);
}

// ------------------------------------------------------------------------------------------------------ changes

TEST_F(Effective, ThePowerIsReplacedInTheScriptOfABaseToo) {
  for (const char* scene : {"dissection.yaml", "suction.yaml", "small.yaml"}) {
    const SceneDescription changed = ReadSceneYaml(kScenes / scene, {}, {"script.power_W=20"});
    int uses = 0;
    for (const ScriptKeySettings& key : changed.settings.script) {
      if (key.pedals == kPedalNone) continue;
      EXPECT_EQ(key.power_W, 20) << scene << " at " << key.time_s;
      ++uses;
    }
    EXPECT_GT(uses, 0) << scene;
    EXPECT_NE(changed.effective_yaml.find("power_W: 20"), std::string::npos) << scene;
    EXPECT_EQ(changed.effective_yaml.find("power_W: 35"), std::string::npos) << scene;
  }
}

TEST_F(Effective, OneToolsOwnScriptDoesNotKeepTheOtherOnesPower) {
  const std::string text =
      "name: x\nbase: small\nscript:\n  tool0: [{time_s: 1, sheet: [0.5, 0.5], height_mm: 20, power_W: 30 W}]\n";
  for (const ScriptKeySettings& key : Read(text, {"script.power_W=12.5", "physics.friction=0.2"}).settings.script) {
    EXPECT_TRUE(key.power_W == 0 || key.power_W == 12.5) << key.time_s;
  }
}

TEST_F(Effective, APowerThatNothingUsesOrThatIsNoneIsRefused) {
  const std::string text = "name: x\nbase: small\nscript: {tool1: []}\n";
  EXPECT_EQ(Refusal(text), "");
  EXPECT_NE(Refusal(text, {"script.power_W=20"}).find("no use of the generator"), std::string::npos);
  EXPECT_NE(Refusal("name: x\nbase: small\n", {"script.power_W=900"}).find("0 to 300"), std::string::npos);
}

// ------------------------------------------------------------------------------------------------------- bases

TEST_F(Effective, AToolOfABaseCanBeTakenAway) {
  const SceneDescription read = Read("name: x\nbase: small\ntools: {tool1: {kind: none}}\nscript: {tool1: []}\n");
  EXPECT_EQ(read.settings.tools[1].kind, ToolKind::kNone);
  EXPECT_EQ(ParseSceneYaml(read.effective_yaml, "again.yaml", {}).effective_yaml, read.effective_yaml);
  EXPECT_NE(Refusal("name: x\nbase: small\ntools: {tool1: {kind: none, trocar_mm: [1, 2, 3]}}\nscript: {tool1: []}\n")
                .find("x.yaml:3: tools.tool1.trocar_mm: unknown key"),
            std::string::npos)
      << "what this file says of no tool";
}

TEST_F(Effective, AToolOfABaseCanBecomeOneOfAnotherKind) {
  const SceneDescription read = Read("name: x\nbase: assisted\ntools: {tool2: {kind: scissors}}\n");
  EXPECT_EQ(read.settings.tools[2].kind, ToolKind::kScissors);
  EXPECT_EQ(read.settings.tools[2].p_WP, ReadSceneYaml(kScenes / "assisted.yaml", {}).settings.tools[2].p_WP);
  EXPECT_NE(Refusal("name: x\nbase: assisted\ntools: {tool2: {kind: scissors, traction_N: 2}}\n").find("x.yaml:3: "),
            std::string::npos);
}

TEST_F(Effective, TheMeshesOfABasesToolAreThoseOfItsKind) {
  for (const char* name : {"grasper.stl", "jaw.stl", "hook.stl"}) Touch(name);
  std::ofstream(folder_ / "low.yaml")
      << "name: low\nbase: small\ntools: {tool0: {meshes: {body: grasper.stl, jaws: [jaw.stl, jaw.stl]}}}\n";
  const auto body = [&](const std::string& tool) {
    // The hook of the base is another tool's: a scene has one.
    const SceneDescription scene =
        Read("name: x\nbase: low.yaml\ntools: {tool0: " + tool + ", tool1: {kind: grasper}}\n");
    return scene.settings.tool_meshes[0].body_file.filename();
  };
  EXPECT_EQ(body("{shaft_radius_mm: 3}"), "grasper.stl");
  EXPECT_EQ(body("{kind: grasper}"), "grasper.stl") << "no other kind";
  EXPECT_EQ(body("{kind: hook}"), "");
  EXPECT_EQ(body("{kind: hook, meshes: {body: hook.stl}}"), "hook.stl") << "without the jaws of the grasper";
}

TEST_F(Effective, AnEdgeReplacesTheCountOfABaseAndTheOtherWayRound) {
  Touch("my liver.obj");
  std::ofstream(folder_ / "count.yaml")
      << "name: count\norgan: {import: {organ: my liver.obj, patch: {}, target_tets: 3000}}\n";
  const SceneDescription edge = Read("name: x\nbase: count.yaml\norgan: {import: {tet_edge_mm: 5}}\n");
  EXPECT_NEAR(edge.settings.import->tet_edge_m, 0.005, 1e-12);
  std::ofstream(folder_ / "edge.yaml")
      << "name: edge\norgan: {import: {organ: my liver.obj, patch: {}, tet_edge_mm: 5}}\n";
  const SceneDescription count = Read("name: x\nbase: edge.yaml\norgan: {import: {target_tets: 3000}}\n");
  EXPECT_EQ(count.settings.import->target_tets, 3000);
  EXPECT_EQ(count.settings.import->tet_edge_m, 0);
}

}  // namespace
}  // namespace fulcrum::scene
