// The render node: draws pictures from the samples of its ports, in a window or in PNG files.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "render_node/geometry/camera_control.h"
#include "render_node/geometry/quality.h"
#include "render_node/node/hud.h"
#include "render_node/node/picture_outlet.h"
#include "render_node/node/stage.h"
#include "services/base/core/lens.h"
#include "services/base/core/pace.h"
#include "services/base/core/suction.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/histogram.h"
#include "services/transport/bus/input_account.h"
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
  bus::Input<ContactModel>& contact_models;  ///< For the force of the tissue on the tools.
  bus::Input<ClipState>& clips;
  bus::Output<OperatorInput>* operator_input;    ///< Null: the window operates nothing.
  bus::LoanOutput<Picture>* pictures = nullptr;  ///< Null: no live pictures.
  /// What every source does, this one included; not in Health, since each repeats its claim: what a slow picture loses
  /// of a fast mouse is no loss. Null: no other source operates.
  bus::Input<OperatorInput>* operators = nullptr;
};

struct RenderSettings {
  bool window = false;               ///< Draw into a window instead of memory.
  Quality quality = Quality::kAuto;  ///< Resolution of the scene.
  std::filesystem::path frames;      ///< Folder for the pictures; empty: no files.
  InputSettings inputs = {};         ///< Gamepads as hands.
  std::uint64_t keep_free_B = 0;     ///< Space that the pictures leave free on their disk [B].
  Look look = {};                    ///< Of a stage that the node makes.
};

class RenderNode {
 public:
  /// @param stage stage for the same scene and settings; null: the node makes it, with the exceptions of MakeStage().
  /// The arrays of `scene` and the ports must outlive the node.
  RenderNode(const SceneView& scene, const RenderSettings& settings, const RenderPorts& ports,
             std::unique_ptr<Stage> stage = nullptr);
  ~RenderNode();

  /// Reads the ports and draws if the picture will be used: in a window, or while the topic Picture has a reader, after
  /// each change, and with Quality::kHigh in software after the last one until edges are smooth
  /// (LaparoscopeView::Refine); otherwise if a PNG is due and something has changed since the last one. Else nothing is
  /// computed.
  void Step(const Tick& tick);

  /// Moves smoke and blood on to the time of the last Step, for steps that draw nothing: otherwise they make up at most
  /// 3 s when the next picture is drawn. Call from the thread of Step.
  void FollowEffects();

  /// Draws into `picture`, for a program that shows a recording. False, and nothing is drawn, when nothing has changed
  /// since the last picture or no tissue has come yet. Call from the thread of Step, after it.
  [[nodiscard]] bool DrawInto(Bitmap* picture);

  /// Draws the present state as another camera sees it, without text, smoothing and earlier pictures. Call from the
  /// thread of Step, after it.
  void DrawFrom(const RenderParams& camera, Bitmap* picture);

  /// What the next picture shows.
  [[nodiscard]] LaparoscopeView& view() { return view_; }
  [[nodiscard]] const RenderParams& camera() const { return camera_.params(); }
  [[nodiscard]] const ToolState& tools() const { return tools_; }
  [[nodiscard]] const HandleState& handles() const { return handles_; }

  /// Time between two steps. In a window the scene sets the wanted rate of pictures, the cart (`cart_ns`) the rate that
  /// the machine can reach, and the lower one is used. An operator's hand and readers of live pictures wait for theirs:
  /// then, and off screen, the cart's is used [ns].
  [[nodiscard]] std::int64_t PeriodNs(std::int64_t cart_ns) const;

  /// Acts as a key of the window (an X key symbol), before the next Step. Keys without a function are ignored.
  void Press(int key);

