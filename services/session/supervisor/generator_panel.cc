#include "services/session/supervisor/generator_panel.h"

#include <charconv>
#include <limits>
#include <sstream>
#include <string_view>

#include "services/base/core/error.h"
#include "services/base/core/generator_inputs.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {
namespace {

struct Knob {
  std::string_view name;
  CauteryMode mode;
  float GeneratorSetting::*power_W;
};
constexpr std::array<Knob, 3> kKnobs{{{"cut", CauteryMode::kCut, &GeneratorSetting::cut_W},
                                      {"coag", CauteryMode::kCoag, &GeneratorSetting::coag_W},
                                      {"blend", CauteryMode::kBlend, &GeneratorSetting::blend_W}}};

[[noreturn]] void Refuse(const std::string& word, const std::string& why) {
  throw InputError("generator: \"" + word + "\" " + why + "; valid: cut=W, coag=W, blend=W with 0 to " +
                   Fixed(static_cast<double>(kMaxSetPower_W), 0) + " W, for example cut=40 coag=25");
}

}  // namespace

GeneratorPanel::GeneratorPanel(const config::GeneratorConfig& start, std::span<const ScriptKey> script)
    : script_(script) {
  setting_.cut_W = start.cut_W;
  setting_.coag_W = start.coag_W;
  setting_.blend_W = start.blend_W;
  for (std::size_t i = 0; i < kKnobs.size(); ++i) scripted_[i] = setting_.*kKnobs[i].power_W;
  Follow(-1);
}

/// Power of each mode at a session time: that of the current use of its pedal, else of the next use, else of the last.
GeneratorPanel::Powers GeneratorPanel::Scripted(double session_time_s) const {
  Powers powers = scripted_;
  for (std::size_t knob = 0; knob < kKnobs.size(); ++knob) {
    double next_s = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < script_.size(); ++i) {
      const ScriptKey& key = script_[i];
      if (ModeOf(static_cast<std::uint8_t>(key.pedals)) != kKnobs[knob].mode || !(key.power_W > 0)) continue;
      const bool last = i + 1 == script_.size() || script_[i + 1].tool != key.tool;
      const double end_s = last ? std::numeric_limits<double>::infinity() : static_cast<double>(script_[i + 1].time_s);
      const auto begin_s = static_cast<double>(key.time_s);
      if (end_s <= session_time_s || begin_s >= next_s) continue;
      next_s = begin_s;
      powers[knob] = key.power_W;
    }
  }
  return powers;
}

bool GeneratorPanel::Follow(double session_time_s) {
  const Powers wanted = Scripted(session_time_s);
  bool turned = false;
  for (std::size_t i = 0; i < kKnobs.size(); ++i) {
    if (wanted[i] == scripted_[i]) continue;
    setting_.*kKnobs[i].power_W = wanted[i];
    turned = true;
  }
  if (!turned) return false;
  scripted_ = wanted;
  turned_s_ = -1;
  for (const ScriptKey& key : script_) {
    const auto key_s = static_cast<double>(key.time_s);
    if (key_s <= session_time_s && key_s > turned_s_) turned_s_ = key_s;
  }
  return true;
}

void GeneratorPanel::Turn(const std::string& words) {
  GeneratorSetting wanted = setting_;
  std::istringstream in(words);
  for (std::string word; in >> word;) {
    const std::size_t equals = word.find('=');
    const Knob* knob = nullptr;
    for (const Knob& known : kKnobs) {
      if (equals != std::string::npos && known.name == std::string_view(word).substr(0, equals)) knob = &known;
    }
    if (knob == nullptr) Refuse(word, "names no knob");
    float power_W = 0;
    const char *begin = word.data() + equals + 1, *end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(begin, end, power_W);
    if (error != std::errc() || rest != end) Refuse(word, "is no power");
    if (!(power_W >= 0 && power_W <= kMaxSetPower_W)) Refuse(word, "is out of range");
    wanted.*knob->power_W = power_W;
  }
  setting_ = wanted;
}

std::string GeneratorPanel::Text() const {
  std::string text;
  for (const Knob& knob : kKnobs) {
    const auto power_W = static_cast<double>(setting_.*knob.power_W);
    text.append(text.empty() ? "" : ", ").append(knob.name).append(" ");
    text += Fixed(power_W, power_W == static_cast<int>(power_W) ? 0 : 1) + " W";
  }
  return text;
}

}  // namespace fulcrum::supervisor
