// The panel of the electrosurgical generator: what it is set to, by whoever turned a knob last.
#pragma once

#include <array>
#include <span>
#include <string>

#include "services/config/cart.h"
#include "services/core/messages.h"
#include "services/core/scene_view.h"

namespace fulcrum::supervisor {

class GeneratorPanel {
 public:
  /// @param start the cart's setting.
  /// @param script of a simulated operator, who turns the knobs to the power of each key with a pedal down as soon as
  /// the use before it is over, the first before the session begins. Empty: there is none. Must outlive the panel.
  GeneratorPanel(const config::GeneratorConfig& start, std::span<const ScriptKey> script);

  /// The simulated operator at a session time; times must not go back. A knob that the script leaves where it is stays
  /// where others have turned it. False: no knob was turned.
  bool Follow(double session_time_s);
  /// Session time of the key at which Follow turned a knob; negative: before all of them.
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
