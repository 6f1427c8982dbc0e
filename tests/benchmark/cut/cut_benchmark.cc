// The cut of live sessions, measured from their recordings alone (services/records/log_tools/cut_map.h).
//
//   bench_cut [--quick] [--session N] [--keep DIR] [PREFIX]
//
// --session N: only session N of the matrix; 0: the script of the built-in scene. --keep DIR: keeps recordings, maps
// and their figures in DIR for inspection.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/benchmark/cut/session.h"
#include "tests/benchmark/report.h"

namespace fulcrum::benchmark {
namespace {

using log_tools::CutFigures;
using log_tools::CutMap;

struct Row {
  Shape shape;
  double speed_mm_s, power_W;
  Held held;
  Foot foot;
  bool loaded;
};
/// Rows 1 to 6: the usual stroke in six shapes. Nearly every pair of values occurs in one row; left out are shapes too
/// long for 2 mm/s and some of the 40 pairs of shape and hold. The slanted foot lies across the stroke, except in
/// kAcross.
constexpr std::array kMatrix{
    Row{Shape::kAlong, 4, 35, Held::kFree, Foot::kDown, false},
    Row{Shape::kCircle, 4, 35, Held::kFree, Foot::kUp, false},
    Row{Shape::kZigzag, 4, 35, Held::kFree, Foot::kSlanted, true},
    Row{Shape::kAcross, 4, 35, Held::kSlack, Foot::kDown, true},
    Row{Shape::kSpiral, 4, 35, Held::kOrgan, Foot::kUp, true},
    Row{Shape::kEight, 4, 35, Held::kTaut, Foot::kSlanted, false},
    Row{Shape::k45deg, 2, 60, Held::kOrgan, Foot::kDown, false},
    Row{Shape::k30deg, 8, 60, Held::kTented, Foot::kSlanted, true},
    Row{Shape::kAlong, 2, 20, Held::kTaut, Foot::kUp, true},
    Row{Shape::kSpiral, 8, 20, Held::kSlack, Foot::kDown, false},
    Row{Shape::kAcross, 2, 20, Held::kTented, Foot::kSlanted, false},
    Row{Shape::kEight, 8, 60, Held::kFree, Foot::kUp, true},
    Row{Shape::k45deg, 8, 35, Held::kTented, Foot::kUp, true},
    Row{Shape::k30deg, 2, 35, Held::kSlack, Foot::kUp, false},
    Row{Shape::kCircle, 8, 60, Held::kTaut, Foot::kDown, true},
    Row{Shape::kZigzag, 8, 20, Held::kOrgan, Foot::kSlanted, false},
    Row{Shape::kEight, 4, 20, Held::kTented, Foot::kDown, false},
    Row{Shape::k45deg, 4, 60, Held::kSlack, Foot::kSlanted, true},
    Row{Shape::k30deg, 2, 20, Held::kFree, Foot::kDown, true},
    Row{Shape::kAlong, 8, 60, Held::kTented, Foot::kSlanted, true},
    Row{Shape::kAcross, 8, 60, Held::kOrgan, Foot::kUp, true},
    Row{Shape::kCircle, 2, 20, Held::kSlack, Foot::kSlanted, false},
    Row{Shape::kZigzag, 8, 60, Held::kSlack, Foot::kUp, true},
    Row{Shape::kSpiral, 4, 60, Held::kTented, Foot::kSlanted, true},
};
/// A level foot, 5 mm of metal on the sheet, across its stroke cuts as wide as it touches. These rows have separate
/// figures and are not part of the summary.
constexpr std::array kLevel{
    Row{Shape::kAlong, 4, 35, Held::kFree, Foot::kLevel, false},
    Row{Shape::kAcross, 4, 35, Held::kFree, Foot::kLevel, false},
    Row{Shape::kZigzag, 4, 35, Held::kFree, Foot::kLevel, false},
    Row{Shape::kAlong, 8, 60, Held::kTented, Foot::kLevel, false},
};
/// Sessions of --quick: along, across, circle.
constexpr std::array<std::size_t, 3> kQuick{0, 3, 1};

/// Length of a stroke of a few seconds [mm].
double LongestFor(double speed_mm_s) { return speed_mm_s < 3 ? 13 : speed_mm_s < 6 ? 22 : 30; }
/// A smaller circle leaves no disc [mm].
constexpr double kShortestCircle_mm = 22;

std::string Numbered(const char* series, std::size_t number) {
  return (number < 10 ? std::string(series) + "0" : series) + std::to_string(number);
}

SessionPlan PlanOf(const Row& row, const std::string& name) {
  SessionPlan plan;
  plan.name = name;
  plan.shape = row.shape;
  plan.speed_mm_s = row.speed_mm_s;
  plan.power_W = row.power_W;
  plan.held = row.held;
  plan.foot = row.foot;
  plan.loaded = row.loaded;
  plan.longest_mm = LongestFor(row.speed_mm_s);
  if (row.shape == Shape::kCircle) plan.longest_mm = std::max(plan.longest_mm, kShortestCircle_mm);
  return plan;
}

std::string UnitOf(const std::string& figure) {
  for (const char* unit : {"mm2", "mm", "pct", "ms", "s"}) {
    if (figure.ends_with(std::string("_") + unit) || figure.find(std::string("_") + unit + "_") != std::string::npos) {
      return std::string_view(unit) == "pct" ? "%" : unit;
    }
  }
  return "1";
}

void AddFigures(const std::string& name, const CutFigures& figures, Report* report) {
  for (const auto& [figure, value] : log_tools::FigureList(figures)) {
    report->Add("cut.live." + name + "." + figure, value, UnitOf(figure));
  }
}

class Bench {
 public:
  Bench(Report* report, std::string keep) : report_(report), runner_(std::move(keep)) {}

