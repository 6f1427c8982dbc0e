// The picture of any time of a recorded session.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "render_node/geometry/look.h"
#include "render_node/offscreen/framebuffer.h"
#include "services/apps/replayer/render_replay.h"
#include "services/apps/replayer/session_facts.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

class Projector {
 public:
  /// Draws in quality high, with the camera of `scene`, which must outlive it. Throws InputError, MismatchError, and
  /// std::runtime_error when OpenGL is missing.
  Projector(const std::filesystem::path& recording, const SceneView& scene, const render::Look& look = {});

  /// What the recording shows.
  [[nodiscard]] const RecordedSpan& span() const { return span_; }
  /// Session time of the last sample that is shown [s].
  [[nodiscard]] double end_s() const { return span_.end_s; }

  /// Goes to a session time [s]. One before that of the last call begins again at the start of the recording, which
  /// takes longer.
  void GoTo(double time_s);
  /// Draws that time into `picture`; before the first tissue, the first picture. False: nothing has changed since the
  /// picture before, or the recording has no tissue.
  [[nodiscard]] bool Draw(render::Bitmap* picture);

  /// The replay, at the time of the last GoTo().
  [[nodiscard]] RenderReplay& replay() { return *replay_; }

  /// `follow` is called with the replay and the session time [s] after each message that is handed over from now on.
  void OnMessage(std::function<void(const RenderReplay&, double)> follow) { follow_ = std::move(follow); }

 private:
  void Begin();
  bool Read();

  const std::filesystem::path recording_;
  const SceneView& scene_;
  const render::Look look_;
  std::function<void(const RenderReplay&, double)> follow_;
  std::optional<RenderReplay> replay_;
  RecordedSpan span_;
  double at_s_ = 0;    ///< Where GoTo() went.
  double read_s_ = 0;  ///< Time of the newest message.
};

}  // namespace fulcrum::replay
