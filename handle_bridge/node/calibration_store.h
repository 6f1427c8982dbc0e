// Calibrations measured by `handle_bridge calibrate`, one file per unit: <serial number>.yaml in the user's state
// folder.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "handle_bridge/estimator/jaw_calibrator.h"

namespace fulcrum::handle_bridge {

/// $XDG_STATE_HOME/fulcrum/handles, by default ~/.local/state/fulcrum/handles: it survives sessions.
[[nodiscard]] std::filesystem::path CalibrationFolder();

class CalibrationStore {
 public:
  /// Reads every file of the folder; a missing folder counts as empty. Throws InputError that names file, key, value
  /// and valid range.
  static CalibrationStore Load(const std::filesystem::path& folder);
  /// Writes or replaces the unit's file atomically. Returns its path; throws std::runtime_error.
  static std::filesystem::path Save(const std::filesystem::path& folder, const std::string& unit,
                                    const CalibrationPoints& points);

  /// Units and folder, as one line for the log.
  [[nodiscard]] std::string Describe() const;
  /// Calibration of a unit; null if there is none. Does not allocate.
  [[nodiscard]] const CalibrationPoints* Find(std::string_view unit) const noexcept;

 private:
  std::filesystem::path folder_;
  std::map<std::string, CalibrationPoints, std::less<>> units_;
};

}  // namespace fulcrum::handle_bridge
