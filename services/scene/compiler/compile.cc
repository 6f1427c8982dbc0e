#include "services/scene/compiler/compile.h"

#include "services/base/core/slit_sheet.h"
#include "services/scene/builder/build.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/bodies.h"
#include "services/scene/compiler/import.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/compiler/tool_meshes.h"

namespace fulcrum::scene {
namespace {

/// A loose piece of fewer nodes is a crumb from the start: never drawn, and frozen at its first torn edge.
void RefuseCrumbs(const SceneSettings& settings, const SceneView& scene) {
  const std::vector<bool> held = SheetsHeld(scene);
  for (std::size_t i = 0; i < held.size(); ++i) {
    const SheetPart& sheet = scene.sheets[i];
    if (held[i] || std::size_t{sheet.rows} * sheet.cols >= kCrumbNodes) continue;
    Refuse(settings, "sheet '" + std::string(sheet.name) + "' has " + std::to_string(sheet.rows * sheet.cols) +
                         " nodes and is neither held nor bound; valid: at least " + std::to_string(kCrumbNodes) +
                         ", so give it more rows or cols, or hold it");
  }
}

}  // namespace

SceneData BuildScene(const SceneSettings& settings, const Progress& progress) {
  Anatomy anatomy;
  if (settings.import) {
    anatomy = ImportAnatomy(settings, progress);
  } else {
    if (settings.has_organ) anatomy = ProceduralAnatomy(settings);
    AddBodies(settings, {}, progress, &anatomy);
    AddSheets(settings, {}, progress, &anatomy);
    AddFixed(settings.fixed, settings, {}, progress, &anatomy);
  }
  SceneData scene = AssembleScene(settings, anatomy);
  RefuseCrumbs(settings, scene.View());
  AddToolMeshes(settings, &scene);
  return scene;
}

CompiledScene CompileScene(const std::filesystem::path& yaml, const std::filesystem::path& data,
                           const Progress& progress, const std::vector<std::string>& changes) {
  if (progress) {
    progress("reading " + yaml.string());
  }
  SceneDescription description = ReadSceneYaml(yaml, data, changes);
  if (progress) {
    progress("building '" + description.settings.name + "'");
  }
  return {BuildScene(description.settings, progress), std::move(description.effective_yaml)};
}

}  // namespace fulcrum::scene
