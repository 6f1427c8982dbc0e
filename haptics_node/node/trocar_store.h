// Trocar pivots measured by `haptics_node calibrate-trocar`: one file per cart and tool, in the user's state folder, so
// that they survive sessions and reinstallations.
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
  std::string serial;          ///< Serial number of the measuring device; empty for a simulated one.
  Vec3d p_DP = Vec3d::Zero();  ///< Pivot in frame D [m].
};
/// Loads a pivot; no value if the file does not exist. Throws InputError for an invalid file.
[[nodiscard]] std::optional<StoredTrocar> LoadTrocar(const std::filesystem::path& file);
/// Replaces the file as a whole. Throws InputError when it cannot be written.
void SaveTrocar(const std::filesystem::path& file, const std::string& serial, const PivotFit& fit);

}  // namespace fulcrum::haptics
