#include "services/session/soak/soak_page.h"

#include <array>
#include <map>

#include "services/base/core/escape.h"
#include "services/session/supervisor/report.h"
#include "services/session/supervisor/svg_plot.h"

namespace fulcrum::soak {
namespace {

using supervisor::Curve;
using supervisor::Fixed;

// Red is reserved for the marks of the kills.
constexpr std::array kColours{"#1f6feb", "#bc4c00", "#1a7f37", "#8250df", "#57606a", "#0b7285", "#9a6700", "#bf3989"};

std::string Cell(const std::string& text) { return "<td>" + EscapeHtml(text) + "</td>"; }

/// Plot with one line per program; its successive processes are parts of that line.
std::string Plot(const SoakRecord& record, const char* title, const char* unit, Curve Life::*figure) {
  std::map<std::string, Curve> curves;
  for (const Life& life : record.lives()) {
    curves[life.program];  // A program without points gets an entry too, so that colours are equal in all plots.
    for (const auto& point : (life.*figure).points()) curves[life.program].Add(point.time_s / 60, point.value);
  }
  std::vector<supervisor::PlotLine> lines;
  lines.reserve(curves.size());
  for (const auto& [program, curve] : curves) {
    lines.push_back({program, kColours[lines.size() % kColours.size()], &curve});
  }
  supervisor::PlotSettings settings;
  settings.title = title;
  settings.unit = unit;
  settings.end_s = record.duration_s() / 60;
  settings.x_label = "session time [min]";
  for (const Blow& blow : record.blows()) {
    if (blow.kind == BlowKind::kKill) settings.marks_s.push_back(blow.time_s / 60);
  }
  const std::string plot = supervisor::SvgPlot(settings, lines);
  return plot.empty() ? "" : "<div class='card'>" + plot + "</div>\n";
}

}  // namespace

std::string SoakPage(const SoakRecord& record, const Limits& limits, const std::string& title,
                     const std::string& session) {
  const bool good = record.Passes(limits);
  std::string html =
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'><title>Fulcrum soak</title><style>";
  html += supervisor::PageStyle();
  html += "</style></head><body><main>\n<h1>Soak on " + EscapeHtml(title) + "</h1>\n";
  html += std::string("<div class='verdict ") + (good ? "good'>✓ nothing grew, nothing fell" : "bad'>✗ not well") +
          (record.verdict().empty() ? "" : ": " + EscapeHtml(record.verdict())) + "</div>\n<div class='tiles'>\n";
  for (const SoakFigure& figure : FiguresOf(record)) {
    const bool whole = figure.value == static_cast<double>(static_cast<long long>(figure.value));
    html += "<div class='tile'><b>" + Fixed(figure.value, whole ? 0 : 2) + " <small>" + figure.unit +
            "</small></b><span>" + figure.key + "</span></div>\n";
  }
  html += "</div>\n<p class='sub'>At most: growth " + Fixed(limits.rss_growth_MB, 0) + " MB, " +
          std::to_string(limits.not_finite) + " refused samples, " + std::to_string(limits.crashes) +
          " crashes. Dashed red lines: a node was killed.</p>\n<div class='plots'>\n";
  html += Plot(record, "Resident memory", "MB", &Life::memory_MB);
  html += Plot(record, "Share of the requested rate", "%", &Life::rate_pct);
  html += Plot(record, "Deviation of the period count from the clock", "ms", &Life::drift_ms);
  html +=
      "</div>\n<h2>Processes</h2><div class='card scroll'><table><tr><th class='text'>program</th><th>process</th>"
      "<th>from s</th><th>to s</th><th>memory at the end MB</th><th>growth MB</th><th>ended</th></tr>\n";
  for (const Life& life : record.lives()) {
    const auto& points = life.memory_MB.points();
    if (points.empty()) continue;
    const char* end = life.was_killed ? "killed on purpose" : life.has_ended ? "BY ITSELF" : "with the session";
    html += "<tr>" + Cell(life.program) + Cell(std::to_string(life.process)) + Cell(Fixed(points.front().time_s, 0)) +
            Cell(Fixed(points.back().time_s, 0)) + Cell(Fixed(points.back().value, 1)) +
            Cell(Fixed(record.GrowthOf(life), 2)) + Cell(end) + "</tr>\n";
  }
  html += "</table></div>\n";
  if (!record.blows().empty()) {
    html += "<h2>Blows</h2><details><summary>" + std::to_string(record.blows().size()) +
            " in order</summary><div class='card scroll'><table><tr><th class='text'>session time</th>"
            "<th class='text'>blow</th><th class='text'>program</th><th>length s</th></tr>\n";
    for (const Blow& blow : record.blows()) {
      html += "<tr>" + Cell(Fixed(blow.time_s, 1) + " s") + "<td class='text'>" + BlowName(blow.kind) +
              "</td><td class='text'>" + EscapeHtml(blow.node) + "</td>" + Cell(Fixed(blow.length_s, 2)) + "</tr>\n";
    }
    html += "</table></div></details>\n";
  }
  html += "<h2>Session</h2><p><a href='" + EscapeHtml(session) + "/report.html'>report.html</a> of the session; " +
          "the output of its nodes is in " + EscapeHtml(session) + "/logs.</p>\n</main></body></html>\n";
  return html;
}

std::string SamplesCsv(const SoakRecord& record) {
  std::string csv = "time_s,program,process,figure,value\n";
  for (const Life& life : record.lives()) {
    const auto add = [&](const char* figure, const Curve& curve) {
      for (const auto& point : curve.points()) {
        csv += Fixed(point.time_s, 1) + ',' + life.program + ',' + std::to_string(life.process) + ',' + figure + ',' +
               Fixed(point.value, 3) + '\n';
      }
    };
    add("memory_MB", life.memory_MB);
    add("rate_pct", life.rate_pct);
    add("drift_ms", life.drift_ms);
  }
  return csv;
}

}  // namespace fulcrum::soak
