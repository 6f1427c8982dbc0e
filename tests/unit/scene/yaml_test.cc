// The YAML description: shipped scenes compile, presets and files agree, one refusal per rule.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>

#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"
#include "services/scene/format/validate.h"

namespace fulcrum::scene {
namespace {

const std::filesystem::path kScenes = std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes";

std::string TextOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// `text` with the first `from` replaced, which must exist.
std::string With(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string Refusal(const std::string& text) {
  try {
    (void)ParseSceneYaml(text, "x.yaml", {});
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(ShippedScenes, AreListedWithNameAndDescription) {
  std::set<std::string> names;
  for (const SceneSummary& scene : ListScenes(kScenes)) {
    EXPECT_EQ(scene.name, scene.file.stem().string());
    EXPECT_FALSE(scene.description.empty());
    names.insert(scene.name);
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"adhesions", "assisted",   "built-in",    "camera",   "clips",        "coagulate",
                                   "cut_line",  "dissection", "gallbladder", "hold",     "keep_clear",   "line",
                                   "openhelp",  "pedal",      "pelvis",      "regrasp",  "seal_and_cut", "small",
                                   "strokes",   "suction",    "traction",    "two_hands"}));
}

TEST(ShippedScenes, HaveOneRuleForTimesOfAScriptHoweverLongItIs) {
  for (const char* name : {"built-in", "pelvis"}) {
    for (const config::KeyRule& rule : SceneRules(kScenes / (std::string(name) + ".yaml"))) {
      if (!rule.path.ends_with("[].time_s")) continue;
      EXPECT_EQ(rule.valid, "0 to 86400 s") << name << " " << rule.path;
    }
  }
}

/// Each band is bound at both of its ends, over its whole width.
TEST(ShippedScenes, AdhesionsJoinTwoLoops) {
  const SceneData data = CompileScene(kScenes / "adhesions.yaml", {}, {}).data;
  const SceneView view = data.View();
  ASSERT_EQ(view.sheets.size(), 3u);
  for (const SheetPart& band : view.sheets) {
    std::set<Index> first, last;
    for (const Binding& b : view.bindings) {
      const Index row = (b.membrane - view.membrane.first) / view.membrane.cols;
      if (row < band.first_row || row >= band.first_row + band.rows) continue;
      (row < band.first_row + band.rows / 2 ? first : last)
          .insert((b.membrane - view.membrane.first) % view.membrane.cols);
    }
    EXPECT_GE(first.size(), band.cols - 2) << band.name;
    EXPECT_GE(last.size(), band.cols - 2) << band.name;
  }
}

TEST(ShippedScenes, SayTheSameAsThePresets) {
  EXPECT_EQ(CompileScene(kScenes / "built-in.yaml", {}, {}).data.fixed.hash, BuildProcedural(BuiltIn()).fixed.hash);
  EXPECT_EQ(CompileScene(kScenes / "small.yaml", {}, {}).data.fixed.hash, BuildProcedural(Small()).fixed.hash);
}

TEST(ShippedScenes, EffectiveYamlReadsBackToTheSameScene) {
  const CompiledScene scene = CompileScene(kScenes / "small.yaml", {}, {});
  const SceneDescription again = ParseSceneYaml(scene.effective_yaml, "effective.yaml", {});
  EXPECT_EQ(BuildProcedural(again.settings).fixed.hash, scene.data.fixed.hash);
  EXPECT_NE(scene.effective_yaml.find("shrink_max: 0.3"), std::string::npos)
      << "defaults are written, without rounding errors";
}

TEST(ShippedScenes, ExercisesCompileAndAreAssessed) {
  for (const SceneSummary& summary : ListScenes(kScenes)) {
    if (!summary.description.starts_with("Exercise: ")) continue;
    const std::string name = summary.name + ".yaml";
    const CompiledScene scene = CompileScene(kScenes / name, {}, {});
    const SceneView view = scene.data.View();
    EXPECT_EQ(view.assessment.on, 1u) << name;
    EXPECT_FALSE(view.script.empty()) << name;
    double task = 0;
    for (std::size_t i = 0; i < kMeasureCount; ++i) {
      task += kMeasures[i].role == MeasureRole::kTask ? static_cast<double>(view.assessment.points[i]) : 0;
    }
    EXPECT_GT(task, 0) << name << ": a session without any action gets no points";
  }
}

/// Compiles a scene that needs the OpenHELP meshes; what is missing, if they are not beside the project.
std::string CompileOpenHelp(const char* name, CompiledScene* scene) {
  try {
    *scene = CompileScene(kScenes / name, {}, {});
    return {};
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("give its folder with --data DIR"), std::string::npos) << text;
    EXPECT_NE(text.find("Rectum_Lumen.stl"), std::string::npos) << text;
    return "the OpenHELP meshes are not beside the project: " + text;
  }
}

TEST(ShippedScenes, OpenHelpGivesASoundSceneOrSaysWhatIsMissing) {
  CompiledScene scene;
  if (const std::string missing = CompileOpenHelp("openhelp.yaml", &scene); !missing.empty()) GTEST_SKIP() << missing;
  const SceneView view = scene.data.View();
  const auto fault = FindFault(view);
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  const SceneQuality q = Measure(view);
  EXPECT_GE(q.tets, 6000u);
  EXPECT_LE(q.tets, 10000u);
  EXPECT_LE(q.vertices, static_cast<std::size_t>(kMaxTissueVertices));
  EXPECT_NEAR(1e6 * q.organ_volume_m3, 205, 10) << "the volume enclosed by the surface";
  EXPECT_GT(q.least_dihedral_deg, 5);
  EXPECT_GT(q.least_binding_m, 0.0005);
  EXPECT_LT(q.rms_flat_error, 0.05);
  EXPECT_GT(q.bindings, 500u);
  EXPECT_GE(view.static_surfaces.size(), 3u);
  EXPECT_EQ(CompileScene(kScenes / "openhelp.yaml", {}, {}).data.fixed.hash, view.hash)
      << "meshing must be reproducible";
}

TEST(ShippedScenes, ThePelvisIsWhole) {
  CompiledScene scene;
  if (const std::string missing = CompileOpenHelp("pelvis.yaml", &scene); !missing.empty()) GTEST_SKIP() << missing;
  const SceneView view = scene.data.View();
  const auto fault = FindFault(view);
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  EXPECT_GE(Measure(view).vertices, 60000u);
  EXPECT_EQ(view.solids.size(), 9u) << "rectum, mesorectum, bladder, two loops, mesentery, artery, two ureters";
  EXPECT_EQ(
      std::ranges::count_if(view.tools, [](const ToolDescription& tool) { return tool.kind == ToolKind::kGrasper; }), 2)
      << "the surgeon's and the assistant's";
  EXPECT_GE(view.script_duration_s, 60.0f);
}

TEST(ShippedScenes, TheGallbladderIsAmongItsNeighbours) {
  const SceneData data = CompileScene(kScenes / "gallbladder.yaml", {}, {}).data;
  const SceneView view = data.View();
  const auto fault = FindFault(view);
  EXPECT_FALSE(fault) << fault->section << ": " << fault->reason;
  ASSERT_EQ(view.solids.size(), 6u);
  EXPECT_EQ(view.solids[0].look, SolidLook::kGallbladder);
  EXPECT_GT(view.attachments.size(), 40u) << "its bed, duct and artery";
  const SceneQuality q = Measure(view);
  EXPECT_GT(q.least_dihedral_deg, 5);
  EXPECT_EQ(q.inverted_tets, 0u);
  EXPECT_EQ(CompileScene(kScenes / "gallbladder.yaml", {}, {}).data.fixed.hash, view.hash);
}

// ---------------------------------------------------------------------------------------------------- refusals

struct Rule {
  const char* name;
  const char* from;  ///< In small.yaml …
  const char* to;    ///< … replaced by this …
  std::vector<const char*> says;
};

class SceneYamlRule : public testing::TestWithParam<Rule> {};

TEST_P(SceneYamlRule, IsRefusedWithFileKeyAndRange) {
  const std::string message = Refusal(With(TextOf(kScenes / "small.yaml"), GetParam().from, GetParam().to));
  EXPECT_EQ(message.substr(0, 7), "x.yaml:") << message;
  for (const char* part : GetParam().says) {
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
  }
}

const Rule kRules[] = {
    {"NameInAFolder", "name: small", "name: a/b", {"name", "'a/b'", "letters, digits"}},
    {"NameAboveTheFolder", "name: small", "name: ../../../x", {"name", "'../../../x'", "letters, digits"}},
    {"NameWithASpace", "name: small", "name: My liver", {"name", "'My liver'", "letters, digits"}},
    {"NameThatIsHidden", "name: small", "name: .small", {"name", "'.small'", "the first no '.'"}},
    {"UnknownKey", "  rows: 73", "  rowz: 73", {"membrane", "rowz"}},
    {"UnknownSection", "haptics:", "haptix:", {"haptix"}},
    {"WrongUnit", "wall_mm: 3", "wall_mm: 3 s", {"organ.procedural.wall_mm", "wrong unit", "0.5 to 20"}},
    {"UnitOnACount", "rings: 11", "rings: 11 mm", {"organ.procedural.rings"}},
    {"TooManyRings", "rings: 11", "rings: 100000", {"organ.procedural.rings", "3 to 1000"}},
    {"NegativeLength", "length_mm: 80", "length_mm: -80", {"organ.procedural.length_mm", "10 to 500"}},
    {"NotANumber", "gap_mm: 4.5", "gap_mm: .nan", {"membrane.gap_mm"}},
    {"WallThickerThanTube", "wall_mm: 3", "wall_mm: 12", {"outer_radius_mm", "wall_mm + fold_depth_mm"}},
    {"SplitName", "wall_mm: 3", "split: seven", {"organ.procedural.split", "five"}},
    {"SplitInFive",
     "segments: 10",
     "segments: 11\n    split: five",
     {"organ.procedural.split", "even number", "not 11"}},
    {"NoOrgan", "  procedural:\n", "  procedure:\n", {"organ", "procedural"}},
    {"BendingStride", "bending_row_stride: 4", "bending_row_stride: 5", {"bending_row_stride", "divide rows - 1 = 72"}},
    {"BendingColStride", "bending_col_stride: 4", "bending_col_stride: 5", {"bending_col_stride", "cols - 1 = 24"}},
    {"MassAreal", "density_kg_m2: 0.5", "density_kg_m2: 0.5 kg/m3", {"density_kg_m2", "wrong unit"}},
    {"MembraneModel",
     "mode: accurate",
     "mode: accurate\n  membrane_model: cloth",
     {"physics.membrane_model", "springs"}},
    {"Mode", "mode: accurate", "mode: fast", {"physics.mode", "paper"}},
    {"Stiffness", "k_volume: 0.8", "k_volume: 1.5", {"physics.k_volume", "0 to 1"}},
    {"Power", "power_W: 35", "power_W: 3500", {"power_W", "0 to 300"}},
    {"PedalWithoutPower", "power_W: 35", "power_W: 0", {"pedal", "power_W is 0"}},
    {"PedalName", "pedal: cut", "pedal: slice", {"pedal", "coag"}},
    {"SheetFraction", "sheet: [0.33, 0.5]", "sheet: [1.33, 0.5]", {"script.tool0", "sheet", "0 to 1"}},
    {"SheetCount", "sheet: [0.33, 0.5]", "sheet: [0.33]", {"script.tool0", "sheet"}},
    {"TimeBeyondTheEnd", "time_s: 5.4", "time_s: 7", {"time_s", "0 to 6"}},
    {"TimeBackwards", "time_s: 0.6", "time_s: 0.0", {"time_s", "follow one another"}},
    {"ToolKind", "kind: grasper", "kind: spoon", {"tools.tool0.kind", "scissors"}},
    {"TwoHooks", "tool0: {kind: grasper,", "tool0: {kind: hook,", {"tools.tool1", "second hook"}},
    {"NoTrocar", "kind: grasper, trocar_mm: [-75, -45, 110]", "kind: grasper", {"trocar_mm"}},
    {"ScriptWithoutTool", "tool1: {kind: hook, trocar_mm: [97, 0, 47]}", "tool1: {kind: none}", {"no tool1"}},
    {"StructureLists", "t: [0, 0.3, 0.6, 1]", "t: [0, 1]", {"structures", "as many entries as s"}},
    {"StructureKind", "kind: ureter", "kind: artery", {"structures", "nerve"}},
    {"Camera", "fov_deg: 60", "fov_deg: 400", {"render.fov_deg", "10 to 150"}},
    {"ScopeInItsTarget", "scope_tip_mm: [4, -55, 70]", "scope_tip_mm: [0, 4, 15]", {"at least 5 mm from scope_tip_mm"}},
    {"StereoLayout", "fov_deg: 60", "stereo: red_green", {"render.stereo", "side_by_side"}},
    {"Interocular", "fov_deg: 60", "interocular_mm: 65", {"render.interocular_mm", "1 to 20"}},
    {"ConvergenceTooFar", "fov_deg: 60", "convergence_mm: 800", {"render.convergence_mm", "0 to 500"}},
    {"ConvergenceTooNear", "fov_deg: 60", "convergence_mm: 5", {"render.convergence_mm", "10 to 500, or 0"}},
    {"VolumeIsNoNumber", "cell_um: 100", "volume: deep", {"thermal.volume"}},
    {"Temperature", "cell_um: 100", "body_temperature_C: 370", {"thermal.body_temperature_C", "0 to 60"}},
    {"CellTooFine", "cell_um: 100", "cell_um: 20", {"thermal.cell_um", "25 to 1000"}},
    {"ThermalModel", "cell_um: 100", "model: textbook", {"thermal.model", "paper"}},
    {"NodeName", "name: small", "name: small\nnodes: [physics_nod]", {"nodes", "physics_nod", "valid: handle_bridge"}},
    {"BreathingTooDeep", "thermal:", "breathing: {amplitude_mm: 80}\nthermal:", {"breathing.amplitude_mm", "0 to 50"}},
    {"BreathingPeriod", "thermal:", "breathing: {period_s: 0}\nthermal:", {"breathing.period_s", "0.5 to 60"}},
    {"BreathingNowhere", "thermal:", "breathing: {direction: [0, 0, 0]}\nthermal:", {"breathing.direction"}},
    {"BreathingUnit", "thermal:", "breathing: {amplitude_mm: 2 s}\nthermal:", {"amplitude_mm", "wrong unit"}},
    {"LimitOutOfRange",
     "thermal:",
     "assessment: {limits: {line_done_pct: 190}}\nthermal:",
     {"assessment.limits.line_done_pct", "0 to 100"}},
    {"LimitUnit",
     "thermal:",
     "assessment: {limits: {time_s: 20 mm}}\nthermal:",
     {"assessment.limits.time_s", "wrong unit", "0 to 86400"}},
    {"LimitName", "thermal:", "assessment: {limits: {tim_s: 20}}\nthermal:", {"assessment.limits.tim_s", "time_s"}},
    {"Points", "thermal:", "assessment: {points: {time: -1}}\nthermal:", {"assessment.points.time", "0 to 1000"}},
    {"LineCounts",
     "thermal:",
     "assessment: {line: {s: [0.1, 0.2], t: [0.1, 0.2, 0.3]}}\nthermal:",
     {"assessment.line.t", "as many entries as s"}},
    {"LineOnThePlace",
     "thermal:",
     "assessment: {line: {s: [0.1, 0.1], t: [0.1, 0.1]}}\nthermal:",
     {"assessment.line.t", "stands twice"}},
    {"LineBy",
     "thermal:",
     "assessment: {line: {s: [0.1, 0.2], t: [0.1, 0.2], by: chalk}}\nthermal:",
     {"assessment.line.by", "touch"}},
    {"IdleSpeed",
     "thermal:",
     "assessment: {idle_speed_mm_s: 6}\nthermal:",
     {"assessment.idle_speed_mm_s", "must not exceed movement_speed_mm_s"}},
    {"BaseOfAText", "name: small", "name: small\nbase: built-in.yaml", {"base"}},
    {"NoName", "name: small", "label: small", {"name"}},
    {"TearStretch", "grasp_radius_mm: 4", "tear_stretch: 0.9", {"tear_stretch", "above 1 + membrane_prestrain"}},
    {"Grasp", "grasp_radius_mm: 4", "grasp_close_deg: 50", {"grasp_open_deg", "above grasp_close_deg"}},
};
INSTANTIATE_TEST_SUITE_P(Rules, SceneYamlRule, testing::ValuesIn(kRules),
                         [](const auto& test) { return std::string(test.param.name); });

const char* const kImported = R"(
name: x
organ:
  import:
    unit: mm
    organ: nowhere.stl
    centreline: {x_mm: [0, 0], y_mm: [0, 50], z_mm: [0, 0]}
)";

TEST(SceneYamlImport, MissingMeshIsRefusedInOneLineWithThePlacesLookedAt) {
  const std::string message = Refusal(kImported);
  EXPECT_NE(message.find("x.yaml:6: organ.import.organ: 'nowhere.stl' is not at"), std::string::npos) << message;
  EXPECT_NE(message.find("--data DIR"), std::string::npos);
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

TEST(SceneYamlImport, RulesOfTheImport) {
  const auto folder = std::filesystem::temp_directory_path() / ("fulcrum_scene_yaml_test_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "nowhere.stl") << "solid x\nendsolid x\n";
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      (void)ParseSceneYaml(text, "x.yaml", folder);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(refusal(kImported), "");
  EXPECT_NE(refusal(With(kImported, "unit: mm", "unit: inch")).find("unit"), std::string::npos);
  EXPECT_NE(refusal(With(kImported, "z_mm: [0, 0]", "z_mm: [0, 0, 0]")).find("as many entries"), std::string::npos);
  EXPECT_NE(refusal(With(kImported, "unit: mm", "unit: mm\n    from: 0.5\n    to: 0.55")).find("at least 0.1"),
            std::string::npos);
  EXPECT_NE(refusal(With(kImported, "unit: mm", "unit: mm\n    facing: [0, 0, 0]")).find("direction"),
            std::string::npos);
  EXPECT_NE(refusal(With(kImported, "  import:", "  procedural: {}\n  import:")).find("either"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(SceneChanges, AreMadeBeforeTheSceneIsRead) {
  const SceneDescription changed = ReadSceneYaml(
      kScenes / "small.yaml", {}, {"script.power_W=50", "render.png_rate_Hz=5", "physics.grip_force_N=4"});
  float most = 0;
  for (const ScriptKeySettings& key : changed.settings.script) {
    EXPECT_EQ(key.power_W, key.pedals == kPedalNone ? 0 : 50);
    most = std::max(most, static_cast<float>(key.power_W));
  }
  EXPECT_EQ(most, 50);
  EXPECT_EQ(changed.settings.render.png_rate_Hz, 5);
  EXPECT_EQ(changed.settings.physics.grip_force_N, 4);
  EXPECT_NE(changed.effective_yaml.find("power_W: 50"), std::string::npos);
  EXPECT_EQ(changed.effective_yaml.find("power_W: 35"), std::string::npos);
}

TEST(SceneChanges, ThatCannotBeAreRefused) {
  for (const char* change :
       {"power=3", "script.duration_s=3", "organ.density_kg_m3=1", "physics.nothing=1", "script.power_W=1000",
        "render.png_rate_Hz=x", "physics.=1", "=", "physics.grip_force_N=["}) {
    EXPECT_THROW((void)ReadSceneYaml(kScenes / "small.yaml", {}, {change}), InputError) << change;
  }
}

TEST(SceneYaml, BreathingIsOptionalAndCompiled) {
  const std::string small = TextOf(kScenes / "small.yaml");
  EXPECT_EQ(ParseSceneYaml(small, "x.yaml", {}).settings.breathing.amplitude_m, 0.0f);
  const std::string breathing =
      With(small, "thermal:", "breathing: {direction: [0, -0.3, 0.4], amplitude_mm: 6, period_s: 5}\nthermal:");
  const SceneDescription read = ParseSceneYaml(breathing, "x.yaml", {});
  const Breathing& b = read.settings.breathing;
  EXPECT_NEAR((b.direction - Vec3f(0, -0.6f, 0.8f)).norm(), 0, 1e-6);
  EXPECT_EQ(b.amplitude_m, 0.006f);
  EXPECT_EQ(b.period_s, 5.0f);
  const SceneData scene = BuildProcedural(read.settings);
  EXPECT_EQ(FindFault(scene.View()), std::nullopt);
  EXPECT_NE(scene.fixed.hash, BuildProcedural(Small()).fixed.hash);
  EXPECT_EQ(BuildProcedural(ParseSceneYaml(read.effective_yaml, "x.yaml", {}).settings).fixed.hash, scene.fixed.hash);
  const std::string in_paper = Refusal(With(breathing, "mode: accurate", "mode: paper"));
  EXPECT_NE(in_paper.find("breathing.amplitude_mm: needs physics.mode"), std::string::npos) << in_paper;
}

TEST(SceneYaml, AssessmentIsOptionalAndCompiled) {
  const std::string small = TextOf(kScenes / "small.yaml");
  EXPECT_EQ(ParseSceneYaml(small, "x.yaml", {}).settings.assessment.on, 0u);
  const SceneDescription read = ParseSceneYaml(With(small, "thermal:",
                                                    "assessment: {line: {s: [0.5, 0.5], t: [0.2, 0.8]}, margin_mm: 3, "
                                                    "limits: {time_s: 1 min}, points: {time: 7}}\n"
                                                    "thermal:"),
                                               "x.yaml", {});
  const AssessmentParams& a = read.settings.assessment;
  EXPECT_EQ(a.on, 1u);
  EXPECT_EQ(a.margin_m, 0.003f);
  EXPECT_EQ(a.limit[static_cast<std::size_t>(Measure::kTime)], 60.0f);
  EXPECT_EQ(a.points[static_cast<std::size_t>(Measure::kTime)], 7.0f);
  EXPECT_EQ(a.limit[static_cast<std::size_t>(Measure::kPathLength)], InfoOf(Measure::kPathLength).limit);
  const SceneData scene = BuildProcedural(read.settings);
  EXPECT_EQ(FindFault(scene.View()), std::nullopt);
  // Straight along the sheet: 0.6 of its length, apart from the effects of flattening and of its bend.
  double length = 0;
  for (std::size_t i = 1; i < scene.planned_line.size(); ++i) {
    length += static_cast<double>((scene.planned_line[i] - scene.planned_line[i - 1]).norm());
  }
  EXPECT_NEAR(length, 0.6 * 0.080, 0.1 * 0.048);
  EXPECT_EQ(BuildProcedural(ParseSceneYaml(read.effective_yaml, "x.yaml", {}).settings).fixed.hash, scene.fixed.hash);
  SceneData without = scene;
  without.planned_line.clear();
  EXPECT_NE(ContentHash(without.View()), scene.fixed.hash);
}

// ---------------------------------------------------------------------------------------------------- on a base

class SceneOnBase : public testing::Test {
 protected:
  SceneOnBase() { std::filesystem::create_directories(folder_ / "below"); }
  ~SceneOnBase() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string RefusalOf(const std::filesystem::path& file) const {
    try {
      (void)ReadSceneYaml(file, {});
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("scene_on_base_" + std::to_string(getpid()));
};

TEST_F(SceneOnBase, ABaseMayBeTheNameOfAShippedScene) {
  const auto file = Write("mine.yaml", "name: mine\nbase: small\nphysics:\n  grip_force_N: 5\n");
  const SceneDescription mine = ReadSceneYaml(file, {});
  EXPECT_NEAR(mine.settings.physics.grip_force_N, 5, 1e-6);
  EXPECT_EQ(mine.settings.membrane.rows, ReadSceneYaml(kScenes / "small.yaml", {}).settings.membrane.rows);
  // A file beside the scene comes first.
  Write("small", "name: other\nbase: built-in\n");
  EXPECT_EQ(ReadSceneYaml(file, {}).settings.membrane.rows,
            ReadSceneYaml(kScenes / "built-in.yaml", {}).settings.membrane.rows);
  const std::string wrong = RefusalOf(Write("wrong.yaml", "name: wrong\nbase: smal\n"));
  EXPECT_NE(wrong.find("or the name of one in"), std::string::npos) << wrong;
}

TEST_F(SceneOnBase, ItsKeysAreToldWhereMeshFilesAreMissing) {
  const auto file = Write("openhelp.yaml", TextOf(kScenes / "openhelp.yaml"));
  EXPECT_THROW((void)ReadSceneYaml(file, {}), InputError);
  const auto rules = SceneRules(file);
  EXPECT_TRUE(std::any_of(rules.begin(), rules.end(),
                          [](const config::KeyRule& rule) { return rule.path == "organ.import.organ"; }));
}

TEST_F(SceneOnBase, SaysOnlyWhatIsDifferent) {
  Write("below/small.yaml", TextOf(kScenes / "small.yaml"));
  Write("middle.yaml", "name: middle\nbase: below/small.yaml\nphysics: {friction: 0.3}\nmembrane: {gap_mm: 5}\n");
  const auto file = Write("top.yaml",
                          "name: top\nbase: middle.yaml\nmembrane: {gap_mm: 4}\n"
                          "script: {tool0: [{time_s: 1, sheet: [0.5, 0.5], height_mm: 20}]}\n");
  const SceneDescription read = ReadSceneYaml(file, {});
  SceneSettings wanted = Small();
  wanted.name = "top";
  wanted.physics.friction = 0.3f;
  wanted.membrane.gap_m = 0.004;
  std::erase_if(wanted.script, [](const ScriptKeySettings& key) { return key.tool == 0; });
  ScriptKeySettings key;
  key.time_s = 1;
  key.height_m = 0.02;
  wanted.script.push_back(key);
  EXPECT_EQ(BuildProcedural(read.settings).fixed.hash, BuildProcedural(wanted).fixed.hash);
  EXPECT_EQ(read.settings.description, "") << "the description of the base is not inherited";
  const SceneDescription again = ParseSceneYaml(read.effective_yaml, "effective.yaml", {});
  EXPECT_EQ(BuildProcedural(again.settings).fixed.hash, BuildProcedural(wanted).fixed.hash);
}

TEST_F(SceneOnBase, IsRefusedWithTheFileAndLineThatIsWrong) {
  const std::string small = TextOf(kScenes / "small.yaml");
  Write("below/small.yaml", With(small, "rings: 11", "rings: 100000"));
  const std::string of_base = RefusalOf(Write("top.yaml", "name: top\nbase: below/small.yaml\n"));
  EXPECT_NE(of_base.find("below/small.yaml:8: organ.procedural.rings"), std::string::npos) << of_base;
  const std::string of_top = RefusalOf(
      Write("top.yaml", "name: top\nbase: below/small.yaml\norgan: {procedural: {rings: 11, segments: 10000}}\n"));
  EXPECT_NE(of_top.find("top.yaml:3: organ.procedural.segments"), std::string::npos) << of_top;
  const std::string missing = RefusalOf(Write("top.yaml", "name: top\nbase: nowhere.yaml\n"));
  EXPECT_NE(missing.find("top.yaml:2: base: 'nowhere.yaml' is not at "), std::string::npos) << missing;
  const std::string circle = RefusalOf(Write("round.yaml", "name: round\nbase: round.yaml\n"));
  EXPECT_NE(circle.find("base: more than 8 files"), std::string::npos) << circle;
  const std::string list = RefusalOf(Write("top.yaml", "name: top\nbase: [small.yaml]\n"));
  EXPECT_NE(list.find("top.yaml:2: base: expected the name of a file, found a list"), std::string::npos) << list;
  Write("below/small.yaml", small);
  const std::string nameless = RefusalOf(Write("top.yaml", "base: below/small.yaml\n"));
  EXPECT_NE(nameless.find("name"), std::string::npos) << nameless;
}

TEST(SceneYaml, VolumeIsASwitchAndCompiled) {
  const std::string small = TextOf(kScenes / "small.yaml");
  EXPECT_EQ(ParseSceneYaml(small, "x.yaml", {}).settings.thermal.volume, 0u);
  const SceneDescription read = ParseSceneYaml(With(small, "thermal:", "thermal:\n  volume: true"), "x.yaml", {});
  EXPECT_EQ(read.settings.thermal.volume, 1u);
  EXPECT_NE(read.effective_yaml.find("volume: true"), std::string::npos);
  EXPECT_EQ(ParseSceneYaml(read.effective_yaml, "x.yaml", {}).settings.thermal.volume, 1u);
}

TEST(SceneYaml, NodesCanBeChosen) {
  const std::string text =
      With(TextOf(kScenes / "small.yaml"), "name: small", "name: small\nnodes: [haptics_node, physics_node]");
  EXPECT_EQ(ParseSceneYaml(text, "x.yaml", {}).settings.node_mask, (1u << 2) | (1u << 3));
  EXPECT_EQ(ParseSceneYaml(TextOf(kScenes / "small.yaml"), "x.yaml", {}).settings.node_mask, 0x3eu);
}

TEST(SceneYaml, WorldPlacesAreTakenAsTheyAre) {
  const std::string text = With(TextOf(kScenes / "small.yaml"), "sheet: [0.33, 0.5], height_mm: 20, jaw_deg: 50",
                                "world_mm: [-20, 1, 30], jaw_deg: 50");
  const SceneData scene = BuildProcedural(ParseSceneYaml(text, "x.yaml", {}).settings);
  EXPECT_NEAR((scene.script[0].p_W - Vec3f(-0.020f, 0.001f, 0.030f)).norm(), 0, 1e-7);
}

}  // namespace
}  // namespace fulcrum::scene
