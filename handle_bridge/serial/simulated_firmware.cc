#include "handle_bridge/serial/simulated_firmware.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "handle_bridge/protocol/frame.h"
#include "handle_bridge/protocol/jaw_line.h"
#include "handle_bridge/protocol/pedal_line.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr std::int64_t kPeriod_ns = static_cast<std::int64_t>(1e9 / kLineRate_Hz);
constexpr auto kPedalPeriods = static_cast<std::uint64_t>(kPedalPeriod_s * kLineRate_Hz);
/// Limit of the lines that are sent after a delay of this thread [lines]: a quarter of a second. Shorter delays lose no
/// line.
constexpr std::uint64_t kMaxCatchUp = 100;
/// Longest time between two bursts of lines at rest: as many lines as may be late before they count as lost.
constexpr std::int64_t kBurst_ns = 8 * kPeriod_ns;

}  // namespace

SimulatedFirmware::SimulatedFirmware(InputAt input, const std::array<SimulatedUnit, kLinks>& units, Rest rest)
    : input_(std::move(input)),
      rest_(std::move(rest)),
      units_(units),
      jaws_{JawFirmware(units[0].jaw, 1), JawFirmware(units[1].jaw, 2), JawFirmware(units[2].jaw, 3),
            JawFirmware(units[3].jaw, 4)},
      links_{Link(11), Link(12), Link(14), Link(15), Link(13)},
      thread_(
          {.name = "firmware", .period_ns = kPeriod_ns, .rests_until = [this] { return RestsUntil(); }, .bell = &bell_},
          [this](const Tick& tick) { Step(tick); }) {
  thread_.Start();
}

std::array<SimulatedUnit, kLinks> SimulatedFirmware::DefaultUnits() {
  return {SimulatedUnit{"simulated-tool0", false, kLeftHandle, {}},
          SimulatedUnit{"simulated-tool1", false, kRightHandle, {}},
          SimulatedUnit{"simulated-tool2", false, kLeftHandle, {}},
          SimulatedUnit{"simulated-tool3", false, kRightHandle, {}},
          SimulatedUnit{"simulated-pedal", false, kPedalSender, {}}};
}

std::unique_ptr<ByteSourceOpener> SimulatedFirmware::MakeOpener(std::size_t link) {
  {
    const std::lock_guard lock(mutex_);
    links_[link].used = true;
    if (!links_[link].terminal) links_[link].terminal.emplace();
  }
  const auto device = [this, link]() -> std::string {
    const std::lock_guard lock(mutex_);
    const auto& terminal = links_[link].terminal;
    return terminal ? terminal->device() : "";
  };
  return std::make_unique<TerminalOpener>(device, units_[link].serial_number);
}

void SimulatedFirmware::Step(const Tick& tick) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t owed = std::min(tick.index - next_index_ + 1, kMaxCatchUp);
  next_index_ = tick.index + 1;
  stepped_ns_ = tick.stamp_ns;
  for (std::uint64_t i = owed; i-- > 0;) {
    const std::optional<SimulatedInput> input = input_(tick.stamp_ns - static_cast<std::int64_t>(i) * kPeriod_ns);
    if (!input) {
      continue;
    }
    for (std::size_t link = 0; link < kLinks; ++link) {
      if (links_[link].used) Plug(&links_[link], !input->faults[link].unplugged);
    }
    for (std::size_t tool = 0; tool < kMaxTools; ++tool) {
      if (links_[tool].used) SendJaw(tool, input->jaw_deg[tool], input->faults[tool]);
    }
    SendPedals(input->pedals, input->faults[kPedalLink]);
  }
  if (rest_.sent != nullptr) rest_.sent->Ring();
}

std::int64_t SimulatedFirmware::RestsUntil() const {
  return rest_.until ? std::min(rest_.until(stepped_ns_), stepped_ns_ + kBurst_ns) : stepped_ns_;
}

void SimulatedFirmware::Plug(Link* link, bool plugged) {
  if (!plugged) {
    link->terminal.reset();
  } else if (!link->terminal) {
    try {
      link->terminal.emplace();
    } catch (const std::system_error&) {
      // The system has no pseudo-terminal left: retried at the next sample.
    }
  }
}

void SimulatedFirmware::SendJaw(std::size_t tool, double jaw_deg, const LinkFaults& faults) {
  int code = jaws_[tool].Convert(jaw_deg);
  if (faults.broken_wire) {
    constexpr std::uint64_t kMultiplier = 6364136223846793005u;  // Knuth's linear congruential generator.
    floating_ = floating_ * kMultiplier + 1442695040888963407u;
    code = static_cast<int>(floating_ >> 54);  // 10 bits.
  }
  Link* link = &links_[tool];
  if (units_[tool].framed) {
    const auto line = FormatFrame({units_[tool].sender, link->sequence++, code});
    Transmit(link, {line.data(), line.size()}, faults);
  } else {
    const auto line = jaws_[tool].Format(code);
    Transmit(link, {line.data(), line.size()}, faults);
  }
}

void SimulatedFirmware::SendPedals(std::uint8_t pedals, const LinkFaults& faults) {
  if (pedals == sent_pedals_ && pedal_index_++ % kPedalPeriods != 0) {
    return;
  }
  sent_pedals_ = pedals;
  Link* link = &links_[kPedalLink];
  if (units_[kPedalLink].framed) {
    const auto line = FormatFrame({units_[kPedalLink].sender, link->sequence++, pedals});
    Transmit(link, {line.data(), line.size()}, faults);
  } else {
    const auto line = FormatPedals(pedals);
    Transmit(link, {line.data(), line.size()}, faults);
  }
}

void SimulatedFirmware::Transmit(Link* link, std::string_view bytes, const LinkFaults& faults) {
  if (!link->terminal || faults.silent) {
    return;
  }
  bytes_.clear();
  link->cable.Pass(bytes, faults.cable, &bytes_);
  const int unit_baud = faults.wrong_baud ? kOtherBaud : kBaud;
  if (const int baud = link->terminal->ReaderBaud(); baud != unit_baud) {
    // A receiver at another speed samples the line at wrong times: it gets about baud / unit_baud as many bytes, all of
    // them random.
    const ByteDamage noise{std::max(0.0, 1.0 - static_cast<double>(baud) / unit_baud), 0.0, true};
    std::string received;
    link->cable.Pass(bytes_, noise, &received);
    bytes_.swap(received);
  }
  link->terminal->Send(bytes_);
}

}  // namespace fulcrum::handle_bridge
