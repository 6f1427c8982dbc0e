// The panel of the electrosurgical generator: the set power of each mode. The latest change of a knob is valid, whether
// a command or the script made it.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::supervisor {

class GeneratorPanel {
 public:
  /// @param start the cart's setting.
  /// @param script of a simulated operator. Each key with a pedal down sets the power of that
  /// pedal as soon as the use before it has ended; the first use sets it before the session begins. Empty: the script
  /// sets nothing.
  GeneratorPanel(const config::GeneratorConfig& start, std::span<const ScriptKey> script);

  /// Applies the script's changes up to a session time; times must not decrease. A knob that the script does not change
  /// keeps the value that a command has set. Returns false when no knob has changed.
  bool Follow(double session_time_s);
  /// Session time [s] of the script key at which Follow last changed a knob: the end of the use before. Negative:
  /// Follow has changed none.
  [[nodiscard]] double turned_s() const { return turned_s_; }

  /// Sets knobs from words such as "cut=40 coag=25" [W]; no words change nothing. Throws InputError on an invalid word
  /// and then changes no knob.
  void Turn(const std::string& words);

  /// The present setting, without a stamp.
  [[nodiscard]] const GeneratorSetting& setting() const { return setting_; }
  /// "cut 40 W, coag 25 W, blend 35 W".
  [[nodiscard]] std::string Text() const;

 private:
  /// Part of the script in which one pedal is down, in session time [s].
  struct Use {
    double begin_s, end_s;
    float power_W;
  };
  /// One knob as the script turns it: it stands at the power of the first use that has not ended, after the last use at
  /// that one's.
  struct Knob {
    std::vector<Use> uses;    ///< In the order of their beginnings.
    std::size_t current = 0;  ///< The first that has not ended. Only advances, so that a turn costs no more for a long
                              ///< script.
    float power_W = 0;
  };

  std::array<Knob, 3> knobs_;  ///< In the order of kKnobs.
  GeneratorSetting setting_;
  double turned_s_ = -1;
};

}  // namespace fulcrum::supervisor
