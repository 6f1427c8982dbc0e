// The panel of the electrosurgical generator: the set power of each mode. The latest change of a knob is valid, whether
// a command or the script made it.
#pragma once

#include <array>
#include <span>
#include <string>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::supervisor {

class GeneratorPanel {
 public:
  /// @param start the cart's setting.
  /// @param script of a simulated operator; must outlive the panel. Each key with a pedal down sets the power of that
  /// pedal as soon as the use before it has ended; the first use sets it before the session begins. Empty: the script
  /// sets nothing.
  GeneratorPanel(const config::GeneratorConfig& start, std::span<const ScriptKey> script);

  /// Applies the script's changes up to a session time; times must not decrease. A knob that the script does not change
  /// keeps the value that a command has set. Returns false when no knob has changed.
  bool Follow(double session_time_s);
  /// Session time [s] of the script key at which Follow last changed a knob; negative: Follow has changed none.
  [[nodiscard]] double turned_s() const { return turned_s_; }

  /// Sets knobs from words such as "cut=40 coag=25" [W]; no words change nothing. Throws InputError on an invalid word
  /// and then changes no knob.
  void Turn(const std::string& words);

  /// The present setting, without a stamp.
  [[nodiscard]] const GeneratorSetting& setting() const { return setting_; }
  /// "cut 40 W, coag 25 W, blend 35 W".
  [[nodiscard]] std::string Text() const;

 private:
  using Powers = std::array<float, 3>;  ///< [W], in the order of kKnobs.
  [[nodiscard]] Powers Scripted(double session_time_s) const;

  std::span<const ScriptKey> script_;
  GeneratorSetting setting_;
  Powers scripted_{};  ///< Values of the knobs by the script.
  double turned_s_ = -1;
};

}  // namespace fulcrum::supervisor
