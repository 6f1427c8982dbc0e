// render_node on a recording: the class that draws a session, on the recorded topics and their clock.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "render_node/node/render_node.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

class RenderReplay {
 public:
  /// `scene` must outlive it. Throws InputError, and std::runtime_error when OpenGL is missing.
  RenderReplay(const std::filesystem::path& recording, const SceneView& scene, const render::RenderSettings& settings);
  ~RenderReplay();
  RenderReplay(const RenderReplay&) = delete;
  RenderReplay& operator=(const RenderReplay&) = delete;

  /// Hands the next message that the node reads to its ports. Returns the session time of the newest message so far
  /// [s], or nullopt at the end of the recording. Throws MismatchError for a recording of another scene.
  [[nodiscard]] std::optional<double> Next();

  /// CLOCK_MONOTONIC at session time 0 [ns]; valid after Next() has returned a time.
  [[nodiscard]] std::int64_t session_start_ns() const;

  /// The newest messages handed over so far. Next() hands over one, so that none is missed between two calls.
  [[nodiscard]] const HandleState& handles() const;
  [[nodiscard]] const GeneratorSetting& generator() const;
  [[nodiscard]] const ThermalEvent& event() const;
  [[nodiscard]] const ContactModel& contact_model() const;

  /// One step of the node with the messages handed over so far.
  void Step(double time_s);

  [[nodiscard]] render::RenderNode& node();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::replay