  /// Reports the figures under the plan's name; no value if the session failed.
  std::optional<CutMap> Run(const SessionPlan& plan) {
    std::optional<CutMap> map = runner_.Run(plan);
    if (map) AddFigures(plan.name, map->figures, report_);
    failed_ += map ? 0 : 1;
    return map;
  }

  void RunMatrix(std::optional<std::size_t> only) {
    std::vector<CutFigures> all, usual;
    for (std::size_t i = 0; i < kMatrix.size(); ++i) {
      const bool quick = std::find(kQuick.begin(), kQuick.end(), i) != kQuick.end();
      if (only ? i + 1 != *only : report_->quick() && !quick) continue;
      const SessionPlan plan = PlanOf(kMatrix[i], Numbered("s", i + 1));
      if (!report_->Wants("cut.live." + plan.name) && !WantsSummary()) continue;
      const std::optional<CutMap> map = Run(plan);
      if (!map) continue;
      all.push_back(map->figures);
      if (plan.power_W == 35 && plan.speed_mm_s == 4) usual.push_back(map->figures);
    }
    if (only ? *only == 0 : !report_->quick() && WantsSummary()) {
      const std::optional<CutMap> map = runner_.RunScene("script", "built-in");
      failed_ += map ? 0 : 1;
      if (map) AddFigures("script", map->figures, report_);
      if (map) all.push_back(map->figures);
    }
    if (!only) Summarise(all, usual);
  }

  void RunLevel() {
    for (std::size_t i = 0; i < kLevel.size(); ++i) {
      const std::string name = Numbered("level", i + 1);
      if (report_->Wants("cut.live." + name)) (void)Run(PlanOf(kLevel[i], name));
    }
  }

