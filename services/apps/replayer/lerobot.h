// Recorded sessions as a set for robot learning in the layout of LeRobot v2.1 (github.com/huggingface/lerobot): a video
// and a table of states and actions for each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "render_node/node/render_node.h"
#include "services/apps/replayer/kinematics.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

struct LerobotSettings {
  struct Session {
    std::filesystem::path recording;
    std::filesystem::path scene;  ///< Compiled scene.
    std::string task;             ///< What is done in it, in words; empty: the scene's name.
  };
  std::vector<Session> sessions;  ///< One becomes an episode; all have the same instruments and size of the picture.
  std::filesystem::path folder;   ///< Must be empty or missing.
  double until_s = -1;            ///< Session time of the end of each [s]; negative: the end of the recording.
};

struct LerobotResult {
  std::uint64_t frames = 0;
  double duration_s = 0;  ///< Session time covered [s].
};

/// Writes the set; its content is in deploy/docs/dataset.md. Reads all recordings before it draws the first picture.
/// Throws InputError and MismatchError, which name the recording to leave out, and std::runtime_error when OpenGL is
/// missing, ffmpeg fails or a recording has no tissue.
LerobotResult MakeLerobot(const LerobotSettings& settings, const std::function<void(double)>& progress);

/// Shows the instruments in this state in the pictures until a sample with another pose arrives.
void ShowInstruments(const KinematicState& state, const SceneView& scene, render::RenderNode* node);

}  // namespace fulcrum::replay
