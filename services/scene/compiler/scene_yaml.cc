#include "services/scene/compiler/scene_yaml.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "services/base/core/scope.h"
#include "services/base/runtime/install_places.h"
#include "services/scene/compiler/changes.h"
#include "services/scene/compiler/yaml_bodies.h"
#include "services/scene/compiler/yaml_parameters.h"

namespace fulcrum::scene {
namespace {

using config::Range;
using config::StrictMap;
using config::StrictYaml;

/// Folders in which mesh files are searched, in this order.
struct Folders : std::vector<std::filesystem::path> {
  bool files_needed = true;  ///< False: the first path is returned, whether or not the file exists.
};

constexpr std::size_t kMaxKeys = 2000;
constexpr std::size_t kMaxStructures = 64;
constexpr std::size_t kMaxPathPoints = 64;
constexpr double kLongestScript_s = 86400;

const StrictMap::Choices<ToolKind> kToolKinds = {{"none", ToolKind::kNone},
                                                 {"grasper", ToolKind::kGrasper},
                                                 {"hook", ToolKind::kHook},
                                                 {"scissors", ToolKind::kScissors},
                                                 {"scope", ToolKind::kScope},
                                                 {"suction", ToolKind::kSuction},
                                                 {"clip_applier", ToolKind::kClipApplier}};
const StrictMap::Choices<ProtectedKind> kProtectedKinds = {{"ureter", ProtectedKind::kUreter},
                                                           {"nerve", ProtectedKind::kNerve}};
const StrictMap::Choices<std::uint32_t> kPedals = {
    {"up", kPedalNone}, {"cut", kPedalCut}, {"coag", kPedalCoag}, {"blend", kPedalBlend}};
const StrictMap::Choices<BrickSplit> kSplits = {{"six", BrickSplit::kSix}, {"five", BrickSplit::kFive}};

void ReadTube(StrictMap map, TubeSettings* t) {
  ReadInteger(&map, "rings", 3, 1000, &t->rings);
  ReadInteger(&map, "segments", 6, 200, &t->segments);
  ReadSi(&map, "length_mm", Range::Between(10, 500), &t->length_m);
  ReadSi(&map, "outer_radius_mm", Range::Between(2, 60), &t->outer_radius_m);
  ReadSi(&map, "wall_mm", Range::Between(0.5, 20), &t->wall_m);
  ReadSi(&map, "sagittal_bend_mm", Range::Between(-60, 60), &t->sagittal_bend_m);
  ReadSi(&map, "lateral_bend_mm", Range::Between(-40, 40), &t->lateral_bend_m);
  ReadInteger(&map, "fold_count", 0, 40, &t->fold_count);
  ReadSi(&map, "fold_depth_mm", Range::Between(0, 5), &t->fold_depth_m);
  t->split = map.Choice("split", t->split, kSplits);
  if (t->split == BrickSplit::kFive && t->segments % 2 != 0) {
    map.Fail("split", "five needs an even number of segments, not " + std::to_string(t->segments));
  }
  if (t->wall_m + t->fold_depth_m >= t->outer_radius_m) {
    map.Fail("outer_radius_mm", "must be more than wall_mm + fold_depth_mm");
  }
}

/// Finds a mesh file, or throws InputError in one line with every path that was tried.
std::filesystem::path FindFile(const StrictMap& map, const std::string& key, const std::string& name,
                               const Folders& folders) {
  std::string tried;
  for (const auto& folder : folders) {
    std::filesystem::path candidate = (folder / name).lexically_normal();
    std::error_code error;  // A name that is too long is no file either.
    if (!folders.files_needed || std::filesystem::is_regular_file(candidate, error)) {
      return candidate;
    }
    tried += tried.empty() ? "" : ", ";
    tried += candidate.string();
  }
  std::string reason = "'";
  reason += name;
  reason += "' is not at ";
  reason += tried;
  reason += "; give its folder with --data DIR";
  map.Fail(key, reason);
}

void ReadPatch(StrictMap map, ImportSettings* import) {
  import->patch = true;
  if (map.Has("at_mm")) import->patch_at_m = map.Vector3Si("at_mm", Range::Between(-5000, 5000));
  if (map.Has("width_mm")) import->patch_width_m = map.NumberSi("width_mm", Range::Between(5, 400));
  if (map.Has("length_mm")) import->patch_length_m = map.NumberSi("length_mm", Range::Between(5, 400));
  ReadSi(&map, "held_share", Range::Between(0, 0.95), &import->held_share);
}

void ReadImport(StrictMap map, const Folders& bases, ImportSettings* import, Folders* folders) {
  for (const std::string& folder : map.Texts("folders", 0, 16)) {
    for (const auto& base : bases) folders->push_back(base / folder);
  }
  folders->insert(folders->end(), bases.begin(), bases.end());
  import->scale_m =
      map.Choice("unit", import->scale_m, kLengthUnits) * map.Number("scale", 1, Range::Between(1e-3, 1e3));
  import->origin_m = map.Vector3Si("origin_mm", import->origin_m, Range::Between(-2000, 2000));
  map.KeepNearer("organ", "shape");
  if (auto shape = map.OptionalMap("shape")) {
    if (map.Has("organ")) map.Fail("shape", "and organ exclude each other");
    import->shape = ReadShape(*shape);
  } else {
    import->organ_file = FindFile(map, "organ", map.Text("organ"), *folders);
  }
  import->remesh = map.Flag("remesh", import->remesh);
  import->cap_openings = map.Flag("cap_openings", import->cap_openings);
  ReadSi(&map, "wall_mm", Range::Between(0, 30), &import->wall_m);
  map.KeepNearer("tet_edge_mm", "target_tets");
  ReadSi(&map, "tet_edge_mm", Range::Between(0, 50), &import->tet_edge_m);
  if (import->tet_edge_m > 0 && map.Has("target_tets")) {
    map.Fail("tet_edge_mm", "and target_tets set the same quantity: give one of them");
  }
  // Not beside an edge: the effective YAML would say both.
  if (!(import->tet_edge_m > 0)) ReadInteger(&map, "target_tets", 500, kMostTets, &import->target_tets);
  ReadSi(&map, "min_edge_mm", Range::Between(0, 5), &import->min_edge_m);
  ReadInteger(&map, "organ_triangles_max", 500, 200000, &import->organ_triangles_max);
  map.KeepNearer("centreline", "patch");
  if (auto line = map.OptionalMap("centreline")) import->centreline_m = ReadLine(&*line);
  if (auto patch = map.OptionalMap("patch")) {
    if (!import->centreline_m.empty()) {
      map.Fail("patch",
               "and centreline exclude each other: the membrane covers a stretch of the organ or a patch of it");
    }
    ReadPatch(*patch, import);
  }
  ReadSi(&map, "from", Range::Between(0, 1), &import->from);
  ReadSi(&map, "to", Range::Between(0, 1), &import->to);
  if (!(import->to - import->from >= 0.1)) {
    map.Fail("to", "must exceed `from` by at least 0.1");
  }
  if (map.Has("facing")) {
    import->facing = map.Vector3Si("facing", Range::Between(-1, 1));
    if (!(import->facing->norm() > 0.1)) {
      map.Fail("facing", "must be a direction, not (nearly) zero");
    }
  }
  ReadSi(&map, "sector_deg", Range::Between(30, 240), &import->sector_rad);
  ReadSi(&map, "flare_mm", Range::Between(0, 60), &import->flare_m);
  ReadSi(&map, "bed_mm", Range::Between(0, 150), &import->bed_m);
  ReadSi(&map, "cavity_mm", Range::Between(0, 1000), &import->cavity_m);
  for (StrictMap& entry : map.Maps("surroundings", 0, kMostSurroundings)) {
    FixedSettings& s = import->surroundings.emplace_back(ReadFixedSurface(&entry));
    s.file = FindFile(entry, "file", entry.Text("file"), *folders);
    s.scale_m = ReadFileUnit(&entry);
  }
}

void ReadOrgan(StrictMap* root, const Folders& bases, SceneSettings* scene, Folders* folders) {
  StrictMap organ = root->Map("organ");
  ReadSi(&organ, "density_kg_m3", Range::Between(1, 1e5), &scene->organ_density_kg_m3);
  scene->organ_look = organ.Choice("look", scene->organ_look, kSolidLookNames);
  organ.KeepNearer("import", "procedural");
  if (organ.Has("import") == organ.Has("procedural")) {
    root->Fail("organ", "needs either `procedural` or `import`");
  }
  if (organ.Has("import")) {
    ReadImport(organ.Map("import"), bases, &scene->import.emplace(), folders);
  } else {
    ReadTube(organ.Map("procedural"), &scene->tube);
    folders->insert(folders->end(), bases.begin(), bases.end());
  }
}

void ReadMembrane(StrictMap map, MembraneSettings* m) {
  ReadInteger(&map, "rows", 3, 5000, &m->rows);
  ReadInteger(&map, "cols", 3, 5000, &m->cols);
  ReadSi(&map, "width_mm", Range::Between(5, 1000), &m->width_m);
  ReadSi(&map, "gap_mm", Range::Between(0.5, 30), &m->gap_m);
  ReadSi(&map, "density_kg_m2", Range::Between(0.01, 50), &m->density_kg_m2);
  ReadInteger(&map, "bending_row_stride", 1, 1000, &m->bending_row_stride);
  ReadInteger(&map, "bending_col_stride", 1, 1000, &m->bending_col_stride);
  ReadInteger(&map, "binding_row_stride", 1, 1000, &m->binding_row_stride);
  ReadInteger(&map, "binding_col_stride", 1, 1000, &m->binding_col_stride);
  ReadSi(&map, "binding_reach_mm", Range::Between(0.5, 60), &m->binding_reach_m);
  if ((m->rows - 1) % m->bending_row_stride != 0) {
    map.Fail("bending_row_stride", "must divide rows - 1 = " + std::to_string(m->rows - 1));
  }
  if ((m->cols - 1) % m->bending_col_stride != 0) {
    map.Fail("bending_col_stride", "must divide cols - 1 = " + std::to_string(m->cols - 1));
  }
}

Vec2f ToVec2(const std::vector<double>& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1])}; }

