#include "services/session/soak/soak_record.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::soak {
namespace {

using supervisor::Curve;
using supervisor::CurvePoint;

constexpr double kSettle_s = 30, kWindow_s = 10;
/// Sessions of at least this length use the times above; shorter ones use shorter times in proportion.
constexpr double kWhole_s = 120;
constexpr double kMega = 1e6;

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double MedianBetween(const Curve& curve, double begin_s, double end_s) {
  std::vector<double> values;
  for (const CurvePoint& point : curve.points()) {
    if (point.time_s >= begin_s && point.time_s <= end_s) values.push_back(point.value);
  }
  return Median(std::move(values));
}

}  // namespace

Life* SoakRecord::Find(std::int32_t process) {
  // The kernel may reuse a pid after its process has ended.
  const auto life = std::find_if(lives_.rbegin(), lives_.rend(), [&](const Life& l) { return l.process == process; });
  return life == lives_.rend() || life->has_ended ? nullptr : &*life;
}

void SoakRecord::AddMemory(double time_s, const std::string& program, std::int32_t process, std::uint64_t resident_B) {
  Life* life = Find(process);
  if (life == nullptr) {
    life = &lives_.emplace_back();
    life->program = program;
    life->process = process;
  }
  duration_s_ = std::max(duration_s_, time_s);
  life->memory_MB.Add(time_s, static_cast<double>(resident_B) / kMega);
}

void SoakRecord::AddHealth(double time_s, const Health& health) {
  Life* life = Find(health.pid);
  if (life == nullptr || health.rate_asked_Hz <= 0 || health.state == HealthState::kStarting ||
      health.state == HealthState::kWaiting) {
    return;
  }
  const auto asked_Hz = static_cast<double>(health.rate_asked_Hz);
  const std::uint64_t periods = health.ticks + health.overruns;
  if (life->first_ns == 0) {
    life->first_ns = health.stamp.stamp_ns;
    life->first_ticks = periods;
  }
  life->rate_pct.Add(time_s, 100 * static_cast<double>(health.rate_achieved_Hz) / asked_Hz);
  const double counted_s = static_cast<double>(periods - life->first_ticks) / asked_Hz;
  life->drift_ms.Add(time_s,
                     std::abs(1e3 * counted_s - 1e-6 * static_cast<double>(health.stamp.stamp_ns - life->first_ns)));
}

void SoakRecord::AddBlow(const Blow& blow, std::int32_t process) {
  blows_.push_back(blow);
  if (Life* life = Find(process); life != nullptr && blow.kind == BlowKind::kKill) life->was_killed = true;
}

void SoakRecord::SetAlive(const std::vector<std::int32_t>& processes) {
  for (Life& life : lives_) {
    if (life.has_ended || std::find(processes.begin(), processes.end(), life.process) != processes.end()) continue;
    life.has_ended = true;
    crashes_ += !life.was_killed;
  }
}

void SoakRecord::End(double time_s, bool well, const std::string& verdict) {
  duration_s_ = time_s;
  ended_ = true;
  verdict_ = verdict;
  crashes_ += !well;
}

int SoakRecord::Count(BlowKind kind) const {
  return static_cast<int>(
      std::count_if(blows_.begin(), blows_.end(), [kind](const Blow& blow) { return blow.kind == kind; }));
}

double SoakRecord::GrowthOf(const Life& life) const {
  const auto& points = life.memory_MB.points();
  if (points.empty()) return 0;
  const double share = std::min(1.0, duration_s_ / kWhole_s);
  const double first_s = points.front().time_s + share * kSettle_s, last_s = points.back().time_s;
  const double window_s = share * kWindow_s;
  if (last_s - first_s < 2 * window_s) return 0;
  return MedianBetween(life.memory_MB, last_s - window_s, last_s) -
         MedianBetween(life.memory_MB, first_s, first_s + window_s);
}

double SoakRecord::LargestGrowth_MB() const {
  double largest = 0;
  for (const Life& life : lives_) largest = std::max(largest, GrowthOf(life));
  return largest;
}

double SoakRecord::LowestRate_pct() const {
  std::map<std::string, std::vector<double>> rates;
  for (const Life& life : lives_) {
    for (const CurvePoint& point : life.rate_pct.points()) rates[life.program].push_back(point.value);
  }
  double lowest = 100;
  for (auto& [program, values] : rates) lowest = std::min(lowest, Median(std::move(values)));
  return lowest;
}

double SoakRecord::LargestDrift_ms() const {
  double largest = 0;
  for (const Life& life : lives_) {
    const auto& points = life.drift_ms.points();
    if (points.empty()) continue;
    largest = std::max(largest, MedianBetween(life.drift_ms, points.back().time_s - 1, points.back().time_s));
  }
  return largest;
}

bool SoakRecord::Passes(const Limits& limits) const {
  return ended_ && crashes_ <= limits.crashes && refused_ <= limits.not_finite &&
         LargestGrowth_MB() <= limits.rss_growth_MB;
}

std::vector<SoakFigure> FiguresOf(const SoakRecord& record) {
  return {{"soak.minutes", record.duration_s() / 60, "min"},
          {"soak.rss_growth_MB", record.LargestGrowth_MB(), "MB"},
          {"soak.nan", static_cast<double>(record.refused()), "samples"},
          {"soak.crashes", static_cast<double>(record.crashes()), "processes"},
          {"soak.kills", static_cast<double>(record.Count(BlowKind::kKill)), "blows"},
          {"soak.freezes", static_cast<double>(record.Count(BlowKind::kFreeze)), "blows"},
          {"soak.crowds", static_cast<double>(record.Count(BlowKind::kCrowd)), "blows"},
          {"soak.rate_pct_lowest", record.LowestRate_pct(), "%"},
          {"soak.drift_ms_largest", record.LargestDrift_ms(), "ms"},
          {"soak.stolen_pct", record.stolen_pct(), "%"}};
}

}  // namespace fulcrum::soak
