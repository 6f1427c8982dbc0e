#include "services/apps/replayer/dataset_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "services/apps/replayer/truth.h"

namespace fulcrum::replay {
namespace {

using Rgb = std::array<double, 3>;  // 0 … 255.

constexpr std::array<const char*, 6> kTiles{"left", "depth", "normal", "instance", "flow", "temperature"};

/// 0 black-blue over red to 1 white-yellow.
Rgb Heat(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  return {255 * std::clamp(2.2 * s, 0.0, 1.0), 255 * std::clamp(2.2 * s - 0.8, 0.0, 1.0),
          255 * std::clamp(s < 0.35 ? 1.2 * s + 0.1 : 3.3 * s - 2.4, 0.0, 1.0)};
}

Rgb Wheel(double turn, double strength) {
  Rgb colour;
  for (std::size_t k = 0; k < 3; ++k) {
    const double wave = 0.5 + 0.5 * std::cos(turn - 2 * std::numbers::pi / 3 * static_cast<double>(k));
    colour[k] = 255 * (1 - strength * (1 - wave));
  }
  return colour;
}

Rgb Palette(int instance) {
  if (instance == 0) return {0, 0, 0};
  return Wheel(2.4 * instance, instance < kFirstToolInstance ? 0.55 : 1.0);
}

/// Greatest and least value above 0.
std::pair<double, double> Span(const Channel& channel) {
  double low = 65535, high = 0;
  for (const std::uint16_t value : channel.values) {
    if (value == 0) continue;
    low = std::min<double>(low, value);
    high = std::max<double>(high, value);
  }
  return {low, std::max(high, low + 1)};
}

Rgb ColourOf(const std::string& name, const std::uint16_t* pixel, const std::pair<double, double>& span,
             double longest_px) {
  if (name == "left" || name == "normal") {
    return {static_cast<double>(pixel[0]), static_cast<double>(pixel[1]), static_cast<double>(pixel[2])};
  }
  if (name == "instance") return Palette(pixel[0]);
  if (name == "flow") {
    if (pixel[2] == 0) return {40, 40, 40};
    const double u = pixel[0] - 32768.0, v = pixel[1] - 32768.0;
    const Rgb colour = Wheel(std::atan2(v, u), std::min(1.0, std::hypot(u, v) / longest_px));
    return pixel[2] == static_cast<int>(FlowState::kHidden) ? Rgb{0.4 * colour[0], 0.4 * colour[1], 0.4 * colour[2]}
                                                            : colour;
  }
  if (pixel[0] == 0) return {0, 0, 0};
  const double share = (pixel[0] - span.first) / (span.second - span.first);
  return Heat(name == "depth" ? 1 - share : share);
}

double LongestFlow(const Channel& flow) {
  double longest = 1;
  for (std::size_t i = 0; i + 2 < flow.values.size(); i += 3) {
    if (flow.values[i + 2] != 0)
      longest = std::max(longest, std::hypot(flow.values[i] - 32768.0, flow.values[i + 1] - 32768.0));
  }
  return longest;
}

}  // namespace

void DatasetSheet::Write(const std::filesystem::path& file) const {
  if (!channels_.contains("left")) return;
  const int width = channels_.at("left").width / 2, height = channels_.at("left").height / 2;
  Channel sheet(3 * width, 2 * height, 8, 3);
  for (std::size_t tile = 0; tile < kTiles.size(); ++tile) {
    const auto found = channels_.find(kTiles[tile]);
    if (found == channels_.end()) continue;
    Channel channel = found->second;
    const auto span = Span(channel);
    const double longest_px = found->first == "flow" ? LongestFlow(channel) : 1;
    const int left = static_cast<int>(tile % 3) * width, top = static_cast<int>(tile / 3) * height;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Rgb colour = ColourOf(found->first, &channel.At(2 * x, 2 * y), span, longest_px);
        for (int k = 0; k < 3; ++k) {
          sheet.At(left + x, top + y, k) = static_cast<std::uint16_t>(std::lround(colour[static_cast<std::size_t>(k)]));
        }
      }
    }
  }
  WriteChannel(sheet, file);
}

}  // namespace fulcrum::replay
