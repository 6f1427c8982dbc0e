#include "haptics_node/node/calibrate_trocar.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <thread>

#include "haptics_node/node/cart_devices.h"
#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::haptics {
namespace {

constexpr double kSamplePeriod_s = 0.01;
constexpr double kPatience_s = 60;

bool ButtonDown(const DevicePose& pose) { return pose.buttons != 0; }

TrocarMotion RecordTouch(const config::CartConfig& cart, std::size_t tool, double seconds,
                         const std::string& touch_library, const TrocarProgress& progress) {
  std::array<bool, kMaxTools> used{};
  used[tool] = true;
  const auto driver = MakeTouchDriver(cart, used, touch_library);
  driver->Start();
  const auto wanted = static_cast<std::size_t>(seconds / kSamplePeriod_s);
  TrocarMotion motion;
  const std::int64_t start_ns = runtime::MonotonicNs();
  std::int64_t last_ns = start_ns;
  while (motion.poses.size() < wanted && !runtime::ShouldStop()) {
    const std::int64_t now_ns = runtime::MonotonicNs();
    TouchSample sample;
    if (driver->link(tool).sample.TryTake(&sample) && sample.buttons != 0) {
      motion.poses.push_back({1e-9 * static_cast<double>(now_ns - start_ns), sample.p_D, sample.d_D, sample.buttons});
      last_ns = now_ns;
    }
    const std::string trouble = driver->Trouble(tool);
    progress(kSamplePeriod_s * static_cast<double>(motion.poses.size()), trouble);
    if (1e-9 * static_cast<double>(now_ns - last_ns) > kPatience_s) {
      throw InputError("no motion with a button held for a minute" + (trouble.empty() ? "" : "; " + trouble));
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kSamplePeriod_s));
  }
  motion.serial = driver->serial(tool);
  return motion;
}

}  // namespace

TrocarMotion RecordTrocarMotion(const config::CartConfig& cart, std::size_t tool, double seconds,
                                const std::string& touch_library, const TrocarProgress& progress) {
  const config::DeviceConfig& device = cart.devices[tool];
  const std::string field = "devices.tool" + std::to_string(tool);
  if (device.kind == config::DeviceKind::kTouch) return RecordTouch(cart, tool, seconds, touch_library, progress);
  if (device.kind == config::DeviceKind::kNone) throw InputError(field + " is none: there is nothing to move");
  if (device.kind == config::DeviceKind::kOperator) {
    throw InputError(field + " is operator: a mouse has no trocar to measure");
  }
  if (device.motion.empty()) {
    throw InputError(field +
                     " is simulated without `motion`: it has no trocar of its own to measure; give a recorded "
                     "motion, or a real device");
  }
  TrocarMotion motion;
  const RecordedMotion recorded = RecordedMotion::Load(device.motion);
  std::copy_if(recorded.poses().begin(), recorded.poses().end(), std::back_inserter(motion.poses), ButtonDown);
  return motion;
}

std::string Describe(const PivotFit& fit) {
  char text[240];
  const Vec3d p_mm = 1e3 * fit.p_DP;
  std::snprintf(
      text, sizeof(text),
      "trocar at (%.1f, %.1f, %.1f) mm of the device; residual %.2f mm RMS, %.2f mm at most; swing %.1f deg RMS, "
      "condition %.1f; %zu poses",
      p_mm.x(), p_mm.y(), p_mm.z(), 1e3 * fit.residual_m, 1e3 * fit.largest_m, fit.swing_rad * 180 / std::numbers::pi,
      fit.condition, fit.poses);
  return text;
}

}  // namespace fulcrum::haptics