StructureSettings ReadStructure(StrictMap map) {
  StructureSettings s;
  s.kind = map.Choice("kind", kProtectedKinds);
  ReadSi(&map, "radius_mm", Range::Between(0.05, 20), &s.radius_m);
  ReadSi(&map, "depth_mm", Range::Between(0, 30), &s.depth_m);
  const auto across = map.Numbers("s", 2, kMaxPathPoints, Range::Between(0, 1));
  const auto along = map.Numbers("t", 2, kMaxPathPoints, Range::Between(0, 1));
  if (across.size() != along.size()) {
    map.Fail("t", "must have as many entries as s");
  }
  for (std::size_t i = 0; i < across.size(); ++i) {
    s.path.push_back(ToVec2({across[i], along[i]}));
  }
  return s;
}

void ReadToolMeshes(StrictMap map, const ToolDescription& tool, const Folders& folders, ToolMeshSettings* meshes) {
  const bool has_jaws = tool.kind != ToolKind::kHook && tool.kind != ToolKind::kSuction;
  if (tool.kind == ToolKind::kScope) map.Fail("body", "a scope is not seen");
  meshes->scale_m = map.Choice("unit", meshes->scale_m, kLengthUnits);
  if (!has_jaws && map.Has("jaws")) {
    map.Fail("jaws", tool.kind == ToolKind::kHook ? "a hook has none" : "a suction tube has none");
  }
  meshes->body_file = FindFile(map, "body", map.Text("body"), folders);
  if (has_jaws) {
    for (const std::string& name : map.Texts("jaws", 2, 2)) {
      meshes->jaw_files.push_back(FindFile(map, "jaws", name, folders));
    }
  }
  ReadSi(&map, "turn_deg", Range::Between(-180, 180), &meshes->turn_rad);
  meshes->origin_m = Vec3f(0, 0, has_jaws ? -tool.tip_length_m : 0);
  meshes->origin_m = map.Vector3Si("origin_mm", meshes->origin_m, Range::Between(-500, 500));
}