  /// Writes the last picture of the session if it differs from the last one written. Call after the last Step, from any
  /// thread.
  void Finish();
  /// Waits until the pictures drawn so far are written; for tests, a live node never waits for the disk. Call from the
  /// thread of Step.
  void WaitForFiles();
  [[nodiscard]] std::uint64_t pictures_drawn() const { return frames_drawn_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t pictures_written() const { return outlet_.files_written(); }

  /// Fills metrics and last error. May be called from any thread.
  void FillHealth(Health* health) const;

  /// True after the user has closed the window.
  [[nodiscard]] bool closed() const { return display_.closed(); }
  [[nodiscard]] std::string display_description() const { return display_.description(); }

 private:
  void TakeTissue();
  /// Instead of what follows while the picture is paused.
  void PassOver();
  void Apply(const TemperaturePatch& patch);
  void Apply(const ThermalEvent& event);
  void TakeClips();
  void TakeThermal();
  void TakeTools();
  void TakeHandles();
  /// Lets the valves of tubes follow a sample of the handles.
  void FollowValves();
  /// The camera of a scene with a scope is where the scope is.
  void FollowScope();
  [[nodiscard]] bool ready() const { return tissue_.header.stamp.sequence != 0; }
  void TakeEvents();
  void TakeGenerator();
  void TakeContact();
  void TakeForces();
  void TakeKeys();
  /// Follows the size of the window.
  void TakeSize();
  void UpdateHands();
  /// The window gives up the controls when another source has claimed them.
  void YieldHands();
  /// Where the pixels of the picture lie, and the tools are now.
  [[nodiscard]] HandsView ViewNow() const;
  [[nodiscard]] PictureHeader HeaderNow();
  void FindLate();
  [[nodiscard]] bool Recent(double time_s) const;
  void UpdateTexts();
  enum class ReadBack { kIfUsed, kAlways };
  void Draw(double session_time_s, bool write_png, ReadBack read = ReadBack::kIfUsed);
  void NoteLatency(double draw_ms);
  /// Highest temperature of what was hot lately; none if nothing was.
  [[nodiscard]] std::optional<float> HottestRecent() const {
    std::optional<float> hottest;
    for (const Heat& heat : heat_) {
      if (Recent(heat.time_s)) hottest = std::max(hottest.value_or(heat.highest_C), heat.highest_C);
    }
    return hottest;
  }
  void Report(const std::string& error);

  using PatchPlace = std::tuple<BurntSurface, std::uint32_t, std::uint32_t>;  // And origin in its atlas.
  [[nodiscard]] static PatchPlace PlaceOf(const TemperaturePatchHeader& header) {
    return {header.surface, header.origin_x, header.origin_y};
  }

  SceneView scene_;
  std::array<Vec3d, kMaxTools> roll_references_;  ///< Of the scene's tools.
  bool window_;
  RenderPorts ports_;
  std::unique_ptr<Stage> stage_;
  LaparoscopeView& view_;
  Display& display_;
  PixelBox shape_;  ///< Of the picture.
  PictureOutlet outlet_;
  QualityControl quality_;
  const bool smooths_;             // Pictures of a window and of live readers, while the scope rests.
  bus::Stamper operator_stamper_;  ///< Of the thread of hands_.
  std::unique_ptr<WindowInput> hands_;
  bus::Stamper picture_stamper_;
  bool streams_ = false;  // The topic Picture has a reader.

  TissueFrame tissue_, new_tissue_;
  TopologyState topology_;
  ClipState clips_;
  TemperaturePatch patch_;
  std::map<PatchPlace, TemperaturePatch> held_patches_;  // During a pause.
  std::vector<ThermalEvent> held_events_;                // The same.
  ToolState tools_, new_tools_;
  HandleState handles_, new_handles_;
  std::array<TrumpetValve, kMaxTools> valves_;
  ThermalEvent event_;
  CauteryContact contact_;
  ContactModel contact_model_;
  std::array<float, kMaxTools> force_N_{};  // Of the tissue on the tools.
  GeneratorSetting generator_;
  Bitmap picture_;
  HudState hud_;
  CameraControl camera_;
  Lens lens_;
  bool figures_;             // Figures are shown.
  int followed_ = -1;        // Tool that the camera follows; -1: none.
  bool screenshot_ = false;  // A screenshot is requested.
  // Session time of the last sample of each topic, and how long it may be silent. A topic is late if it has had samples
  // but none for kLate_s more than that.
  struct Arrival {
    const char* text;
    double time_s;
    double silence_s = 0;
  };
  Pace pace_;
  std::array<Arrival, 3> arrivals_{{{"TISSUE HELD", -1}, {"TOOLS HELD", -1}, {"HANDLES LATE", -1}}};
  double session_time_s_ = 0;
  double next_png_s_ = 0;
  struct Heat {
    double time_s = -1e9;  // Session time of the newest patch.
    float highest_C = 0;   // Hottest texel of that patch.
  };
  std::array<Heat, 2> heat_;                    // By BurntSurface.
  std::array<double, 2> warned_s_{-1e9, -1e9};  // Ureter and nerve: session time of the last warning …
  std::array<bool, 2> injured_{};               // … and whether one was an injury.
  bool changed_on_screen_ = false;              // Since the last picture that was drawn.
  bool changed_in_file_ = false;                // Since the last picture that was written.
  std::uint64_t drawn_tissue_ = 0;              // Sequence of the TissueFrame in the last picture.

  // Read by the health thread; the values are independent, so relaxed order is enough.
  std::atomic<std::uint64_t> frames_drawn_{0};
  std::atomic<std::uint64_t> patches_applied_{0};
  std::atomic<std::uint64_t> clips_dropped_{0};
  std::atomic<double> draw_ms_{0};
  runtime::Histogram motion_to_picture_;
  std::atomic<double> shed_m3_{0};
  std::atomic<double> scale_{1};
  mutable std::mutex error_mutex_;
  std::string error_;
};

}  // namespace fulcrum::render