  void RunPowers() {
    std::vector<double> opening_ms;
    for (const int power_W : {10, 20, 30, 40, 60}) {
      const std::string key = "cut.live.time_to_open_ms." + std::to_string(power_W);
      if (!report_->Wants(key) && !report_->Wants("cut.live.power_monotone")) continue;
      SessionPlan plan;
      plan.name = "open" + std::to_string(power_W) + "W";
      plan.shape = Shape::kStay;
      plan.power_W = power_W;
      plan.stay_s = power_W < 15 ? 5 : 3;
      const std::optional<CutMap> map = Run(plan);
      const double ms = map ? 1e3 * map->figures.first_opening_s : std::numeric_limits<double>::quiet_NaN();
      report_->Add(key, ms, "ms");
      // A cut that never opens ranks behind all others.
      opening_ms.push_back(std::isfinite(ms) ? ms : std::numeric_limits<double>::infinity());
    }
    // Frames are 10 ms apart; the wake-up time jitters by some hundredths of a millisecond.
    constexpr double kWoken_ms = 1;
    const bool monotone = std::adjacent_find(opening_ms.begin(), opening_ms.end(), [](double weak, double strong) {
                            return strong > weak + kWoken_ms;
                          }) == opening_ms.end();
    report_->Add("cut.live.power_monotone", monotone ? 1 : 0, "1");
    if (report_->Wants("cut.live.open_10W_1mm_s")) {
      SessionPlan plan;
      plan.name = "slow10W";
      plan.power_W = 10;
      plan.speed_mm_s = 1;
      plan.longest_mm = 6;
      const std::optional<CutMap> map = Run(plan);
      report_->Add("cut.live.open_10W_1mm_s", map && map->figures.removed_mm2 > 0 ? 1 : 0, "1");
    }
  }

  void RunCoag() {
    if (!report_->Wants("cut.live.coag_open_mm2")) return;
    double largest = 0;
    for (const int speed : {2, 4, 8}) {
      SessionPlan plan;
      plan.name = "coag" + std::to_string(speed);
      plan.pedal = "coag";
      plan.power_W = 30;
      plan.speed_mm_s = speed;
      plan.longest_mm = LongestFor(speed);
      const std::optional<CutMap> map = Run(plan);
      if (map) largest = std::max(largest, map->figures.removed_mm2);
    }
    report_->Add("cut.live.coag_open_mm2", largest, "mm2");
  }

  /// Kills thermal_node and physics_node during strokes, twenty times in all.
  void RunKills() {
    if (!report_->Wants("cut.live.killed")) return;
    constexpr int kSessions = 5, kKillsEach = 4;
    int islands = 0, bridges = 0, sessions = 0;
    double open_pct = 100;
    for (int i = 0; i < kSessions; ++i) {
      SessionPlan plan;
      plan.name = "killed" + std::to_string(i + 1);
      plan.shape = std::array{Shape::kAlong, Shape::kAcross, Shape::k45deg, Shape::kCircle, Shape::kAlong}[i];
      plan.foot = i == kSessions - 1 ? Foot::kUp : Foot::kDown;
      plan.longest_mm = 24;
      plan.kills = kKillsEach;
      const std::optional<CutMap> map = Run(plan);
      if (!map) continue;
      ++sessions;
      islands += map->figures.islands;
      bridges += std::max(map->figures.holes - 1, 0);
      open_pct = std::min(open_pct, map->figures.open_pct);
    }
    report_->Add("cut.live.killed.kills", runner_.killed(), "1");
    report_->Add("cut.live.killed.sessions", sessions, "1");
    report_->Add("cut.live.killed.islands", islands, "1");
    report_->Add("cut.live.killed.bridges", bridges, "1");
    report_->Add("cut.live.killed.open_pct", open_pct, "%");
  }

