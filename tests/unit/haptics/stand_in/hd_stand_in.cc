// The stand-in itself. HD_STAND_IN_INCOMPLETE builds one without one of the functions.
#include "tests/unit/haptics/stand_in/hd_stand_in.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <thread>
#include <utility>

namespace {

using fulcrum::haptics::testing::StandIn;
using fulcrum::haptics::testing::StandInDevice;

constexpr unsigned kInvalid = 0xffffffffu;
constexpr std::size_t kMaxForces = 100'000, kMaxErrors = 16, kMaxMisuse = 100;

struct Error {
  unsigned code;
  int internal_code;
  unsigned device;
};

std::unique_ptr<StandIn> NewControls() {
  auto fresh = std::make_unique<StandIn>();
  for (StandInDevice& device : fresh->devices) device.forces.reserve(kMaxForces);
  fresh->devices[0].name = "Left Device";
  fresh->devices[0].serial = "A100";
  fresh->devices[1].name = "Right Device";
  fresh->devices[1].serial = "B200";
  return fresh;
}

std::unique_ptr<StandIn> controls = NewControls();
std::array<Error, kMaxErrors> errors;
std::size_t error_count = 0;
unsigned current = kInvalid, frame = kInvalid;
unsigned (*callback)(void*) = nullptr;
void* callback_data = nullptr;
std::atomic<bool> running{false};
std::thread scheduler;

void Misuse(const char* what) {
  if (controls->misuse.size() < kMaxMisuse) controls->misuse.emplace_back(what);
}
void Push(unsigned code, unsigned device) {
  if (error_count < kMaxErrors) errors[error_count++] = {code, 0, device};
}
StandInDevice* Current(const char* what, bool in_frame) {
  if (current >= controls->devices.size() || !controls->devices[current].open) {
    Misuse(what);
    return nullptr;
  }
  if (in_frame && frame != current) Misuse(what);
  return &controls->devices[current];
}
/// With HD_STAND_IN_SWING in the environment the devices move without a test, like a tool that is swung about its
/// trocar.
const bool swings = std::getenv("HD_STAND_IN_SWING") != nullptr;

void SwingTo(double time_s) {
  const double a = 0.4 * std::sin(6 * time_s), b = 0.4 * std::sin(8 * time_s);
  // The axis of the tool, towards its tip, and two directions normal to it; the trocar is at (0, -100, -100) mm.
  const double x = std::tan(a), y = std::tan(b) - 1, z = -1, length = std::hypot(x, y, z);
  const std::array<double, 3> d{x / length, y / length, z / length};
  const double flat = std::hypot(d[1], d[2]);
  const std::array<double, 3> u{0, d[2] / flat, -d[1] / flat};
  for (StandInDevice& device : controls->devices) {
    device.buttons = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      device.position_mm[i] = (i == 0 ? 0.0 : -100.0) - 140 * d[i];
      device.transform[4 + i] = u[i];
      device.transform[8 + i] = -d[i];
    }
  }
}

void CallBack() {
  if (running && !controls->stalled && callback != nullptr) (void)callback(callback_data);
}

}  // namespace

