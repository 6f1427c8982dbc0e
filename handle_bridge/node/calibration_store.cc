#include "handle_bridge/node/calibration_store.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "handle_bridge/estimator/jaw_calibration.h"
#include "handle_bridge/protocol/jaw_line.h"
#include "services/base/config/strict_yaml.h"

namespace fulcrum::handle_bridge {
namespace {

namespace fs = std::filesystem;
using config::Range;

/// Valid file name for any serial number.
std::string FileName(const std::string& unit) {
  std::string name = unit;
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_' && c != ':' && c != '.'; }, '_');
  return name + ".yaml";
}

std::string Quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "''" : std::string(1, c);
  }
  return quoted + "'";
}

std::string List(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    char number[32];
    std::snprintf(number, sizeof(number), "%s%.3f", text.empty() ? "" : ", ", value);
    text += number;
  }
  return "[" + text + "]";
}

}  // namespace

fs::path CalibrationFolder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state != '\0') {
    return fs::path(state) / "fulcrum" / "handles";
  }
  const char* home = std::getenv("HOME");
  return (home != nullptr ? fs::path(home) / ".local" / "state" : fs::path("/var/lib")) / "fulcrum" / "handles";
}

CalibrationStore CalibrationStore::Load(const fs::path& folder) {
  CalibrationStore store;
  store.folder_ = folder;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".yaml") {
      continue;
    }
    config::StrictYaml file = config::StrictYaml::FromFile(entry.path());
    config::StrictMap root = file.root();
    const std::string unit = root.Text("unit");
    CalibrationPoints points;
    points.codes = root.Numbers("codes", 2, JawCalibration::kMaxPoints, Range::Between(0, kMaxCode));
    points.angles_deg = root.Numbers("angles_deg", 2, JawCalibration::kMaxPoints, Range::Between(-10, 120));
    file.Finish();
    try {
      JawCalibration(points.codes, points.angles_deg);
    } catch (const std::invalid_argument& refused) {
      root.Fail("codes", refused.what());
    }
    store.units_[unit] = std::move(points);
  }
  return store;
}

fs::path CalibrationStore::Save(const fs::path& folder, const std::string& unit, const CalibrationPoints& points) {
  fs::create_directories(folder);
  fs::path path = folder / FileName(unit);
  const fs::path draft = path.string() + ".new";
  {
    std::ofstream out(draft);
    out << "# Measured by `handle_bridge calibrate`: jaw angles at codes of the converter.\n"
        << "unit: " << Quoted(unit) << "\n"
        << "codes: " << List(points.codes) << "\n"
        << "angles_deg: " << List(points.angles_deg) << "\n";
    out.flush();
    if (!out) {
      throw std::runtime_error("cannot write " + draft.string());
    }
  }
  fs::rename(draft, path);
  return path;
}

std::string CalibrationStore::Describe() const {
  std::string units;
  for (const auto& [unit, points] : units_) {
    units += (units.empty() ? " " : ", ") + unit;
  }
  return units.empty() ? "no stored calibrations in " + folder_.string() + ": the cart's are used"
                       : "stored calibrations in " + folder_.string() + ":" + units;
}

const CalibrationPoints* CalibrationStore::Find(std::string_view unit) const noexcept {
  const auto found = units_.find(unit);
  return found == units_.end() ? nullptr : &found->second;
}

}  // namespace fulcrum::handle_bridge