  /// Runs the same script repeatedly.
  void RunRepeats() {
    if (!report_->Wants("cut.live.same_script_spread_pct") && !report_->Wants("cut.live.hook_place_spread_mm_p95")) {
      return;
    }
    std::vector<CutMap> same, all;
    for (int i = 0; i < 10; ++i) {
      SessionPlan plan;
      plan.loaded = i >= 5;
      plan.name = (plan.loaded ? "loaded" : "idle") + std::to_string(i % 5 + 1);
      if (std::optional<CutMap> map = Run(plan)) same.push_back(std::move(*map));
    }
    all = same;
    for (const double dt_ms : {20.0, 5.0}) {
      SessionPlan plan;
      plan.dt_ms = dt_ms;
      plan.name = "dt" + std::to_string(static_cast<int>(dt_ms));
      if (std::optional<CutMap> map = Run(plan)) all.push_back(std::move(*map));
    }
    SessionPlan fast;
    fast.preset = "fast";
    fast.name = "fast";
    if (std::optional<CutMap> map = Run(fast)) all.push_back(std::move(*map));
    report_->Add("cut.live.repeat_spread_pct", SpreadPct(same), "%");
    report_->Add("cut.live.same_script_spread_pct", SpreadPct(all), "%");
    report_->Add("cut.live.hook_place_spread_mm_p95", PlaceSpread(same), "mm");
  }

  /// Sessions that were repeated because the firmware got no processor time and did not send the pedal.
  void TellRepeated() { report_->Add("cut.live.repeated_sessions", runner_.repeated(), "1"); }
  [[nodiscard]] int failed() const { return failed_; }

 private:
  [[nodiscard]] bool WantsSummary() const {
    constexpr const char* kSummary[] = {"islands",         "islands_mm2", "pieces",         "open_pct",
                                        "width_mm",        "off_way_mm",  "spot_way_ratio", "length_error_pct",
                                        "beyond_metal",    "jump_mm_max", "falls",          "thermal_step_p50",
                                        "thermal_step_p99"};
    return std::any_of(std::begin(kSummary), std::end(kSummary),
                       [&](const char* key) { return report_->Wants(std::string("cut.live.") + key); });
  }

  void Summarise(const std::vector<CutFigures>& all, const std::vector<CutFigures>& usual) {
    const auto values = [](const std::vector<CutFigures>& of, auto member) {
      std::vector<double> list;
      for (const CutFigures& figures : of) {
        // A session that cut nothing has no such figure; open_pct shows it.
        const auto value = static_cast<double>(figures.*member);
        if (std::isfinite(value)) list.push_back(std::abs(value));
      }
      return list;
    };
    const auto add = [&](const char* key, const char* unit, double value) {
      report_->Add(std::string("cut.live.") + key, value, unit);
    };
    const auto largest = [&](const char* key, const char* unit, auto member) {
      add(key, unit, Quantile(values(all, member), 1));
    };
    largest("islands", "1", &CutFigures::islands);
    largest("islands_mm2", "mm2", &CutFigures::islands_mm2);
    largest("pieces", "1", &CutFigures::pieces);
    largest("revived", "1", &CutFigures::revived);
    add("open_pct", "%", Quantile(values(all, &CutFigures::open_pct), 0));
    add("open_pct_p50", "%", Quantile(values(all, &CutFigures::open_pct), 0.5));
    add("width_mm_p50", "mm", Quantile(values(usual, &CutFigures::width_mm_p50), 0.5));
    add("width_mm_p50_least", "mm", Quantile(values(usual, &CutFigures::width_mm_p50), 0));
    add("width_mm_p50_most", "mm", Quantile(values(usual, &CutFigures::width_mm_p50), 1));
    add("width_mm_p05", "mm", Quantile(values(all, &CutFigures::width_mm_p05), 0));
    add("width_mm_p95", "mm", Quantile(values(usual, &CutFigures::width_mm_p95), 1));
    largest("width_mm_p95_all", "mm", &CutFigures::width_mm_p95);
    largest("off_way_mm_p95", "mm", &CutFigures::off_way_mm_p95);
    largest("beyond_metal_pct", "%", &CutFigures::beyond_metal_pct);
    largest("spot_way_ratio", "1", &CutFigures::spot_way_ratio);
    largest("length_error_pct", "%", &CutFigures::length_error_pct);
    largest("jump_mm_max", "mm", &CutFigures::jump_mm_max);
    double falls = 0;
    for (const CutFigures& figures : all) falls += figures.falls;
    add("falls", "1", falls);
    add("thermal_step_p50_ms", "ms", Quantile(values(all, &CutFigures::thermal_step_p50_ms), 0.5));
    largest("thermal_step_p99_ms", "ms", &CutFigures::thermal_step_p99_ms);
  }

