#include "haptics_node/device/touch_driver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>

#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::haptics {
namespace {

constexpr double kMetrePerMm = 1e-3;
// Upper limit of the reach of a desktop device from its origin [m].
constexpr double kFarthest_m = 1.0;
// Temperatures and calibration are read every this many frames, ten times a second.
constexpr std::uint64_t kSlowFrames = 100;
// Frames for which an error about forces is reported and the motors count as warm: one second.
constexpr int kErrorFrames = 1000;
// If the servo has sent no force for 20 ms it has stopped: the last force is reduced to 0 within 100 ms.
constexpr int kHoldFrames = 20, kReleaseFrames = 100;
constexpr int kMaxErrorsPerFrame = 8;
constexpr unsigned long kSchedulerRate_Hz = 1000;
constexpr std::size_t kMotors = 6;

constexpr std::int64_t kRetry_ns = 2'000'000'000, kRetryBesideAnother_ns = 10'000'000'000;
// If the scheduler makes no callback for this long it has failed together with its device.
constexpr std::int64_t kSchedulerDead_ns = 500'000'000;
constexpr auto kMaintenancePeriod = std::chrono::milliseconds(100);

bool IsDeviceError(unsigned code) { return code >= hd::kDeviceFault && code <= hd::kTimerError; }

bool IsForceError(unsigned code) { return code >= hd::kMaxForceExceeded && code <= hd::kForceError; }

std::string Quoted(const std::string& text) { return "'" + text + "'"; }

}  // namespace

TouchDriver::TouchDriver(const WantedByTool& wanted, const std::string& library)
    : api_(hd::Load(library)), wanted_(wanted) {
  for (const auto& want : wanted_) {
    if (want) devices_[device_count_++].name = want->name;
  }
  OpenDevices();
  StartScheduler();
}

TouchDriver::~TouchDriver() {
  maintenance_ = {};
  StopScheduler();
  for (Device& device : devices_) {
    if (device.handle == hd::kInvalidHandle) continue;
    api_.MakeCurrentDevice(device.handle);
    api_.Disable(hd::kForceOutput);
    api_.DisableDevice(device.handle);
  }
}

void TouchDriver::Start() {
  maintenance_ = std::jthread([this](const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any wake;
    std::unique_lock lock(mutex);
    while (!stop.stop_requested()) {
      Maintain(runtime::MonotonicNs());
      wake.wait_for(lock, stop, kMaintenancePeriod, [] { return false; });
    }
  });
}

// ------------------------------------------------------------------------------- scheduler thread of the library

unsigned TouchDriver::OnSchedulerTick(void* self) noexcept {
  auto& driver = *static_cast<TouchDriver*>(self);
  for (std::size_t i = 0; i < driver.device_count_; ++i) {
    Device& device = driver.devices_[i];
    const State state = device.state.load(std::memory_order_relaxed);
    if (device.link != nullptr && (state == State::kReady || state == State::kUncalibrated)) driver.Frame(&device);
  }
  driver.ticks_.fetch_add(1, std::memory_order_relaxed);
  return hd::kCallbackContinue;
}

void TouchDriver::Frame(Device* device) noexcept {
  const bool slow = device->frames++ % kSlowFrames == 0;
  api_.MakeCurrentDevice(device->handle);
  if (slow && device->state.load(std::memory_order_relaxed) == State::kUncalibrated) CheckCalibration(device);
  api_.BeginFrame(device->handle);
  Read(device, slow);
  const Vec3d force_D = ForceToSend(device);
  api_.SetDoublev(hd::kCurrentForce, force_D.data());
  api_.EndFrame(device->handle);
  TakeErrors(device);
  if (device->warm_frames > 0) --device->warm_frames;
  device->link->warm.store(device->warm_frames > 0, std::memory_order_relaxed);
  if (device->refusal_frames > 0 && --device->refusal_frames == 0) device->refusal.store(0, std::memory_order_relaxed);
}

void TouchDriver::CheckCalibration(Device* device) noexcept {
  hd::Enum answer = api_.CheckCalibration();
  if (answer == hd::kCalibrationNeedsUpdate) {
    const auto styles = static_cast<unsigned>(device->calibration_style);
    // Selects the calibration style that requires the least action of the operator.
    api_.UpdateCalibration((styles & hd::kAutomatic) != 0u ? hd::kAutomatic
                           : (styles & hd::kInkwell) != 0u ? hd::kInkwell
                                                           : hd::kEncoderReset);
    answer = api_.CheckCalibration();
  }
  if (answer == hd::kCalibrationOk) device->state.store(State::kReady, std::memory_order_relaxed);
}

