// Text of the picture: figures and warnings in its corners.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "render_node/input/window_input.h"
#include "render_node/scene_graph/overlay.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/suction.h"

namespace fulcrum::render {

enum class Alarm { kNone, kHot, kInjured };

struct HudState {
  double session_time_s = 0;
  std::uint8_t pedals = kPedalNone;
  float power_W = 0;                                    ///< Set power of the generator.
  std::array<std::optional<float>, kMaxTools> force_N;  ///< Force of the tissue on each tool; no value without it.
  std::array<TubeFlow, kMaxTools> flow{};               ///< Of a suction and irrigation tube.
  bool tube = false;                                    ///< The scene has one.
  float force_limit_N = 1;                              ///< Force that fills the bar; above it the bar is a warning.
  std::array<bool, kMaxTools> assists{};                ///< Held for the trainee: its bar is never a warning.
  std::optional<float> tip_C;  ///< Hottest texel of the newest patch; no value once the patch is old.
  float slit_m = 0;
  int clips = 0;              ///< On the tissue.
  bool clip_applier = false;  ///< The scene has one.
  Alarm ureter = Alarm::kNone, nerve = Alarm::kNone;
  std::vector<std::string> late;  ///< Texts for inputs that are late, such as "TISSUE HELD".
  float soil = 0;                 ///< Of the lens.
  bool paused = false;
  bool help = false;
  std::optional<HandsState> hands;  ///< No value: the window operates nothing.
  PadSettings gamepad;              ///< For the help.
};

/// The highest force that the scene allows: the score's limit, also where nothing is scored [N].
[[nodiscard]] float ForceLimit(const SceneView& scene);

/// Texts to draw: figures, and warnings at twice their size. With `figures` false warnings only.
[[nodiscard]] std::vector<OverlayText> HudTexts(const HudState& state, bool figures);

}  // namespace fulcrum::render
