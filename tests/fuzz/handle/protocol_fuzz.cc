// libFuzzer target: any bytes through framer, gates and estimator.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "handle_bridge/node/jaw_channel.h"
#include "handle_bridge/node/pedal_channel.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fulcrum::handle_bridge;
  constexpr std::array kCodes = {485.66, 520.49};
  constexpr std::array kAngles = {0.0, 60.0};
  JawChannel jaw({JawLineSettings{}, JawEstimatorSettings{}, JawCalibration(kCodes, kAngles)});
  PedalChannel pedal;
  const std::span<const char> bytes(reinterpret_cast<const char*>(data), size);
  for (std::size_t at = 0; at < size; at += 8) {
    const auto piece = bytes.subspan(at, std::min<std::size_t>(8, size - at));
    jaw.Tick(piece, 0.0025);
    pedal.Tick(piece, 0.0025);
    const JawEstimate e = jaw.estimate();
    const bool in_range = !jaw.present() || (e.angle_deg >= 0 && e.angle_deg <= 60 && std::isfinite(e.rate_deg_s));
    if (!in_range || pedal.pedals() > 7) {
      std::abort();
    }
  }
  return 0;
}