Vec3f TrocarFor(const RenderParams& render) {
  constexpr float kInside_m = 0.12f;
  return render.scope_tip_W - kInside_m * ShaftOf(render);
}

void ReadTool(StrictMap map, const Folders& folders, const RenderParams& render, ToolDescription* tool,
              ToolMeshSettings* meshes) {
  tool->kind = map.Choice("kind", tool->kind, kToolKinds);
  if (map.IsChanged("kind")) {  // What a base says of another kind of tool is not meant for this one.
    for (const std::string& key : map.Keys()) {
      const bool is_of_kind = key == "meshes" || (key == "traction_N" && tool->kind != ToolKind::kGrasper);
      if (tool->kind == ToolKind::kNone || is_of_kind) map.OmitFarther(key, "kind");
    }
  }
  if (tool->kind == ToolKind::kNone) {
    return;
  }
  // A scope without a trocar gets one on the axis of the shaft that shows what `render` describes.
  const bool placed = tool->kind != ToolKind::kScope || map.Has("trocar_mm");
  *tool = DefaultTool(tool->kind, placed ? map.Vector3Si("trocar_mm", Range::Between(-1000, 1000)) : TrocarFor(render));
  ReadSi(&map, "shaft_radius_mm", Range::Between(0.1, 20), &tool->shaft_radius_m);
  ReadSi(&map, "shaft_length_mm", Range::Between(50, 1000), &tool->shaft_length_m);
  ReadSi(&map, "tip_radius_mm", Range::Between(0.05, 20), &tool->tip_radius_m);
  ReadSi(&map, "tip_length_mm", Range::Between(0.1, 100), &tool->tip_length_m);
  if (tool->kind == ToolKind::kGrasper) ReadSi(&map, "traction_N", Range::Between(0, 9), &tool->traction_N);
  if (auto entry = map.OptionalMap("meshes")) {
    ReadToolMeshes(*entry, *tool, folders, meshes);
  }
}