void TouchDriver::Read(Device* device, bool slow) noexcept {
  Vec3d position_mm = Vec3d::Zero();
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  TouchSample sample;
  api_.GetDoublev(hd::kCurrentPosition, position_mm.data());
  api_.GetDoublev(hd::kCurrentTransform, transform.data());
  api_.GetIntegerv(hd::kCurrentButtons, &sample.buttons);
  if (slow) {
    std::array<double, kMotors> heat{};
    api_.GetDoublev(hd::kMotorTemperature, heat.data());
    const double hottest = *std::max_element(heat.begin(), heat.end());
    if (std::isfinite(hottest)) device->link->motor_heat.store(hottest, std::memory_order_relaxed);
  }
  sample.p_D = kMetrePerMm * position_mm;
  const Vec3d axis = -transform.topLeftCorner<3, 3>().col(2);
  const double length = axis.norm();
  const bool good = sample.p_D.norm() < kFarthest_m && std::abs(length - 1.0) < 0.1;  // False for NaN.
  device->bad_position.store(!good, std::memory_order_relaxed);
  if (!good || device->state.load(std::memory_order_relaxed) != State::kReady) return;
  sample.d_D = axis / length;
  sample.x_D = transform.topLeftCorner<3, 3>().col(0);
  device->link->sample.Store(sample);
}

Vec3d TouchDriver::ForceToSend(Device* device) noexcept {
  if (device->link->force_D.TryTake(&device->force_D)) {
    device->frames_without_force = 0;
  } else if (device->frames_without_force < kHoldFrames + kReleaseFrames) {
    ++device->frames_without_force;
  }
  if (device->state.load(std::memory_order_relaxed) != State::kReady) return Vec3d::Zero();
  const double size = device->force_D.norm();
  if (!std::isfinite(size)) return Vec3d::Zero();
  const int late = std::max(0, device->frames_without_force - kHoldFrames);
  double share = 1.0 - static_cast<double>(late) / kReleaseFrames;
  // Above its limit the driver would switch the force off.
  if (size > device->max_force_N) share *= device->max_force_N / size;
  return share * device->force_D;
}

void TouchDriver::TakeErrors(Device* current) noexcept {
  for (int i = 0; i < kMaxErrorsPerFrame; ++i) {
    const hd::ErrorInfo error = api_.GetError();
    if (error.code == 0) return;
    Device* device = current;
    for (Device& other : devices_) {
      if (other.handle == error.device && other.link != nullptr) device = &other;
    }
    if (error.code == hd::kWarmMotors) device->warm_frames = kErrorFrames;
    if (IsForceError(error.code)) {
      device->refusal.store(error.code, std::memory_order_relaxed);
      device->refusal_frames = kErrorFrames;
    }
    if (IsDeviceError(error.code)) {
      device->error.store(error.code, std::memory_order_relaxed);
      device->state.store(State::kLost, std::memory_order_relaxed);
      losses_.fetch_add(1, std::memory_order_relaxed);
    }
  }
}

// --------------------------------------------------------------------------------------------- every other thread

void TouchDriver::Maintain(std::int64_t now_ns) {
  const std::uint64_t ticks = ticks_.load(std::memory_order_relaxed);
  if (ticks != ticks_seen_ || ticks_seen_ns_ == 0 || !scheduled_) {
    ticks_seen_ = ticks;
    ticks_seen_ns_ = now_ns;
  }
  const bool dead = now_ns - ticks_seen_ns_ > kSchedulerDead_ns;
  bool works = false, waits = false;
  for (std::size_t i = 0; i < device_count_; ++i) {
    Device& device = devices_[i];
    if (dead && device.handle != hd::kInvalidHandle && device.state != State::kLost) {
      device.error = hd::kCommError;
      device.state = State::kLost;
      ++losses_;
    }
    (device.state == State::kLost || device.state == State::kAbsent ? waits : works) = true;
  }
  if (!waits || now_ns < retry_ns_) return;
  const bool first = retry_ns_ == 0 && losses() == 0;
  retry_ns_ = now_ns + (works ? kRetryBesideAnother_ns : kRetry_ns);
  if (first) return;  // The constructor has already tried to open the devices.
  StopScheduler();
  OpenDevices();
  StartScheduler();
  ticks_seen_ns_ = now_ns;
}

void TouchDriver::OpenDevices() {
  for (std::size_t i = 0; i < device_count_; ++i) {
    Device& device = devices_[i];
    if (device.state == State::kLost) {
      api_.DisableDevice(device.handle);
      device.state = State::kAbsent;
    }
    if (device.state == State::kAbsent) Open(&device);
  }
  Pair();
}

