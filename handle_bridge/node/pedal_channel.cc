#include "handle_bridge/node/pedal_channel.h"

#include <optional>

#include "handle_bridge/protocol/pedal_line.h"

namespace fulcrum::handle_bridge {

void PedalChannel::Tick(std::span<const char> bytes, double dt_s) noexcept {
  LinkCounts counts;
  counts.bytes = static_cast<std::uint32_t>(bytes.size());
  age_s_ += dt_s;
  for (const char byte : bytes) {
    const LineFramer::Event event = framer_.Add(byte);
    if (event == LineFramer::Event::kNone) {
      continue;
    }
    const std::optional<std::uint8_t> pedals =
        event == LineFramer::Event::kLine ? ParsePedals(framer_.line()) : std::nullopt;
    ++(pedals ? counts.good : counts.malformed);
    if (pedals) {
      pedals_ = *pedals;
      age_s_ = 0;
    }
  }
  if (age_s_ > kPedalTimeout_s) {
    pedals_ = 0;
  }
  monitor_.Add(counts, dt_s);
  totals_ += counts;
}

void PedalChannel::Reconnected() noexcept {
  framer_.Reset();
  monitor_.Reset();
  pedals_ = 0;
}

}  // namespace fulcrum::handle_bridge
