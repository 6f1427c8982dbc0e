// The render node: what the bus says becomes a picture, in a window or in PNG files.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "render_node/geometry/camera_control.h"
#include "render_node/geometry/quality.h"
#include "render_node/node/hud.h"
#include "render_node/node/stage.h"
#include "render_node/offscreen/png_writer.h"
#include "services/base/core/tick.h"
#include "services/transport/bus/port.h"

namespace fulcrum::render {

struct RenderPorts {
  bus::Input<TissueFrame>& tissue;
  bus::Input<TopologyState>& topology;
  bus::Input<TemperaturePatch>& patches;
  bus::Input<ToolState>& tools;
  bus::Input<HandleState>& handles;
  bus::Input<ThermalEvent>& events;
  bus::Input<CauteryContact>& contacts;
  bus::Input<GeneratorSetting>& generator;
};

struct RenderSettings {
  bool window = false;               ///< A real window instead of drawing into memory.
  Quality quality = Quality::kAuto;  ///< How finely the scene is drawn.
  std::filesystem::path frames;      ///< Folder for the pictures.
};

class RenderNode {
 public:
  /// @param stage of the same scene and settings; makes its own, and throws what that throws, when there is none. The
  /// arrays of `scene` and the ports must outlive the node.
  RenderNode(const SceneView& scene, const RenderSettings& settings, const RenderPorts& ports,
             std::unique_ptr<Stage> stage = nullptr);
  ~RenderNode();

  /// Takes what has come and draws when somebody will see it: in a window whenever something changed, off screen when
  /// a PNG is due and something changed since the last one. Otherwise nothing is computed.
  void Step(const Tick& tick);

  /// As a key of the window (an X key symbol), before the next Step; a key that means nothing does nothing.
  void Press(int key);

  /// The last picture of the session, when it differs from the last one written. After the last Step, any thread.
  void Finish();
  /// Until the pictures drawn so far are in their files; live nobody waits for a disk. Same thread as Step.
  void WaitForFiles() { writer_.Wait(); }
  [[nodiscard]] std::uint64_t pictures_drawn() const { return frames_drawn_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t pictures_written() const { return writer_.written(); }

  /// Metrics and last error. Any thread.
  void FillHealth(Health* health) const;

  /// The user closed the window.
  [[nodiscard]] bool closed() const { return display_.closed(); }
  [[nodiscard]] std::string display_description() const { return display_.description(); }

 private:
  void TakeTissue();
  void TakeThermal();
  void TakeTools();
  [[nodiscard]] bool ready() const { return tissue_.header.stamp.sequence != 0; }
  void TakeEvents();
  void TakeGenerator();
  void TakeContact();
  void TakeKeys();
  void FindLate();
  [[nodiscard]] bool Recent(double time_s) const;
  void UpdateTexts();
  void Draw(double session_time_s, bool write_png);
  void Report(const std::string& error);

  SceneView scene_;
  bool window_;
  RenderPorts ports_;
  std::unique_ptr<Stage> stage_;
  LaparoscopeView& view_;
  Display& display_;
  FrameWriter writer_;
  QualityControl quality_;

  TissueFrame tissue_, new_tissue_;
  TopologyState topology_;
  TemperaturePatch patch_;
  ToolState tools_, new_tools_;
  HandleState handles_, new_handles_;
  ThermalEvent event_;
  CauteryContact contact_;
  GeneratorSetting generator_;
  Picture picture_;
  HudState hud_;
  CameraControl camera_;
  bool figures_;             // The HUD is on.
  int followed_ = -1;        // Tool that the camera is locked on.
  bool screenshot_ = false;  // One is wanted.
  // Session time at which each topic last came: what has come once and then not for a while is late.
  struct Arrival {
    const char* text;
    double time_s;
  };
  std::array<Arrival, 3> arrivals_{{{"TISSUE HELD", -1}, {"TOOLS HELD", -1}, {"HANDLES LATE", -1}}};
  double session_time_s_ = 0;
  double next_png_s_ = 0;
  double temperature_time_s_ = -1e9;            // When the newest patch came.
  float temperature_C_ = 0;                     // Its hottest texel.
  std::array<double, 2> warned_s_{-1e9, -1e9};  // Ureter and nerve: session time of the last warning …
  std::array<bool, 2> injured_{};               // … and whether one was an injury.
  bool changed_on_screen_ = false;              // Since the last picture that was drawn.
  bool changed_in_file_ = false;                // Since the last picture that was written.

  // Read by the health thread; each stands for itself, so relaxed order is enough.
  std::atomic<std::uint64_t> frames_drawn_{0};
  std::atomic<std::uint64_t> pictures_dropped_{0};
  std::atomic<std::uint64_t> patches_applied_{0};
  std::atomic<double> draw_ms_{0};
  std::atomic<double> scale_{1};
  mutable std::mutex error_mutex_;
  std::string error_;
};

}  // namespace fulcrum::render
