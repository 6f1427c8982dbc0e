// The panel of the electrosurgical generator: the power of each mode. The last change of a knob counts, whether it
// comes from a command or from the script.
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

  /// Sets what the script says at a session time; times must not go back. A knob that the script does not change keeps
  /// what a command has set. False: no knob has changed.
  bool Follow(double session_time_s);
  /// Session time of the key at which Follow changed a knob; negative: before all of them.
  [[nodiscard]] double turned_s() const { return turned_s_; }

  /// Turns knobs by words such as "cut=40 coag=25" [W]; no words: none. Throws InputError, and nothing is turned.
  void Turn(const std::string& words);

  /// Without a stamp.
  [[nodiscard]] const GeneratorSetting& setting() const { return setting_; }
  /// "cut 40 W, coag 25 W, blend 35 W".
  [[nodiscard]] std::string Text() const;

 private:
  using Powers = std::array<float, 3>;  ///< By kKnobs.
  [[nodiscard]] Powers Scripted(double session_time_s) const;

  std::span<const ScriptKey> script_;
  GeneratorSetting setting_;
  Powers scripted_{};  ///< Where the script has the knobs.
  double turned_s_ = -1;
};

}  // namespace fulcrum::supervisor
