#include "services/session/supervisor/generator_panel.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <sstream>
#include <string_view>

#include "services/base/core/error.h"
#include "services/base/core/generator_inputs.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {
namespace {

struct PanelKnob {
  std::string_view name;
  CauteryMode mode;
  float GeneratorSetting::*power_W;
};
constexpr std::array<PanelKnob, 3> kKnobs{{{"cut", CauteryMode::kCut, &GeneratorSetting::cut_W},
                                           {"coag", CauteryMode::kCoag, &GeneratorSetting::coag_W},
                                           {"blend", CauteryMode::kBlend, &GeneratorSetting::blend_W}}};

[[noreturn]] void Refuse(const std::string& word, const std::string& why) {
  throw InputError("generator: \"" + word + "\" " + why + "; valid: cut=W, coag=W, blend=W with 0 to " +
                   Fixed(static_cast<double>(kMaxSetPower_W), 0) + " W, for example cut=40 coag=25");
}

}  // namespace

GeneratorPanel::GeneratorPanel(const config::GeneratorConfig& start, std::span<const ScriptKey> script) {
  setting_.cut_W = start.cut_W;
  setting_.coag_W = start.coag_W;
  setting_.blend_W = start.blend_W;
  for (std::size_t i = 0; i < script.size(); ++i) {
    const ScriptKey& key = script[i];
    if (!(key.power_W > 0)) continue;
    const bool last = i + 1 == script.size() || script[i + 1].tool != key.tool;
    const double end_s = last ? std::numeric_limits<double>::infinity() : static_cast<double>(script[i + 1].time_s);
    const CauteryMode mode = ModeOf(static_cast<std::uint8_t>(key.pedals));
    for (std::size_t knob = 0; knob < kKnobs.size(); ++knob) {
      if (mode == kKnobs[knob].mode) {
        knobs_[knob].uses.push_back({static_cast<double>(key.time_s), end_s, key.power_W});
      }
    }
  }
  for (std::size_t knob = 0; knob < kKnobs.size(); ++knob) {
    knobs_[knob].power_W = setting_.*kKnobs[knob].power_W;
    // The script is sorted by tool, then time.
    std::ranges::stable_sort(knobs_[knob].uses, {}, &Use::begin_s);
  }
  Follow(-1);
}

bool GeneratorPanel::Follow(double session_time_s) {
  bool turned = false;
  for (std::size_t i = 0; i < kKnobs.size(); ++i) {
    Knob& knob = knobs_[i];
    double ended_s = -1;
    while (knob.current < knob.uses.size() && knob.uses[knob.current].end_s <= session_time_s) {
      ended_s = std::max(ended_s, knob.uses[knob.current++].end_s);
    }
    if (knob.current == knob.uses.size() || knob.uses[knob.current].power_W == knob.power_W) continue;
    knob.power_W = knob.uses[knob.current].power_W;
    setting_.*kKnobs[i].power_W = knob.power_W;
    turned_s_ = turned ? std::max(turned_s_, ended_s) : ended_s;
    turned = true;
  }
  return turned;
}

void GeneratorPanel::Turn(const std::string& words) {
  GeneratorSetting wanted = setting_;
  std::istringstream in(words);
  for (std::string word; in >> word;) {
    const std::size_t equals = word.find('=');
    const PanelKnob* knob = nullptr;
    for (const PanelKnob& known : kKnobs) {
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
  for (const PanelKnob& knob : kKnobs) {
    const auto power_W = static_cast<double>(setting_.*knob.power_W);
    text.append(text.empty() ? "" : ", ").append(knob.name).append(" ");
    text += Fixed(power_W, power_W == static_cast<int>(power_W) ? 0 : 1) + " W";
  }
  return text;
}

}  // namespace fulcrum::supervisor
