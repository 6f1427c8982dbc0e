// What a hand makes of a script: a person trembles, strays, hesitates, and is late with pedal and jaw. A script that is
// performed by such a hand is an ordinary script with many keys; nothing else knows of it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

struct OperatorHand {
  double tremor_m = 0;     ///< RMS of each coordinate, 8 to 12 Hz: physiological tremor.
  double drift_m = 0;      ///< RMS of each coordinate, 0.2 to 0.8 Hz: the hand is not where it is meant to be.
  double hesitation = 0;   ///< 0 to 0.9: the speed varies by this share, at about 0.7 Hz.
  double lag_s = 0;        ///< Tools behind the script.
  double pedal_lag_s = 0;  ///< Pedals behind the tools: down late, up late.
  double jaw_lag_s = 0;    ///< Jaws behind the tools.
  double roll_rad = 0;     ///< RMS of the turn of a held scope about its shaft, 0.2 to 0.8 Hz: the horizon tilts.
  std::uint32_t seed = 0;  ///< Of the phases, and of a variation of all values by up to a quarter.
};

/// "expert" or "novice"; nullopt: another name. The sizes are assumed: an expert's tremor at the tip of a laparoscopic
/// instrument is a tenth of a millimetre, a novice's several times that.
[[nodiscard]] std::optional<OperatorHand> HandNamed(std::string_view name);
inline constexpr std::string_view kHandNames = "expert, novice";

/// The script as this hand performs it, a key each 20 ms, with the same seed the same. @param script sorted by tool,
/// then time. @param scopes bit per tool: it is a scope.
[[nodiscard]] std::vector<ScriptKey> Perform(std::span<const ScriptKey> script, const OperatorHand& hand,
                                             double duration_s, std::uint32_t scopes = 0);

}  // namespace fulcrum::scene
