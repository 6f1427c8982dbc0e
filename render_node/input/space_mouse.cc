#include "render_node/input/space_mouse.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

namespace fulcrum::render {
namespace {

namespace fs = std::filesystem;

constexpr auto kLookEvery = std::chrono::seconds(1);
constexpr std::int64_t kFirstDevice = std::int64_t{1} << 40;  ///< Beyond the numbers of gamepads.

/// Logitech sold them under its own number at first, among many mice and keyboards.
constexpr int k3Dconnexion = 0x256f, kLogitech = 0x046d;
constexpr std::array kOfLogitech{0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625,
                                 0xc626, 0xc627, 0xc628, 0xc629, 0xc62b};

// Reports. The first byte is the kind; values have 16 bits, the low byte first. Axes in the device's frame: x right, y
// towards the operator, z down. Newer models send the turns behind the translation, in one report.
constexpr std::uint8_t kTranslationReport = 1, kRotationReport = 2, kButtonReport = 3;
constexpr std::size_t kThreeAxes = 1 + 3 * 2, kSixAxes = 1 + 6 * 2;
constexpr float kFullDeflection = 350;  ///< Counts at the end of the cap's way.

/// Share of the full deflection of value `index` of a report.
float Value(std::span<const std::uint8_t> report, std::size_t index) {
  const std::size_t at = 1 + 2 * index;
  const auto counts = static_cast<std::int16_t>(static_cast<std::uint16_t>(report[at] | report[at + 1] << 8));
  return std::clamp(static_cast<float>(counts) / kFullDeflection, -1.0f, 1.0f);
}

/// Values `index` to `index` + 2, as right, up and away from the operator.
void TakeThree(std::span<const std::uint8_t> report, std::size_t index, PadAxis first, PadState* state) {
  const auto to = static_cast<std::size_t>(first);
  state->axes[to] = Value(report, index);
  state->axes[to + 1] = -Value(report, index + 2);
  state->axes[to + 2] = -Value(report, index + 1);
}

/// Name, vendor and product from the lines HID_NAME and HID_ID ("0003:0000256F:0000C635") of the kernel.
bool Identify(const fs::path& uevent, InputDevice* device) {
  std::ifstream file(uevent);
  bool identified = false;
  for (std::string line; std::getline(file, line);) {
    unsigned bus = 0, vendor = 0, product = 0;
    if (line.starts_with("HID_NAME=")) device->name = line.substr(std::strlen("HID_NAME="));
    if (std::sscanf(line.c_str(), "HID_ID=%x:%x:%x", &bus, &vendor, &product) != 3) continue;
    device->vendor = static_cast<int>(vendor);
    device->product = static_cast<int>(product);
    identified = true;
  }
  return identified;
}

bool IsSpaceMouse(const InputDevice& device) {
  return device.vendor == k3Dconnexion ||
         (device.vendor == kLogitech &&
          std::find(kOfLogitech.begin(), kOfLogitech.end(), device.product) != kOfLogitech.end());
}

/// A wireless receiver also has parts that report keys: usage "multi-axis controller" of the generic desktop.
bool HasAxes(const fs::path& descriptor) {
  std::ifstream file(descriptor, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return bytes.find("\x05\x01\x09\x08") != std::string::npos;
}

}  // namespace

void TakeSpaceMouseReport(std::span<const std::uint8_t> report, PadState* state) {
  if (report.empty()) return;
  if (report[0] == kTranslationReport && report.size() >= kThreeAxes) {
    TakeThree(report, 0, PadAxis::kX, state);
    if (report.size() >= kSixAxes) TakeThree(report, 3, PadAxis::kTurnX, state);
  } else if (report[0] == kRotationReport && report.size() >= kThreeAxes) {
    TakeThree(report, 0, PadAxis::kTurnX, state);
  } else if (report[0] == kButtonReport && report.size() >= 2) {
    state->buttons = (report[1] & 3u) << static_cast<unsigned>(PadButton::kFirst);
  }
}

SpaceMice::SpaceMice(fs::path sys, fs::path dev) : sys_(std::move(sys)), dev_(std::move(dev)) {}

SpaceMice::~SpaceMice() {
  for (const int descriptor : descriptors_) {
    if (descriptor >= 0) ::close(descriptor);
  }
}

void SpaceMice::Update() {
  for (std::size_t i = 0; i < mice_.size();) {
    if (descriptors_[i] < 0 || Read(descriptors_[i], &mice_[i].state)) {
      ++i;
      continue;
    }
    ::close(descriptors_[i]);
    descriptors_.erase(descriptors_.begin() + static_cast<std::ptrdiff_t>(i));
    mice_.erase(mice_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (const auto now = std::chrono::steady_clock::now(); now >= find_at_) {
    find_at_ = now + kLookEvery;
    Find();
  }
}

bool SpaceMice::Read(int descriptor, PadState* state) {
  std::array<std::uint8_t, 64> report{};
  for (;;) {
    const ssize_t size = ::read(descriptor, report.data(), report.size());
    if (size > 0) {
      TakeSpaceMouseReport(std::span(report).first(static_cast<std::size_t>(size)), state);
    } else if (size == 0 || errno != EINTR) {
      return size < 0 && errno == EAGAIN;
    }
  }
}

void SpaceMice::Find() {
  // Those that could not be read may be readable now, or gone.
  for (std::size_t i = mice_.size(); i-- > 0;) {
    if (descriptors_[i] >= 0) continue;
    descriptors_.erase(descriptors_.begin() + static_cast<std::ptrdiff_t>(i));
    mice_.erase(mice_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(sys_, none)) {
    Mouse mouse;
    mouse.device.path = dev_ / entry.path().filename();
    const bool open = std::any_of(mice_.begin(), mice_.end(),
                                  [&](const Mouse& known) { return known.device.path == mouse.device.path; });
    if (open || !Identify(entry.path() / "device/uevent", &mouse.device) || !IsSpaceMouse(mouse.device) ||
        !HasAxes(entry.path() / "device/report_descriptor")) {
      continue;
    }
    const int descriptor = ::open(mouse.device.path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) mouse.problem = std::strerror(errno);
    mouse.state.device = kFirstDevice + devices_++;
    mice_.push_back(std::move(mouse));
    descriptors_.push_back(descriptor);
  }
}

const PadState* SpaceMice::first() const {
  for (std::size_t i = 0; i < mice_.size(); ++i) {
    if (descriptors_[i] >= 0) return &mice_[i].state;
  }
  return nullptr;
}

int SpaceMice::descriptor() const {
  const auto found = std::find_if(descriptors_.begin(), descriptors_.end(), [](int open) { return open >= 0; });
  return found == descriptors_.end() ? -1 : *found;
}

}  // namespace fulcrum::render
