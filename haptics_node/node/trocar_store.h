// Trocar pivots that `haptics_node calibrate-trocar` has measured: one file per cart and tool, in the user's state
// folder, so that they outlive sessions and installations.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "haptics_node/device/pivot_fit.h"
#include "services/base/core/types.h"

namespace fulcrum::haptics {

/// $XDG_STATE_HOME/fulcrum/trocars, by default ~/.local/state/fulcrum/trocars.
[[nodiscard]] std::filesystem::path TrocarFolder();

/// The file of one tool: <folder>/<cart>-tool<N>.yaml.
[[nodiscard]] std::filesystem::path TrocarFile(const std::filesystem::path& folder, const std::string& cart,
                                               std::size_t tool);

struct StoredTrocar {
  std::string serial;          ///< Of the device that measured it; empty for a simulated one.
  Vec3d p_DP = Vec3d::Zero();  ///< [m]
};
/// Nothing when there is no such file. Throws InputError for one that cannot be used.
[[nodiscard]] std::optional<StoredTrocar> LoadTrocar(const std::filesystem::path& file);
/// Replaces the file as a whole. Throws InputError when it cannot be written.
void SaveTrocar(const std::filesystem::path& file, const std::string& serial, const PivotFit& fit);

}  // namespace fulcrum::haptics