/// `sheets`: names of those of the scene, the first one first. `power_W`: in place of each power above 0.
ScriptKeySettings ReadKey(StrictMap map, double duration_s, ToolKind kind, const std::vector<std::string>& sheets,
                          std::optional<double> power_W) {
  constexpr double kShut_rad = 0.87;  // 50 degrees: of a tube's handle that is let go.
  ScriptKeySettings key;
  if (kind == ToolKind::kSuction) key.jaw_rad = kShut_rad;
  // The range is that of any scene: `fulcrum scene schema` prints it.
  key.time_s = map.NumberSi("time_s", Range::Between(0, kLongestScript_s));
  if (key.time_s > duration_s) {
    std::array<char, 128> reason{};
    std::snprintf(reason.data(), reason.size(), "%g s is after the end of the script; valid: 0 to %g s (duration_s)",
                  key.time_s, duration_s);
    map.Fail("time_s", reason.data());
  }
  if (map.Has("world_mm")) {
    key.world_m = map.Vector3Si("world_mm", Range::Between(-1000, 1000));
  } else {
    key.sheet = ToVec2(map.Numbers("sheet", 2, 2, Range::Between(0, 1)));
    if (sheets.empty()) map.Fail("sheet", "is a place on a sheet, and the scene has none: give `world_mm`");
    key.on = map.TextOr("on", sheets[0], 31);
    if (std::ranges::find(sheets, key.on) == sheets.end()) {
      std::string names;
      for (const std::string& name : sheets) names += (names.empty() ? "" : ", ") + name;
      map.Fail("on", "no sheet '" + key.on + "'; the scene has " + names);
    }
    key.height_m = map.NumberSi("height_mm", Range::Between(-30, 500));
    key.offset_m = map.Vector3Si("offset_mm", key.offset_m, Range::Between(-200, 200));
  }
  ReadSi(&map, "jaw_deg", Range::Between(0, 90), &key.jaw_rad);
  ReadSi(&map, "roll_deg", Range::Between(-180, 180), &key.roll_rad);
  key.pedals = map.Choice("pedal", key.pedals, kPedals);
  ReadSi(&map, "power_W", Range::Between(0, 300), &key.power_W);
  if (power_W && key.power_W > 0) {
    key.power_W = *power_W;
    map.Restate("power_W", *power_W);
  }
  if (key.pedals != kPedalNone && !(key.power_W > 0)) {
    map.Fail("pedal", "is down, but power_W is 0");
  }
  return key;
}

