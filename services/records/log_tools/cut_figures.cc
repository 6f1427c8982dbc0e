#include "services/records/log_tools/cut_figures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace fulcrum::log_tools {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
/// Sampling distance of the path; a sample is open if a texel within the second distance is removed [m].
constexpr double kWayStep_m = 0.1e-3, kOpenWithin_m = 0.15e-3;
/// Time over which a rise of the reported length is measured. In this time a smooth length can grow only by the path of
/// the metal [s].
constexpr double kJumpWindow_s = 0.05;
/// Largest interval between samples of one path; samples come at 100 Hz [s].
constexpr double kWayGap_s = 0.035;
/// Least distance between vertices of a path: smaller movements are noise and not part of the path [m].
constexpr double kVertex_m = 0.2e-3;

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return kNone;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return std::lerp(values[low], values[high], at - static_cast<double>(low));
}

bool Cuts(CauteryMode mode) { return mode == CauteryMode::kCut || mode == CauteryMode::kBlend; }

bool IsOpen(const CutMap& map, const Vec2d& texel) {
  const double reach = kOpenWithin_m / map.recorded.texels.texel_m;
  const int x0 = static_cast<int>(std::floor(texel.x())), y0 = static_cast<int>(std::floor(texel.y()));
  if (map.removed.At(x0, y0)) return true;
  const int around = static_cast<int>(std::ceil(reach)) + 1;
  for (int y = y0 - around; y <= y0 + around; ++y) {
    for (int x = x0 - around; x <= x0 + around; ++x) {
      if (map.removed.At(x, y) && (Vec2d(x + 0.5, y + 0.5) - texel).norm() <= reach) return true;
    }
  }
  return false;
}

void MeasureWay(CutMap* map) {
  struct Share {
    int samples = 0, open = 0;
    void Add(bool is_open) {
      ++samples;
      open += is_open ? 1 : 0;
    }
    [[nodiscard]] double pct() const { return samples > 0 ? 100.0 * open / samples : kNone; }
  } at_cutting_power, all;
  double way = 0, next = 0;
  const MetalFrame* last = nullptr;
  const double step = kWayStep_m / map->recorded.texels.texel_m;
  for (const MetalFrame& frame : map->recorded.metal) {
    if (!frame.in_contact || !Cuts(frame.mode)) {
      last = nullptr;
      continue;
    }
    const Vec2d to = map->ToTexel(frame.centre);
    const bool goes_on = last != nullptr && frame.goes_on && frame.time_s - last->time_s < kWayGap_s;
    const Vec2d from = goes_on ? map->ToTexel(last->centre) : to;
    const double length = (to - from).norm();
    const double speed_m_s = goes_on ? length * map->recorded.texels.texel_m / (frame.time_s - last->time_s) : 0;
    const bool cuts = speed_m_s * frame.vaporising_J_m <= static_cast<double>(frame.power_W);
    for (; next <= length; next += step) {
      const Vec2d at = length > 0 ? Vec2d(from + next / length * (to - from)) : to;
      const bool open = IsOpen(*map, at);
      all.Add(open);
      if (cuts) at_cutting_power.Add(open);
    }
    next -= length;
    way += length;
    last = &frame;
  }
  map->figures.way_mm = 1e3 * way * map->recorded.texels.texel_m;
  map->figures.open_pct = at_cutting_power.pct();
  map->figures.open_pct_all = all.pct();
}

/// Length of a path from noisy samples.
class NoisyWay {
 public:
  void Begin(const Vec2f& at) { last_ = at; }
  void GoTo(const Vec2f& at) {
    const auto step = static_cast<double>((at - last_).norm());
    if (step < kVertex_m) return;
    length_m_ += step;
    last_ = at;
  }
  [[nodiscard]] double length_m() const { return length_m_; }

 private:
  Vec2f last_ = Vec2f::Zero();
  double length_m_ = 0;
};

/// Measures the paths of the reported place of the current and of the metal, over the same times.
void MeasureSpotWay(CutMap* map) {
  const auto& metal = map->recorded.metal;
  NoisyWay spot, centre;
  const CurrentSample* last = nullptr;
  std::size_t at = 0;
  for (const CurrentSample& sample : map->recorded.current) {
    while (at + 1 < metal.size() &&
           std::abs(metal[at + 1].time_s - sample.time_s) <= std::abs(metal[at].time_s - sample.time_s)) {
      ++at;
    }
    const bool both = sample.energised() && sample.touching && at < metal.size() && metal[at].in_contact &&
                      std::abs(metal[at].time_s - sample.time_s) < kWayGap_s;
    if (both && last != nullptr && metal[at].goes_on && sample.time_s - last->time_s < kWayGap_s) {
      spot.GoTo(sample.material);
      centre.GoTo(metal[at].centre);
    } else if (both) {
      spot.Begin(sample.material);
      centre.Begin(metal[at].centre);
    }
    last = both ? &sample : nullptr;
  }
  map->figures.spot_way_ratio = centre.length_m() > 0 ? spot.length_m() / centre.length_m() : kNone;
}

