#include "services/session/supervisor/trainee_view.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "services/base/core/escape.h"
#include "services/session/supervisor/svg_plot.h"

namespace fulcrum::supervisor {
namespace {

/// Measures that are columns of the table; all but the first two are also plots.
constexpr std::array kShown{Measure::kTime,           Measure::kPathLength,    Measure::kMovements,
                            Measure::kPeakForce,      Measure::kDeviationMean, Measure::kDamageBeyondMargin,
                            Measure::kUreterInjuries, Measure::kNerveInjuries};
constexpr std::array kHeads{"time s",      "path mm",    "moves",      "peak N",
                            "off line mm", "damage mm²", "ureter inj", "nerve inj"};
constexpr std::array kPlotted{Measure::kTime, Measure::kPathLength, Measure::kPeakForce, Measure::kDeviationMean,
                              Measure::kDamageBeyondMargin};
constexpr std::array kColours{"#1f6feb", "#8250df", "#bc4c00", "#1a7f37", "#cf222e"};
constexpr int kPlotWidth = 640, kPlotHeight = 330, kPlotsAcross = 2;

const double* Find(const TrainingRow& row, Measure measure) {
  const auto found = row.measures.find(InfoOf(measure).key);
  return found == row.measures.end() ? nullptr : &found->second;
}

}  // namespace

std::string TraineeTable(const std::vector<TrainingRow>& rows) {
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), "%3s  %-23s  %-16s %7s", "", "started", "scene", "score %");
  std::string table = line.data();
  for (const char* head : kHeads) {
    table += "  ";
    table += head;
  }
  table += '\n';
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::snprintf(line.data(), line.size(), "%3zu  %-23s  %-16s %7s", i + 1, rows[i].started_utc.c_str(),
                  rows[i].scene.c_str(), Fixed(rows[i].score_pct, 0).c_str());
    table += line.data();
    for (std::size_t k = 0; k < kShown.size(); ++k) {
      const double* value = Find(rows[i], kShown[k]);
      const std::string text = value == nullptr ? "-" : Fixed(*value, InfoOf(kShown[k]).decimals);
      // "mm²" has one byte more than characters.
      const auto width = static_cast<int>(std::string_view(kHeads[k]).size()) - (k == 5 ? 1 : 0);
      std::snprintf(line.data(), line.size(), "  %*s", width, text.c_str());
      table += line.data();
    }
    table += rows[i].well ? "\n" : "  (the session ended with a failure)\n";
  }
  return table;
}

std::string TraineeSvg(const std::string& trainee, const std::vector<TrainingRow>& rows) {
  std::vector<std::string> plots;
  const auto add = [&](const std::string& title, const char* unit, const char* colour, const auto& value_of) {
    Curve curve;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      // As in the console's trends: the score of a failed cart does not assess the trainee.
      if (!rows[i].well) continue;
      if (const double* value = value_of(rows[i])) curve.Add(static_cast<double>(i + 1), *value);
    }
    PlotSettings settings{.title = title, .unit = unit, .end_s = static_cast<double>(rows.size()), .marks_s = {}};
    settings.x_label = "session";
    settings.dots = true;
    if (std::string plot = SvgPlot(settings, {{title, colour, &curve}}); !plot.empty())
      plots.push_back(std::move(plot));
  };
  add("score", "%", "#1d2733", [](const TrainingRow& row) { return &row.score_pct; });
  for (std::size_t k = 0; k < kPlotted.size(); ++k) {
    const MeasureInfo& info = InfoOf(kPlotted[k]);
    add(info.label, info.unit, kColours[k], [&](const TrainingRow& row) { return Find(row, kPlotted[k]); });
  }
  if (rows.empty()) return {};
  constexpr int kHead = 60;
  const int height = kHead + kPlotHeight * static_cast<int>((plots.size() + kPlotsAcross - 1) / kPlotsAcross);
  std::string svg =
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 " + std::to_string(kPlotsAcross * kPlotWidth) + " " +
      std::to_string(height) + "'>\n<style>text { font: 17px system-ui, sans-serif; fill: #5b6876; } " +
      "text.title { font-size: 20px; font-weight: 600; fill: #1d2733; } .grid { stroke: #e6eaf0; }</style>\n" +
      "<rect width='100%' height='100%' fill='white'/>\n<text class='title' x='16' y='36'>" + EscapeHtml(trainee) +
      ", " + std::to_string(rows.size()) + (rows.size() == 1 ? " session" : " sessions") + "</text>\n";
  for (std::size_t i = 0; i < plots.size(); ++i) {
    const int x = kPlotWidth * static_cast<int>(i % kPlotsAcross),
              y = kHead + kPlotHeight * static_cast<int>(i / kPlotsAcross);
    // A nested <svg> element needs its own place and size.
    svg += "<svg x='" + std::to_string(x) + "' y='" + std::to_string(y) + "' width='" + std::to_string(kPlotWidth) +
           "' height='" + std::to_string(kPlotHeight) + "'" + plots[i].substr(std::string_view("<svg").size());
  }
  return svg + "</svg>\n";
}

}  // namespace fulcrum::supervisor
