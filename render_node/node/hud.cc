#include "render_node/node/hud.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "services/base/core/generator_inputs.h"

namespace fulcrum::render {
namespace {

/// Tools by their place: left and right of the surgeon, and the assistant's.
constexpr std::array<const char*, kMaxTools> kShort{"L", "R", "3", "4"};
constexpr std::array<const char*, kMaxTools> kNames{"LEFT TOOL", "RIGHT TOOL", "TOOL 3", "TOOL 4"};
constexpr float kSoiled = 0.3f;  // Of the lens: above it the picture says what to do.
constexpr int kBar = 10;         // Length of the force bar [characters].

std::string Number(const char* format, double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string ForceBar(int tool, float force_N, float limit_N) {
  const int full = std::clamp(static_cast<int>(std::ceil(kBar * force_N / limit_N - 0.05f)), 0, kBar);
  std::string bar = std::string(kShort[static_cast<std::size_t>(tool)]) + " ";
  for (int k = 0; k < kBar; ++k) bar += k < full ? "▮" : "▯";
  return bar + Number(" %.1f N", force_N);
}

const char* NameOf(TubeFlow flow) {
  return flow == TubeFlow::kAspirates ? " SUCTION" : flow == TubeFlow::kIrrigates ? " IRRIGATION" : "";
}

const char* NameOf(CauteryMode mode) {
  switch (mode) {
    case CauteryMode::kCut:
      return "CUT";
    case CauteryMode::kBlend:
      return "BLEND";
    case CauteryMode::kCoag:
      return "COAG";
    case CauteryMode::kOff:
      break;
  }
  return "";
}

std::string InCapitals(std::string_view name) {
  std::string text(name);
  for (char& c : text) c = c == '_' ? ' ' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// What the gamepad does, a line each.
std::vector<std::string> PadHelp(const PadSettings& settings) {
  std::vector<std::string> lines;
  constexpr std::array kMotions{"RIGHT", "UP", "DEEPER"};
  for (std::size_t i = 0; i < kMotions.size(); ++i) {
    const auto& way = settings.motion[i];
    if (way) lines.push_back((way->sign < 0 ? "-" : "") + InCapitals(PadAxisName(way->axis)) + ": " + kMotions[i]);
  }
  for (std::size_t i = 0; i < kPadActions; ++i) {
    if (!settings.buttons[i]) continue;
    lines.push_back(InCapitals(PadButtonName(*settings.buttons[i])) + ": " +
                    InCapitals(PadActionName(static_cast<PadAction>(i))));
  }
  return lines;
}

}  // namespace

float ForceLimit(const SceneView& scene) {
  constexpr float kLeast_N = 0.1f;  // Resolution of the figure; a scene may allow 0.
  return std::max(kLeast_N, scene.assessment.limit[static_cast<std::size_t>(Measure::kPeakForce)]);
}

std::vector<OverlayText> HudTexts(const HudState& state, bool figures) {
  std::vector<OverlayText> texts;
  int line = 0;
  for (const auto& [alarm, name] : {std::pair{state.ureter, "URETER"}, {state.nerve, "NERVE"}}) {
    if (alarm != Alarm::kNone) {
      texts.push_back({Corner::kTopRight, line, name, true, 2});
      texts.push_back({Corner::kTopRight, line + 1, alarm == Alarm::kInjured ? "INJURED" : "HOT!", true, 2});
      line += 2;
    }
  }
  int right = 2 * line;
  if (state.help && state.hands && state.hands->gamepad) {
    for (const std::string& text : PadHelp(state.gamepad)) texts.push_back({Corner::kTopRight, right++, text});
  }
  line = 0;
  for (const std::string& late : state.late) {
    texts.push_back({Corner::kTopLeft, ++line, late, true});
  }
  if (state.soil > kSoiled) {
    texts.push_back({Corner::kTopLeft, ++line, "LENS SOILED: DRAW THE SCOPE BACK", true});
  }
  if (state.paused) {
    texts.push_back({Corner::kTopLeft, ++line, "PAUSED", true});
  }
  const auto take = state.hands && state.hands->gamepad
                        ? state.gamepad.buttons[static_cast<std::size_t>(PadAction::kTake)]
                        : std::nullopt;
  if (state.hands && !state.hands->active) {
    texts.push_back(
        {Corner::kTopLeft, ++line,
         "CLICK" + (take ? ", ENTER OR " + InCapitals(PadButtonName(*take)) : " OR ENTER") + ": TAKE THE TOOLS", true});
  } else if (state.hands) {
    texts.push_back({Corner::kTopLeft, ++line,
                     std::string(state.hands->scope ? "SCOPE" : kNames[static_cast<std::size_t>(state.hands->tool)]) +
                         (!state.hands->locked ? ""
                          : state.hands->scope ? ", ZOOMED"
                                               : ", JAW LOCKED") +
                         (state.hands->steady ? ", STEADY" : "")});
  }
  if (state.help && state.hands) {
    for (const std::string_view key : {"MOUSE MOVE", "WHEEL, CTRL DEPTH", "LEFT BUTTON, J JAW", "K LOCK JAW",
                                       "RIGHT BUTTON, F CUT", "MIDDLE BUTTON, G COAG", "1 2 3 4 TOOL, SCOPE",
                                       "Q E TURN THE TOOL", "SPACE CLUTCH", "SHIFT FINE", "V STEADY", "ESC RELEASE"}) {
      texts.push_back({Corner::kTopLeft, ++line, std::string(key)});
    }
  }
  if (state.help && state.hands && state.tube) {
    for (const std::string_view key : {"TUBE: HOLD THE JAW: SUCTION", "TWICE, THEN HOLD: IRRIGATION"}) {
      texts.push_back({Corner::kTopLeft, ++line, std::string(key)});
    }
  }
  if (state.help && state.hands && state.clip_applier) {
    for (const std::string_view key : {"CLIP APPLIER: CLOSE THE JAW: CLIP", "OPEN IT: LET GO"}) {
      texts.push_back({Corner::kTopLeft, ++line, std::string(key)});
    }
  }
  if (state.help) {
    for (const std::string_view key :
         {"ARROWS TURN", "+ - NEARER, FARTHER", "R T ROLL", "0 RESET VIEW", "L LOCK ON TOOL", "S SCREENSHOT", "P PAUSE",
          "U FIGURES", "F11 FULL SCREEN", "H HELP"}) {
      texts.push_back({Corner::kTopRight, right++, std::string(key)});
    }
  }
  if (!figures) {
    return texts;
  }
  texts.push_back({Corner::kTopLeft, 0, Number("%.1f s", state.session_time_s)});
  line = 0;
  for (int tool = kMaxTools - 1; tool >= 0; --tool) {
    if (const auto& force_N = state.force_N[static_cast<std::size_t>(tool)]) {
      const std::string does = NameOf(state.flow[static_cast<std::size_t>(tool)]);
      texts.push_back({Corner::kBottomLeft, line++, ForceBar(tool, *force_N, state.force_limit_N) + does,
                       *force_N > state.force_limit_N && !state.assists[static_cast<std::size_t>(tool)]});
    }
  }
  if (const std::string mode = NameOf(ModeOf(state.pedals)); !mode.empty()) {
    texts.push_back({Corner::kBottomLeft, line, state.power_W > 0 ? mode + Number(" %.0f W", state.power_W) : mode});
  }
  line = 0;
  if (state.slit_m > 0) {
    texts.push_back({Corner::kBottomRight, line++, Number("SLIT %.0f mm", 1000.0 * state.slit_m)});
  }
  if (state.tip_C) {
    texts.push_back({Corner::kBottomRight, line++, Number("TIP %.0f °C", *state.tip_C)});
  }
  if (state.clips > 0) texts.push_back({Corner::kBottomRight, line, Number("CLIPS %.0f", state.clips)});
  return texts;
}

}  // namespace fulcrum::render
