// A recording of the small scene that the programs' tests read.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "tests/unit/replay/recorded_cart.h"

namespace fulcrum::replay::testing {

/// Folder with recording.mcap and scene.fulcrum; it is removed with the object.
class ShortSession {
 public:
  /// Of the scene before it is compiled: touched, grasped and cut within two seconds.
  static void Hurry(scene::SceneData* data) {
    for (ScriptKey& key : data->script) key.time_s *= 0.4f;
  }

  explicit ShortSession(const std::string& name, const CartStory& story = {.seconds = 2},
                        const std::function<void(scene::SceneData*)>& change = Hurry)
      : folder_(std::filesystem::temp_directory_path() / ("fulcrum_" + name + "_" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    scene::SceneData data = scene::BuildProcedural(scene::Small());
    change(&data);
    scene::WriteSceneFile(data, "", folder_ / "scene.fulcrum");
    scene_.emplace(folder_ / "scene.fulcrum");
    cut_length_m_ = RecordCart(scene_->view(), folder_, story);
  }
  ~ShortSession() { std::filesystem::remove_all(folder_); }
  ShortSession(const ShortSession&) = delete;
  ShortSession& operator=(const ShortSession&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::filesystem::path recording() const { return folder_ / "recording.mcap"; }
  [[nodiscard]] const SceneView& scene() const { return scene_->view(); }
  [[nodiscard]] float cut_length_m() const { return cut_length_m_; }

 private:
  std::filesystem::path folder_;
  std::optional<scene::SceneFile> scene_;
  float cut_length_m_ = 0;
};

}  // namespace fulcrum::replay::testing
