// What the picture says in words: the figures in its corners.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "render_node/scene_graph/overlay.h"
#include "services/base/core/messages.h"

namespace fulcrum::render {

enum class Alarm { kNone, kHot, kInjured };

struct HudState {
  double session_time_s = 0;
  std::uint8_t pedals = kPedalNone;
  float power_W = 0;                                    ///< Asked of the generator.
  std::array<std::optional<float>, kMaxTools> force_N;  ///< At each tool that is there.
  float force_limit_N = 1;                              ///< A full bar.
  std::optional<float> tip_C;                           ///< Hottest texel of the newest patch, while it is new.
  float slit_m = 0;
  Alarm ureter = Alarm::kNone, nerve = Alarm::kNone;
  std::vector<std::string> late;  ///< What has not come for a while: "TISSUE HELD".
  bool paused = false;
  bool help = false;
};

/// Figures, and at twice their size what must not be overlooked. With `figures` false only the latter.
[[nodiscard]] std::vector<OverlayText> HudTexts(const HudState& state, bool figures);

}  // namespace fulcrum::render
