#include "handle_bridge/serial/simulated_firmware.h"

#include <algorithm>
#include <utility>

#include "handle_bridge/protocol/jaw_line.h"
#include "handle_bridge/protocol/pedal_line.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr std::int64_t kPeriod_ns = static_cast<std::int64_t>(1e9 / kLineRate_Hz);
constexpr auto kPedalPeriods = static_cast<std::uint64_t>(kPedalPeriod_s * kLineRate_Hz);
/// The firmware never misses a line, however late this thread wakes: it catches up by at most a quarter of a second.
constexpr std::uint64_t kMaxCatchUp = 100;

}  // namespace

SimulatedFirmware::SimulatedFirmware(InputAt input, const JawFirmwareSettings& settings)
    : input_(std::move(input)),
      jaws_{JawFirmware(settings, 1), JawFirmware(settings, 2)},
      links_{Link{PseudoTerminal(), DamagedLine(11), {}, false}, Link{PseudoTerminal(), DamagedLine(12), {}, false},
             Link{PseudoTerminal(), DamagedLine(13), {}, false}},
      thread_({.name = "firmware", .period_ns = kPeriod_ns}, [this](const Tick& tick) { Step(tick); }) {
  thread_.Start();
}

std::unique_ptr<ByteSourceOpener> SimulatedFirmware::MakeOpener(int link, int baud) {
  const auto device = [this, link]() -> std::string {
    const std::lock_guard lock(mutex_);
    const auto& terminal = links_[static_cast<std::size_t>(link)].terminal;
    return terminal ? terminal->device() : "";
  };
  return std::make_unique<TerminalOpener>(device, baud);
}

void SimulatedFirmware::Unplug(int link) {
  const std::lock_guard lock(mutex_);
  links_[static_cast<std::size_t>(link)].terminal.reset();
}

void SimulatedFirmware::Plug(int link) {
  const std::lock_guard lock(mutex_);
  links_[static_cast<std::size_t>(link)].terminal.emplace();
}

void SimulatedFirmware::SetDamage(int link, const ByteDamage& damage) {
  const std::lock_guard lock(mutex_);
  links_[static_cast<std::size_t>(link)].damage = damage;
}

void SimulatedFirmware::SetSilent(int link, bool silent) {
  const std::lock_guard lock(mutex_);
  links_[static_cast<std::size_t>(link)].silent = silent;
}

void SimulatedFirmware::Step(const Tick& tick) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t owed = std::min(tick.index - next_index_ + 1, kMaxCatchUp);
  next_index_ = tick.index + 1;
  for (std::uint64_t i = owed; i-- > 0;) {
    const std::optional<OperatorInput> input = input_(tick.stamp_ns - static_cast<std::int64_t>(i) * kPeriod_ns);
    if (!input) {
      continue;
    }
    for (std::size_t tool = 0; tool < kMaxTools; ++tool) {
      const std::array<char, 8> line = jaws_[tool].Line(input->jaw_deg[tool]);
      Transmit(&links_[tool], {line.data(), line.size()});
    }
    if (input->pedals != sent_pedals_ || pedal_index_++ % kPedalPeriods == 0) {
      sent_pedals_ = input->pedals;
      const std::array<char, 5> line = FormatPedals(input->pedals);
      Transmit(&links_[kPedalLink], {line.data(), line.size()});
    }
  }
}

void SimulatedFirmware::Transmit(Link* link, std::string_view bytes) {
  if (!link->terminal || link->silent) {
    return;
  }
  bytes_.clear();
  link->cable.Pass(bytes, link->damage, &bytes_);
  if (const int baud = link->terminal->ReaderBaud(); baud != kBaud) {
    // A receiver at another speed samples the wrong moments: it sees about baud / kBaud as many bytes, all nonsense.
    const ByteDamage nonsense{std::max(0.0, 1.0 - static_cast<double>(baud) / kBaud), 1.0};
    std::string heard;
    for (int pass = 0; pass < 3; ++pass) {  // Three flipped bits: not even digits stay digits.
      heard.clear();
      link->cable.Pass(bytes_, pass == 0 ? nonsense : ByteDamage{0.0, 1.0}, &heard);
      bytes_.swap(heard);
    }
  }
  link->terminal->Send(bytes_);
}

}  // namespace fulcrum::handle_bridge
