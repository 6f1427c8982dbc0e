#include "haptics_node/node/trocar_store.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <system_error>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"

namespace fulcrum::haptics {
namespace {

namespace fs = std::filesystem;
using config::Range;

}  // namespace

fs::path TrocarFolder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state != '\0') return fs::path(state) / "fulcrum" / "trocars";
  const char* home = std::getenv("HOME");
  return (home != nullptr ? fs::path(home) / ".local" / "state" : fs::path("/var/lib")) / "fulcrum" / "trocars";
}

fs::path TrocarFile(const fs::path& folder, const std::string& cart, std::size_t tool) {
  std::string name = cart;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '_'; }, '_');
  return folder / (name + "-tool" + std::to_string(tool) + ".yaml");
}

std::optional<StoredTrocar> LoadTrocar(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::nullopt;
  config::StrictYaml yaml = config::StrictYaml::FromFile(file);
  config::StrictMap root = yaml.root();
  StoredTrocar stored;
  stored.serial = root.TextOr("serial", "");
  stored.p_DP = Vec3d(root.NumbersSi("trocar_mm", 3, 3, Range::Between(-1000, 1000)).data());
  // Quality of the fit, for persons who read the file; checked, not used. A fit that is not good enough is not stored.
  root.NumberSi("residual_mm", Range::Between(0, 1e3 * kMaxPivotResidual_m));
  root.Number("condition", Range::Between(1, kMaxPivotCondition));
  root.NumberSi("swing_deg", Range::Between(0, 90));
  root.Integer("poses", static_cast<std::int64_t>(kMinPivotPoses), 1'000'000);
  yaml.Finish();
  return stored;
}

void SaveTrocar(const fs::path& file, const std::string& serial, const PivotFit& fit) {
  std::array<char, 512> text{};
  const Vec3d p_mm = 1e3 * fit.p_DP;
  std::snprintf(text.data(), text.size(),
                "trocar_mm: [%.3f, %.3f, %.3f]   # in the frame of the device\n"
                "residual_mm: %.3f\ncondition: %.2f\nswing_deg: %.2f\nposes: %zu\n",
                p_mm.x(), p_mm.y(), p_mm.z(), 1e3 * fit.residual_m, fit.condition,
                fit.swing_rad * 180 / std::numbers::pi, fit.poses);
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  const fs::path draft = file.string() + ".new";
  {
    std::ofstream out(draft);
    out << "# Measured by `haptics_node calibrate-trocar`; to be done again when device or trocar were moved.\n";
    if (!serial.empty()) out << "serial: \"" << serial << "\"\n";
    out << text.data();
    out.flush();
    if (!out) throw InputError("cannot write " + draft.string() + "; is the disk full, or the folder not yours?");
  }
  fs::rename(draft, file, error);
  if (error) throw InputError("cannot write " + file.string() + ": " + error.message());
}

}  // namespace fulcrum::haptics
