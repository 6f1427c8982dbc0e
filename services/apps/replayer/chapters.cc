#include "services/apps/replayer/chapters.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/generator_inputs.h"

namespace fulcrum::replay {
namespace {

/// Strokes that follow each other sooner are one chapter.
constexpr double kPause_s = 2;

std::string Used(CauteryMode mode, float power_W) {
  const std::string power = " at " + std::to_string(std::lround(power_W)) + " W";
  switch (mode) {
    case CauteryMode::kCut:
      return "cut" + power;
    case CauteryMode::kCoag:
      return "coagulation" + power;
    case CauteryMode::kBlend:
      return "blend" + power;
    case CauteryMode::kOff:
      break;
  }
  return {};
}

const char* Alarm(ThermalEventKind kind) {
  switch (kind) {
    case ThermalEventKind::kUreterWarning:
      return "heat near the ureter";
    case ThermalEventKind::kUreterInjury:
      return "ureter injured";
    case ThermalEventKind::kNerveWarning:
      return "heat near the nerve";
    case ThermalEventKind::kNerveInjury:
      return "nerve injured";
    case ThermalEventKind::kSolidBurn:
      return "organ burnt";
    default:
      return "";
  }
}

}  // namespace

void Chapters::Follow(double time_s, const HandleState& handles, const GeneratorSetting& generator,
                      const ThermalEvent& event) {
  time_s = std::max(0.0, time_s);  // A pedal may be down before the session begins.
  const CauteryMode mode = ModeOf(handles.pedals);
  if (const float power_W = PowerOf(generator, mode); power_W > 0) Note(time_s, Used(mode, power_W));
  if (event.stamp.epoch == event_epoch_ && event.stamp.sequence == event_sequence_) return;
  event_epoch_ = event.stamp.epoch;
  event_sequence_ = event.stamp.sequence;
  Note(time_s, Alarm(event.kind));
}

void Chapters::Note(double time_s, const std::string& title) {
  if (title.empty()) return;
  const auto [last, is_new] = last_s_.try_emplace(title, time_s);
  if (is_new || time_s > last->second + kPause_s) list_.push_back({time_s, title});
  last->second = time_s;
}

}  // namespace fulcrum::replay