void ReadScript(StrictMap map, std::optional<double> power_W, SceneSettings* scene) {
  std::vector<std::string> sheets;
  if (scene->has_organ) sheets.emplace_back("membrane");
  for (const SheetSettings& sheet : scene->sheets) sheets.push_back(sheet.name);
  scene->script_duration_s =
      map.NumberSi("duration_s", scene->script_duration_s, Range::Between(0.1, kLongestScript_s));
  if (const std::string hand = map.TextOr("hand", ""); !hand.empty()) {
    scene->hand = HandNamed(hand);
    if (!scene->hand) map.Fail("hand", "'" + hand + "' is not one of " + std::string(kHandNames));
  }
  const double seed = map.Number("seed", 0, Range::Between(0, 1e9));
  if (scene->hand) scene->hand->seed = static_cast<std::uint32_t>(seed);
  for (int tool = 0; tool < kMaxTools; ++tool) {
    const std::string name = "tool" + std::to_string(tool);
    double last_s = -1;
    for (StrictMap& entry : map.Maps(name, 0, kMaxKeys)) {
      ScriptKeySettings key = ReadKey(entry, scene->script_duration_s, scene->tools[tool].kind, sheets, power_W);
      key.tool = tool;
      if (scene->tools[tool].kind == ToolKind::kNone) {
        entry.Fail("time_s", "the scene has no " + name);
      }
      if (!(key.time_s > last_s)) {
        entry.Fail("time_s", "keys must follow one another in time");
      }
      last_s = key.time_s;
      scene->script.push_back(key);
    }
  }
  if (power_W && std::ranges::none_of(scene->script, [](const auto& key) { return key.power_W > 0; })) {
    throw InputError("--set script.power_W: the scene's script has no use of the generator");
  }
}

std::uint32_t ReadNodes(StrictMap* root, std::uint32_t all) {
  const std::vector<std::string> names = root->Texts("nodes", 0, kNodeCount);
  if (names.empty()) {
    return all;
  }
  // Supervisor and recorder belong to the session and not to the scene.
  constexpr int kSceneNodes = static_cast<int>(NodeId::kRecorder);
  std::uint32_t mask = 0;
  for (const std::string& name : names) {
    int node = 1;
    while (node < kSceneNodes && name != NodeName(static_cast<NodeId>(node))) {
      ++node;
    }
    if (node == kSceneNodes) {
      std::string valid;
      for (int known = 1; known < kSceneNodes; ++known) {
        valid += (known == 1 ? "" : ", ") + std::string(NodeName(static_cast<NodeId>(known)));
      }
      root->Fail("nodes", "no node '" + name + "'; valid: " + valid);
    }
    mask |= 1u << static_cast<unsigned>(node);
  }
  return mask;
}

/// @param bases folders to which relative names of the description refer.
/// @param power_W replaces the power of each use in the script, whichever file says it.
SceneDescription Read(StrictYaml* yaml, const Folders& bases, const MaterialLibrary& materials,
                      const std::filesystem::path& data, std::optional<double> power_W = {}) {
  SceneSettings scene;
  StrictMap root = yaml->root();
  scene.name = root.Text("name", 63);
  if (!IsSceneName(scene.name)) {
    root.Fail("name", "'" + scene.name + "' becomes the name of files and folders; valid: " + kSceneNameRule);
  }
  scene.description = root.TextOr("description", "");
  Folders folders;
  folders.files_needed = bases.files_needed;
  if (!data.empty()) {
    folders.push_back(data);
  }
  scene.has_organ = root.Has("organ") || (!root.Has("bodies") && !root.Has("sheets"));
  if (scene.has_organ) {
    ReadOrgan(&root, bases, &scene, &folders);
  } else {
    folders.insert(folders.end(), bases.begin(), bases.end());
    if (root.Has("membrane")) root.Fail("membrane", "lies over an organ, and there is none: describe it in `sheets`");
  }
  const auto find = [&](const StrictMap& map, const std::string& key) {
    return FindFile(map, key, StrictMap(map).Text(key), folders);
  };
  const std::vector<StrictMap> sheets = ReadBodies(&root, find, materials, &scene);
  if (scene.has_organ) ReadMembrane(root.MapOrDefaults("membrane"), &scene.membrane);
  const bool has_sheets = scene.has_organ || !scene.sheets.empty();
  for (StrictMap& entry : root.Maps("structures", 0, kMaxStructures)) {
    if (!has_sheets) entry.Fail("kind", "lies below a sheet, and the scene has none");
    scene.structures.push_back(ReadStructure(entry));
  }
  ReadRender(root.MapOrDefaults("render"), &scene.render, &scene.stereo);
  StrictMap tools = root.MapOrDefaults("tools");
  for (int i = 0; i < kMaxTools; ++i) {
    const std::string key = "tool" + std::to_string(i);
    ReadTool(tools.MapOrDefaults(key), folders, scene.render, &scene.tools[i], &scene.tool_meshes[i]);
    const auto hooks = std::ranges::count(scene.tools, ToolKind::kHook, &ToolDescription::kind);
    if (hooks > 1) tools.Fail(key, "is a second hook; a scene has one, because one current flows");
  }
  ReadPhysics(root.MapOrDefaults("physics"), &scene.physics);
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const float limit = scene.sheets[i].own.tear_stretch;
    if (limit != 0.0f && !(limit > 1.0f + scene.physics.membrane_prestrain)) {
      sheets[i].Fail("tear_stretch", "must be above 1 + physics.membrane_prestrain, or 0 (that of `physics`)");
    }
  }
  ReadBreathing(root.MapOrDefaults("breathing"), scene.physics.mode, &scene.breathing);
  ReadThermal(root.MapOrDefaults("thermal"), &scene.thermal);
  ReadHaptics(root.MapOrDefaults("haptics"), &scene.haptics);
  ReadScript(root.MapOrDefaults("script"), power_W, &scene);
  if (auto assessment = root.OptionalMap("assessment")) {
    ReadAssessment(*assessment, &scene.assessment, &scene.planned_line);
    if (!has_sheets && !scene.planned_line.empty()) {
      root.Fail("assessment", "`line` lies on a sheet, and the scene has none");
    }
  }
  const bool burns =
      has_sheets || (FindTool(scene.tools, ToolKind::kHook).has_value() && scene.thermal.model != ThermalModel::kPaper);
  if (!burns) scene.node_mask &= ~(1u << static_cast<unsigned>(NodeId::kThermal));
  scene.node_mask = ReadNodes(&root, scene.node_mask);
  if (!burns && (scene.node_mask >> static_cast<unsigned>(NodeId::kThermal) & 1u) != 0) {
    root.Fail("nodes", "thermal_node needs a sheet, or a hook and a model of heat other than the paper's");
  }
  yaml->Finish();
  return {scene, yaml->Effective(), yaml->Rules()};
}