// The library may take seconds for a device that is not connected. It is never called with the mutex held, so that
// Health does not wait for it.
void TouchDriver::Open(Device* device) {
  // Discards errors of an earlier device; their number is bounded in case the library reports errors without end.
  for (int i = 0; i < kMaxErrorsPerFrame && api_.GetError().code != 0; ++i) {
  }
  hd::Handle handle = api_.InitDevice(device->name.c_str());
  const hd::ErrorInfo error = api_.GetError();
  std::string serial, failure;
  if (handle == hd::kInvalidHandle || error.code != 0) {
    if (handle != hd::kInvalidHandle) api_.DisableDevice(handle);
    handle = hd::kInvalidHandle;
    failure = "cannot open the Touch " + Quoted(device->name) + " (" + Describe(error.code) +
              "): check its power and cable, and that the Touch's setup program lists it under this name";
  } else {
    api_.MakeCurrentDevice(handle);
    if (const char* text = api_.GetString(hd::kSerialNumber); text != nullptr) serial = text;
    api_.GetDoublev(hd::kMaxForce, &device->max_force_N);
    api_.GetIntegerv(hd::kCalibrationStyle, &device->calibration_style);
    api_.Enable(hd::kForceOutput);
    device->error = 0;
    device->frames = 0;
    device->force_D.setZero();
    device->state = State::kUncalibrated;
    CheckCalibration(device);
  }
  const std::lock_guard lock(mutex_);
  device->handle = handle;
  device->serial = serial;
  device->failure = failure;
}

void TouchDriver::Pair() {
  const std::lock_guard lock(mutex_);
  for (Device& device : devices_) device.link = nullptr;
  for (std::size_t tool = 0; tool < wanted_.size(); ++tool) {
    if (!wanted_[tool]) continue;
    for (std::size_t i = 0; i < device_count_; ++i) {
      Device& device = devices_[i];
      const Wanted& wanted = *wanted_[tool];
      const bool fits = wanted.serial.empty() ? device.name == wanted.name : device.serial == wanted.serial;
      if (fits && device.handle != hd::kInvalidHandle && device.link == nullptr) {
        device.link = &links_[tool];
        break;
      }
    }
  }
}

void TouchDriver::StartScheduler() {
  if (std::none_of(devices_.begin(), devices_.end(), [](const Device& d) { return d.link != nullptr; })) return;
  api_.SetSchedulerRate(kSchedulerRate_Hz);
  schedule_ = api_.ScheduleAsynchronous(&TouchDriver::OnSchedulerTick, this, hd::kDefaultPriority);
  api_.StartScheduler();
  scheduled_ = true;
}

void TouchDriver::StopScheduler() {
  if (!scheduled_) return;
  api_.StopScheduler();
  api_.Unschedule(schedule_);
  scheduled_ = false;
}

std::string TouchDriver::Describe(unsigned error) const {
  const char* text = error == 0 ? nullptr : api_.GetErrorString(error);
  return text != nullptr ? text : "no reason given";
}

const TouchDriver::Device* TouchDriver::DeviceOf(std::size_t tool) const {
  const auto it = std::find_if(devices_.begin(), devices_.end(),
                               [link = &links_[tool]](const Device& device) { return device.link == link; });
  return it == devices_.end() ? nullptr : &*it;
}

std::string TouchDriver::serial(std::size_t tool) const {
  const std::lock_guard lock(mutex_);
  const Device* device = DeviceOf(tool);
  return device == nullptr ? std::string() : device->serial;
}

std::string TouchDriver::Trouble(std::size_t tool) const {
  if (!wanted_[tool]) return {};
  const std::lock_guard lock(mutex_);
  const Device* device = DeviceOf(tool);
  if (device == nullptr) {
    const std::string& serial = wanted_[tool]->serial;
    std::string found, failures;
    for (std::size_t i = 0; i < device_count_; ++i) {
      const Device& other = devices_[i];
      if (other.handle != hd::kInvalidHandle) found += " " + other.serial + " (" + Quoted(other.name) + ")";
      if (!other.failure.empty() && (!serial.empty() || other.name == wanted_[tool]->name)) {
        failures += failures.empty() ? other.failure : "; " + other.failure;
      }
    }
    if (serial.empty()) return failures;
    return "no Touch with serial number " + serial + "; found:" + (found.empty() ? " none" : found) +
           (failures.empty() ? "; check `serial` in the cart file" : "; " + failures);
  }
  const std::string prefix = "Touch " + device->serial;
  switch (device->state.load(std::memory_order_relaxed)) {
    case State::kLost:
      return prefix + " was lost (" + Describe(device->error.load(std::memory_order_relaxed)) +
             "): check its cable and power; it is reopened automatically";
    case State::kUncalibrated:
      return prefix + " is not calibrated: put the stylus into the inkwell until this message disappears";
    default:
      break;
  }
  if (device->bad_position.load(std::memory_order_relaxed)) {
    return prefix + " reports no valid position: restart it, then run its diagnostic program";
  }
  if (device->link->warm.load(std::memory_order_relaxed)) {
    return prefix + " has hot motors: its force is off until they have cooled";
  }
  if (const unsigned refusal = device->refusal.load(std::memory_order_relaxed); refusal != 0) {
    return prefix + " has refused a force (" + Describe(refusal) + "): move it more slowly, or lower force_scale";
  }
  return {};
}

}  // namespace fulcrum::haptics
