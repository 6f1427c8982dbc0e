#include "services/scene/compiler/compile.h"

#include "services/scene/builder/build.h"
#include "services/scene/compiler/bodies.h"
#include "services/scene/compiler/import.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/compiler/tool_meshes.h"

namespace fulcrum::scene {

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