/// Places touched by energised metal, in cells of one millimetre.
class TouchedPlaces {
 public:
  explicit TouchedPlaces(const CutMap& map) {
    for (const MetalFrame& frame : map.recorded.metal) {
      if (frame.mode == CauteryMode::kOff) continue;
      for (const Vec2f& place : frame.touched) cells_[CellOf(place.cast<double>())].push_back(place.cast<double>());
    }
  }
  [[nodiscard]] bool empty() const { return cells_.empty(); }

  [[nodiscard]] double DistanceTo(const Vec2d& place_m) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (int reach = 1; reach < 64; reach *= 2) {
      const int x0 = Along(place_m.x()), y0 = Along(place_m.y());
      for (int y = y0 - reach; y <= y0 + reach; ++y) {
        for (int x = x0 - reach; x <= x0 + reach; ++x) {
          const auto cell = cells_.find(Key(x, y));
          if (cell == cells_.end()) continue;
          for (const Vec2d& touched : cell->second) nearest = std::min(nearest, (touched - place_m).norm());
        }
      }
      if (nearest <= reach * kCell_m) break;
    }
    return nearest;
  }

 private:
  static constexpr double kCell_m = 1e-3;
  static int Along(double metres) { return static_cast<int>(std::floor(metres / kCell_m)); }
  static std::int64_t Key(int x, int y) { return (static_cast<std::int64_t>(x) << 32) ^ static_cast<std::uint32_t>(y); }
  static std::int64_t CellOf(const Vec2d& place) { return Key(Along(place.x()), Along(place.y())); }

  std::unordered_map<std::int64_t, std::vector<Vec2d>> cells_;
};

/// [%]; NaN without a hole or without metal.
double BeyondMetal(const CutMap& map, const TouchedPlaces& touched) {
  int removed = 0, beyond = 0;
  for (int y = 0; y < map.removed.height; ++y) {
    for (int x = 0; x < map.removed.width; ++x) {
      if (!map.removed.At(x, y)) continue;
      ++removed;
      beyond += touched.DistanceTo(map.ToSheet(Vec2d(x + 0.5, y + 0.5))) > kBesideMetal_m ? 1 : 0;
    }
  }
  return removed > 0 && !touched.empty() ? 100.0 * beyond / removed : kNone;
}

void MeasureHoleAndCentreLine(CutMap* map) {
  const double texel_mm = 1e3 * map->recorded.texels.texel_m;
  CutFigures& figures = map->figures;
  figures.length_mm = texel_mm * map->centre_line.length();
  const TouchedPlaces touched(*map);
  figures.beyond_metal_pct = BeyondMetal(*map, touched);
  std::vector<double> widths, off_way;
  for (const CentreLine::Stretch& stretch : map->centre_line.stretches) {
    for (const CentrePoint& point : stretch.points) {
      widths.push_back(texel_mm * point.width);
      if (!touched.empty()) off_way.push_back(1e3 * touched.DistanceTo(map->ToSheet(point.place)));
    }
  }
  figures.width_mm_p05 = Quantile(widths, 0.05);
  figures.width_mm_p50 = Quantile(widths, 0.5);
  figures.width_mm_p95 = Quantile(widths, 0.95);
  figures.off_way_mm_p95 = Quantile(off_way, 0.95);
}

void MeasureReported(CutMap* map) {
  const auto& lengths = map->recorded.lengths;
  CutFigures& figures = map->figures;
  std::size_t before = 0;
  double largest = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    // The last length published before the window applies at its beginning.
    while (before + 1 < i && lengths[before + 1].time_s <= lengths[i].time_s - kJumpWindow_s) ++before;
    const bool known = lengths[before].time_s <= lengths[i].time_s - kJumpWindow_s;
    if (i > 0) {
      const double from = known ? lengths[before].length_m : lengths.front().length_m;
      largest = std::max(largest, lengths[i].length_m - from);
      figures.falls += lengths[i].length_m < lengths[i - 1].length_m ? 1 : 0;
    }
  }
  figures.jump_mm_max = 1e3 * largest;
  figures.reported_length_mm = lengths.empty() ? 0 : 1e3 * lengths.back().length_m;
  figures.length_error_pct =
      figures.longest_mm > 0 ? 100 * (figures.reported_length_mm - figures.longest_mm) / figures.longest_mm : kNone;
}

}  // namespace

void MeasureCut(CutMap* map) {
  MeasureWay(map);
  MeasureSpotWay(map);
  MeasureHoleAndCentreLine(map);
  MeasureReported(map);
  map->figures.revived = map->recorded.texels.revived;
  map->figures.first_opening_s = map->recorded.first_opening_s;
  map->figures.thermal_step_p50_ms = 1e-3 * static_cast<double>(map->recorded.thermal_step.p50_us);
  map->figures.thermal_step_p99_ms = 1e-3 * static_cast<double>(map->recorded.thermal_step.p99_us);
}

}  // namespace fulcrum::log_tools