extern "C" {

StandIn* hd_stand_in_reset() {
  controls = NewControls();
  error_count = 0;
  current = frame = kInvalid;
  callback = nullptr;
  return controls.get();
}
void hd_stand_in_tick() { CallBack(); }

unsigned hdInitDevice(const char* name) {
  if (running) Misuse("hdInitDevice while the scheduler runs");
  ++controls->inits;
  for (unsigned i = 0; i < controls->devices.size(); ++i) {
    StandInDevice& device = controls->devices[i];
    if (device.name != name || !device.plugged) continue;
    if (device.open) Misuse("hdInitDevice of an open device");
    device.open = true;
    device.force_enabled = false;
    current = i;
    return i;
  }
  Push(0x0300, kInvalid);
  return kInvalid;
}
void hdDisableDevice(unsigned handle) {
  if (running) Misuse("hdDisableDevice while the scheduler runs");
  if (handle >= controls->devices.size() || !controls->devices[handle].open) return Misuse("hdDisableDevice");
  controls->devices[handle].open = false;
  controls->devices[handle].force_N.fill(0);
}
void hdMakeCurrentDevice(unsigned handle) {
  if (handle >= controls->devices.size() || !controls->devices[handle].open) Misuse("hdMakeCurrentDevice");
  current = handle;
}
void hdBeginFrame(unsigned handle) {
  if (handle != current || frame != kInvalid) Misuse("hdBeginFrame");
  frame = handle;
}
void hdEndFrame(unsigned handle) {
  if (handle != frame) Misuse("hdEndFrame");
  frame = kInvalid;
  if (handle >= controls->devices.size()) return;
  StandInDevice& device = controls->devices[handle];
  if (!device.plugged) {
    device.force_N.fill(0);
    Push(0x0302, handle);
    return;
  }
  if (device.error != 0) Push(std::exchange(device.error, 0), handle);
  if (*std::max_element(device.heat.begin(), device.heat.end()) >= 1) {
    device.force_N.fill(0);
    Push(0x0200, handle);
  }
  if (device.forces.size() < kMaxForces) device.forces.push_back(device.force_N);
}
Error hdGetError() {
  if (error_count == 0) return {0, 0, kInvalid};
  const Error first = errors[0];
  std::copy(errors.begin() + 1, errors.begin() + static_cast<std::ptrdiff_t>(error_count), errors.begin());
  --error_count;
  return first;
}
const char* hdGetErrorString(unsigned code) {
  switch (code) {
    case 0x0200:
      return "warm motors";
    case 0x0203:
      return "maximum velocity exceeded";
    case 0x0300:
      return "device fault";
    case 0x0302:
      return "communication error";
    default:
      return "error";
  }
}
void hdEnable(unsigned what) {
  if (StandInDevice* device = Current("hdEnable", false); device != nullptr && what == 0x4000) {
    device->force_enabled = true;
  }
}
void hdDisable(unsigned what) {
  if (StandInDevice* device = Current("hdDisable", false); device != nullptr && what == 0x4000) {
    device->force_enabled = false;
    device->force_N.fill(0);
  }
}
const char* hdGetString(unsigned what) {
  const StandInDevice* device = Current("hdGetString", false);
  return device != nullptr && what == 0x2504 ? device->serial.c_str() : nullptr;
}
void hdGetIntegerv(unsigned what, int* value) {
  const StandInDevice* device = Current("hdGetIntegerv", what == 0x2000);
  if (device != nullptr) *value = what == 0x2000 ? device->buttons : 4;
}
void hdGetDoublev(unsigned what, double* value) {
  const StandInDevice* device = Current("hdGetDoublev", what < 0x2500);
  if (device == nullptr) return;
  if (what == 0x2050) std::copy(device->position_mm.begin(), device->position_mm.end(), value);
  if (what == 0x2052) std::copy(device->transform.begin(), device->transform.end(), value);
  if (what == 0x2603) *value = device->max_force_N;
  if (what == 0x2605) std::copy(device->heat.begin(), device->heat.end(), value);
}
void hdSetDoublev(unsigned what, const double* value) {
  StandInDevice* device = Current("hdSetDoublev", true);
  if (device == nullptr || what != 0x2700) return;
  std::copy(value, value + 3, device->force_N.begin());
  if (!device->force_enabled) device->force_N.fill(0);
  const double size = std::hypot(value[0], value[1], value[2]);
  if (!(size <= device->max_force_N * (1 + 1e-12))) {
    Misuse("a force beyond the limit");
    device->force_N.fill(0);
    Push(0x0201, current);
  }
}
unsigned long hdScheduleAsynchronous(unsigned (*function)(void*), void* data, unsigned short) {
  callback = function;
  callback_data = data;
  return 1;
}
void hdUnschedule(unsigned long) { callback = nullptr; }
void hdSetSchedulerRate(unsigned long rate) { controls->rate_Hz = rate; }
void hdStartScheduler() {
  if (running.exchange(true)) return Misuse("hdStartScheduler twice");
  if (!controls->threaded && !swings) return;
  scheduler = std::thread([] {
    for (double time_s = 0; running; time_s += 0.001) {
      if (swings) SwingTo(time_s);
      CallBack();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
}
void hdStopScheduler() {
  running = false;
  if (scheduler.joinable()) scheduler.join();
}
unsigned hdCheckCalibration() {
  const StandInDevice* device = Current("hdCheckCalibration", false);
  return device == nullptr ? 0x5002 : device->calibration;
}
#ifndef HD_STAND_IN_INCOMPLETE
void hdUpdateCalibration(unsigned) {
  if (StandInDevice* device = Current("hdUpdateCalibration", false); device != nullptr) {
    ++device->calibration_updates;
    if (device->calibration == 0x5001) device->calibration = 0x5000;
  }
}
#endif
}
