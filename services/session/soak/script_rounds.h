// A scene's script over and over, for sessions longer than it.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::soak {

/// Between two rounds the tools go back to where they began, pedals up [s].
inline constexpr double kWayBack_s = 2;

/// `script`, which takes `round_s`, again and again until `total_s`.
/// @param script keys sorted by tool, then time. @pre round_s > 0.
[[nodiscard]] std::vector<ScriptKey> ScriptRounds(std::span<const ScriptKey> script, double round_s, double total_s);

/// Writes the compiled scene `from` with its script repeated until `total_s` into `to`. Throws InputError, also when
/// the scene has no script: nobody would do anything.
void WriteSceneOfRounds(const std::filesystem::path& from, double total_s, const std::filesystem::path& to);

}  // namespace fulcrum::soak