SceneDescription ReadFile(const std::filesystem::path& file, const std::filesystem::path& data,
                          const std::vector<std::string>& changes, bool files_needed) {
  std::string changed;
  std::optional<double> power_W;
  std::vector<std::string> others;
  for (const std::string& change : changes) {
    if (const auto power = PowerOfChange(change)) {
      power_W = power;
    } else {
      others.push_back(change);
    }
  }
  if (!others.empty()) {
    std::ifstream stream(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    changed = ApplyChanges(text, others, kCompileSections);
  }
  // A scene with the name of its base would be mistaken for it.
  StrictYaml yaml =
      StrictYaml::FromFileOnBases(file, {"name", "description"}, runtime::ShareFolder() / "scenes", changed);
  Folders bases;
  bases.files_needed = files_needed;
  for (const auto& from : yaml.files()) {
    if (std::find(bases.begin(), bases.end(), from.parent_path()) == bases.end()) bases.push_back(from.parent_path());
  }
  return Read(&yaml, bases, MaterialLibrary(bases), data, power_W);
}

}  // namespace

SceneDescription ReadSceneYaml(const std::filesystem::path& file, const std::filesystem::path& data,
                               const std::vector<std::string>& changes) {
  return ReadFile(file, data, changes, true);
}

bool IsSceneName(std::string_view name) {
  const auto is_plain = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.'; };
  return !name.empty() && name.size() <= 63 && std::all_of(name.begin(), name.end(), is_plain) && name[0] != '.';
}

std::vector<config::KeyRule> SceneRules(const std::filesystem::path& file) {
  return ReadFile(file, {}, {}, false).rules;
}

SceneDescription ParseSceneYaml(std::string_view text, std::string_view name, const std::filesystem::path& data,
                                MeshFiles files) {
  StrictYaml yaml = StrictYaml::FromText(text, name);
  Folders here;
  here.files_needed = files == MeshFiles::kNeeded;
  here.emplace_back();
  return Read(&yaml, here, MaterialLibrary({}, MaterialLibrary::Files::kReplaced), data);
}

std::vector<SceneSummary> ListScenes(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::directory_iterator entries(folder, error);
  if (error) {
    throw InputError(folder.string() + ": cannot be listed (" + error.message() + ")");
  }
  std::vector<SceneSummary> scenes;
  for (const auto& entry : entries) {
    if (entry.path().extension() == ".yaml") {
      StrictYaml yaml = StrictYaml::FromFile(entry.path());
      StrictMap root = yaml.root();
      scenes.push_back({root.Text("name", 63), root.TextOr("description", ""), entry.path()});
    }
  }
  std::sort(scenes.begin(), scenes.end(), [](const auto& a, const auto& b) { return a.file < b.file; });
  return scenes;
}

}  // namespace fulcrum::scene
