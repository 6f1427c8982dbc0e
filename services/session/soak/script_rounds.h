// Repetition of a scene's script, for sessions that are longer than the script.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::soak {

/// Time between two rounds [s], in which the tools return to their first place with the pedals up.
inline constexpr double kWayBack_s = 2;

/// `script`, whose duration is `round_s`, repeated until `total_s`.
/// @param script keys sorted by tool, then time. @pre round_s > 0.
[[nodiscard]] std::vector<ScriptKey> ScriptRounds(std::span<const ScriptKey> script, double round_s, double total_s);

/// Writes the compiled scene `from` with its script repeated until `total_s` into `to`. Throws InputError, also when
/// the scene has no script, because no tool would move.
void WriteSceneOfRounds(const std::filesystem::path& from, double total_s, const std::filesystem::path& to);

}  // namespace fulcrum::soak
