#include "handle_bridge/node/pedal_channel.h"

#include <optional>

#include "handle_bridge/protocol/pedal_line.h"

namespace fulcrum::handle_bridge {

void PedalChannel::Tick(std::span<const char> bytes, double dt_s) noexcept {
  tick_counts_ = {};
  tick_counts_.bytes = static_cast<std::uint32_t>(bytes.size());
  age_s_ += dt_s;
  for (const char byte : bytes) {
    const LineFramer::Event event = framer_.Add(byte);
    if (event == LineFramer::Event::kLine) {
      TakeLine(framer_.line());
    } else if (event == LineFramer::Event::kBad) {
      ++tick_counts_.malformed;
    }
  }
  if (age_s_ > kPedalTimeout_s) {
    pedals_ = 0;
  }
  monitor_.Add(tick_counts_, dt_s);
  totals_ += tick_counts_;
}

void PedalChannel::TakeLine(std::string_view line) noexcept {
  std::optional<std::uint8_t> pedals;
  if (!IsFramed(line)) {
    pedals = ParsePedals(line);
  } else if (const std::optional<Frame> frame = ParseFrame(line)) {
    if (frame->sender != kPedalSender) {
      ++tick_counts_.other;
      return;
    }
    tick_counts_.lost += sequence_.Lost(frame->sequence);
    if (frame->value <= kAllPedals) {
      pedals = static_cast<std::uint8_t>(frame->value);
    }
  }
  ++(pedals ? tick_counts_.good : tick_counts_.malformed);
  if (pedals) {
    pedals_ = *pedals;
    age_s_ = 0;
  }
}

void PedalChannel::Reconnected() noexcept {
  framer_.Reset();
  sequence_ = {};
  monitor_.Reset();
  pedals_ = 0;
}

}  // namespace fulcrum::handle_bridge
