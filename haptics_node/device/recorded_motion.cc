#include "haptics_node/device/recorded_motion.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string_view>

#include "services/base/core/error.h"

namespace fulcrum::haptics {
namespace {

constexpr std::string_view kHeader = "time_s,x_mm,y_mm,z_mm,axis_x,axis_y,axis_z,buttons";
constexpr std::size_t kColumns = 8, kMaxPoses = 1'000'000;
constexpr double kFarthest_mm = 2000, kAxisTolerance = 0.01, kMaxButtons = 255;

std::string_view Trimmed(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  return line;
}

/// False unless the line is exactly eight finite numbers.
bool ReadNumbers(std::string_view line, std::array<double, kColumns>* values) {
  const char* at = line.data();
  const char* const end = at + line.size();
  for (std::size_t i = 0; i < kColumns; ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return false;
    const auto [next, error] = std::from_chars(at, end, (*values)[i]);
    if (error != std::errc() || !std::isfinite((*values)[i])) return false;
    at = next;
  }
  return at == end;
}

}  // namespace

RecordedMotion RecordedMotion::Load(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string() + ": cannot read this motion file");
  std::ostringstream text;
  text << stream.rdbuf();
  return Parse(text.str(), file.string());
}

RecordedMotion RecordedMotion::Parse(const std::string& text, const std::string& name) {
  std::istringstream stream(text);
  std::string line;
  std::size_t number = 0;
  const auto refuse = [&](const std::string& reason) {
    throw InputError(name + ":" + std::to_string(number) + ": " + reason);
  };
  RecordedMotion motion;
  while (std::getline(stream, line)) {
    ++number;
    const std::string_view trimmed = Trimmed(line);
    if (number == 1) {
      if (trimmed != kHeader) refuse("no motion file: the first line must be " + std::string(kHeader));
      continue;
    }
    if (trimmed.empty()) continue;
    std::array<double, kColumns> v{};
    if (!ReadNumbers(trimmed, &v)) refuse("valid: eight finite numbers, " + std::string(kHeader));
    DevicePose pose{v[0], 1e-3 * Vec3d(v[1], v[2], v[3]), Vec3d(v[4], v[5], v[6]), 0};
    if (!motion.poses_.empty() && !(pose.time_s > motion.poses_.back().time_s)) {
      refuse("time_s " + std::to_string(pose.time_s) + " does not exceed that of the line before");
    }
    if (Vec3d(v[1], v[2], v[3]).lpNorm<Eigen::Infinity>() > kFarthest_mm) refuse("place: valid: -2000 to 2000 mm");
    const double length = pose.d_D.norm();
    if (!(std::abs(length - 1) <= kAxisTolerance)) {
      refuse("axis has length " + std::to_string(length) + "; valid: 0.99 to 1.01");
    }
    pose.d_D /= length;
    if (v[7] < 0 || v[7] > kMaxButtons || v[7] != std::floor(v[7])) refuse("buttons: valid: an integer from 0 to 255");
    pose.buttons = static_cast<int>(v[7]);
    if (motion.poses_.size() == kMaxPoses) refuse("more than a million poses");
    motion.poses_.push_back(pose);
  }
  if (motion.poses_.empty()) {
    ++number;
    refuse("no poses; valid: at least one line below " + std::string(kHeader));
  }
  return motion;
}

Vec3d RecordedMotion::PositionAt(double time_s) const noexcept {
  const auto next = std::upper_bound(poses_.begin(), poses_.end(), time_s,
                                     [](double t, const DevicePose& pose) { return t < pose.time_s; });
  if (next == poses_.begin()) return poses_.front().p_D;
  if (next == poses_.end()) return poses_.back().p_D;
  const DevicePose& before = *(next - 1);
  const double u = (time_s - before.time_s) / (next->time_s - before.time_s);
  return before.p_D + u * (next->p_D - before.p_D);
}

std::string ToText(const std::vector<DevicePose>& poses) {
  std::string text(kHeader);
  text += '\n';
  for (const DevicePose& pose : poses) {
    std::array<char, 192> line{};
    const Vec3d p_mm = 1e3 * pose.p_D;
    std::snprintf(line.data(), line.size(), "%.4f,%.4f,%.4f,%.4f,%.6f,%.6f,%.6f,%d\n", pose.time_s, p_mm.x(), p_mm.y(),
                  p_mm.z(), pose.d_D.x(), pose.d_D.y(), pose.d_D.z(), pose.buttons);
    text += line.data();
  }
  return text;
}

}  // namespace fulcrum::haptics
