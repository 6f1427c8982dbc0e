// Calibrations that `handle_bridge calibrate` took, one file per unit: <serial number>.yaml in a folder of the user.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "handle_bridge/estimator/jaw_calibrator.h"

namespace fulcrum::handle_bridge {

/// $XDG_STATE_HOME/fulcrum/handles, by default ~/.local/state/fulcrum/handles: it outlives sessions, as the handles do.
[[nodiscard]] std::filesystem::path CalibrationFolder();

class CalibrationStore {
 public:
  /// Reads every file of the folder; a folder that is not there has none. Throws InputError that names file, key, value
  /// and valid range.
  static CalibrationStore Load(const std::filesystem::path& folder);
  /// Writes or replaces the unit's file, whole or not at all. Returns its path; throws std::runtime_error.
  static std::filesystem::path Save(const std::filesystem::path& folder, const std::string& unit,
                                    const CalibrationPoints& points);

  /// Units and folder, in one line for the log.
  [[nodiscard]] std::string Describe() const;
  /// Null when the unit has none. Without allocation.
  [[nodiscard]] const CalibrationPoints* Find(std::string_view unit) const noexcept;

 private:
  std::filesystem::path folder_;
  std::map<std::string, CalibrationPoints, std::less<>> units_;
};

}  // namespace fulcrum::handle_bridge