  /// (Largest - smallest) / mean, of length and of area: the larger of the two [%].
  static double SpreadPct(const std::vector<CutMap>& maps) {
    double spread = 0;
    for (const auto member : {&CutFigures::length_mm, &CutFigures::removed_mm2}) {
      double low = std::numeric_limits<double>::infinity(), high = 0, sum = 0;
      for (const CutMap& map : maps) {
        const double value = map.figures.*member;
        low = std::min(low, value);
        high = std::max(high, value);
        sum += value;
      }
      if (sum > 0) spread = std::max(spread, 100 * (high - low) * static_cast<double>(maps.size()) / sum);
    }
    return spread;
  }

  /// Distance of the hooks of all pairs of sessions at the same session time, where both touch with power [mm].
  static double PlaceSpread(const std::vector<CutMap>& maps) {
    constexpr double kPeriod_s = 0.01;
    std::map<int, std::vector<Vec2d>> places;
    for (const CutMap& map : maps) {
      const auto& metal = map.recorded.metal;
      for (std::size_t i = 1; i < metal.size(); ++i) {
        const auto &a = metal[i - 1], &b = metal[i];
        if (!a.in_contact || !b.in_contact || b.mode == CauteryMode::kOff || b.time_s - a.time_s > 3 * kPeriod_s) {
          continue;
        }
        const int tick = static_cast<int>(std::floor(b.time_s / kPeriod_s));
        if (tick * kPeriod_s < a.time_s) continue;
        const double u = (tick * kPeriod_s - a.time_s) / (b.time_s - a.time_s);
        places[tick].push_back((1 - u) * a.centre.cast<double>() + u * b.centre.cast<double>());
      }
    }
    std::vector<double> distances;
    for (const auto& [tick, of] : places) {
      for (std::size_t i = 0; i < of.size(); ++i) {
        for (std::size_t j = i + 1; j < of.size(); ++j) distances.push_back(1e3 * (of[i] - of[j]).norm());
      }
    }
    return Quantile(distances, 0.95);
  }

  Report* report_;
  SessionRunner runner_;
  int failed_ = 0;
};

int Main(int argc, char** argv) {
  std::optional<std::size_t> only;
  std::string keep;
  std::vector<char*> rest{argv[0]};
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--session" && i + 1 < argc) {
      only = static_cast<std::size_t>(std::atoi(argv[++i]));
    } else if (argument == "--keep" && i + 1 < argc) {
      keep = argv[++i];
    } else {
      rest.push_back(argv[i]);
    }
  }
  if (only && *only > kMatrix.size()) {
    std::fprintf(stderr, "bench_cut: --session: valid: 1 to %zu; 0: the script of built-in\n", kMatrix.size());
    return 2;
  }
  Report report(static_cast<int>(rest.size()), rest.data());
  if (!report.Wants("cut.live")) return 0;
  Bench bench(&report, keep);
  bench.RunMatrix(only);
  if (!only && !report.quick()) {
    bench.RunLevel();
    bench.RunPowers();
    bench.RunCoag();
    bench.RunKills();
    bench.RunRepeats();
  }
  bench.TellRepeated();
  return bench.failed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace fulcrum::benchmark

int main(int argc, char** argv) {
  try {
    return fulcrum::benchmark::Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_cut: %s\n", error.what());
    return 1;
  }
}
