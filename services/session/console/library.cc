#include "services/session/console/library.h"

#include <algorithm>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"
#include "services/base/core/scene_view.h"
#include "services/base/runtime/install_places.h"
#include "services/session/console/form.h"
#include "services/session/supervisor/scene_cache.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostKeys = 2000;  // Same limit as in the reader of scenes.

SceneChoice ReadScene(const fs::path& file) {
  using config::Range;
  config::StrictYaml yaml =
      config::StrictYaml::FromFileOnBases(file, {"name", "description"}, runtime::ShareFolder() / "scenes");
  config::StrictMap root = yaml.root();
  SceneChoice scene;
  scene.name = file.stem();
  scene.description = root.TextOr("description", "");
  config::StrictMap render = root.MapOrDefaults("render");
  scene.picture_rate_Hz =
      render.Number("png_rate_Hz", static_cast<double>(RenderParams().png_rate_Hz), Range::Between(0, 240));
  config::StrictMap script = root.MapOrDefaults("script");
  scene.duration_s = script.Number("duration_s", 0, Range::Between(0, 1e6));
  for (int tool = 0; tool < kMaxTools; ++tool) {
    const std::string name = "tool" + std::to_string(tool);
    if (!script.Has(name)) continue;
    for (config::StrictMap& key : script.Maps(name, 0, kMostKeys)) {
      scene.power_W = std::max(scene.power_W, key.Number("power_W", 0, Range::Between(0, 300)));
    }
  }
  return scene;
}

}  // namespace

std::vector<SceneChoice> FindScenes(const fs::path& folder) {
  std::vector<SceneChoice> scenes;
  for (const std::string& name : supervisor::ShippedScenes(folder)) {
    if (!IsPlainName(name)) continue;
    try {
      scenes.push_back(ReadScene(folder / (name + ".yaml")));
    } catch (const InputError&) {  // `fulcrum up` reports what is wrong with the file.
    }
  }
  return scenes;
}

std::vector<RecordingChoice> FindRecordings(const fs::path& out, std::size_t most) {
  struct Found {
    fs::file_time_type time;
    RecordingChoice choice;
  };
  std::vector<Found> found;
  std::error_code error;
  for (const auto& session : fs::directory_iterator(out, error)) {
    if (session.is_symlink(error) || !session.is_directory(error)) continue;
    for (const auto& file : fs::directory_iterator(session.path(), error)) {
      const std::string name = session.path().filename().string() + "/" + file.path().filename().string();
      if (!IsRecordingName(name) || !file.is_regular_file(error)) continue;
      found.push_back({file.last_write_time(error), {name, file.file_size(error)}});
    }
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.time > b.time; });
  found.resize(std::min(found.size(), most));
  std::vector<RecordingChoice> choices;
  choices.reserve(found.size());
  for (Found& one : found) choices.push_back(std::move(one.choice));
  return choices;
}

}  // namespace fulcrum::console
