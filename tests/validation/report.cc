// What a user reads of a validation: lines, a page with plots, JUnit.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "services/base/core/escape.h"
#include "tests/validation/validation.h"

namespace fulcrum::validation {
namespace {

std::string Format(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

std::string Percent(double value) {
  return std::isnan(value) ? "-" : std::abs(value) < 0.005 ? "0.00" : Format("%+.2f", value);
}

/// A quantity or an exact error that is 0: the case gives the error alone.
std::string Value(const Row& row, double value) {
  if (row.expected.value == 0) return "-";
  return Format("%.4g", value) + " " + row.expected.unit;
}

void WriteText(const std::string& text, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

/// Errors on the three meshes as shares of the tolerance, logarithmic; the line in the middle is the tolerance.
std::string Plot(const Row& row) {
  constexpr double kWidth = 120, kHeight = 36, kDecades = 3;  // from the lower edge to the upper one
  const auto height = [&](double error_pct) {
    const double share = std::max(std::abs(error_pct) / row.expected.tolerance_pct, 1e-9);
    return std::clamp(kHeight / 2 - kHeight * std::log10(share) / kDecades, 2.0, kHeight - 2);
  };
  std::string points, dots;
  const double errors[] = {row.half_error_pct, row.error_pct, row.twice_error_pct};
  for (int i = 0; i < 3; ++i) {
    if (std::isnan(errors[i])) continue;
    const std::string x = Format("%.1f", kWidth * (0.15 + 0.35 * i)), y = Format("%.1f", height(errors[i]));
    points.append(x).append(",").append(y).append(" ");
    dots.append("<circle cx='").append(x).append("' cy='").append(y).append("' r='2.5'/>");
  }
  return "<svg width='120' height='36' viewBox='0 0 120 36' role='img' aria-label='errors on three meshes'>"
         "<line x1='0' x2='120' y1='18' y2='18'/><polyline points='" +
         points + "'/>" + dots + "</svg>";
}

std::size_t Failed(const std::vector<Row>& rows) {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const Row& row) { return !row.passed(); }));
}

}  // namespace

std::string Line(const Row& row) {
  char text[256];
  std::snprintf(text, sizeof(text), "%-6s %-22s %14s %14s %9s of %-6s %9s %9s %6s  %s", row.passed() ? "ok" : "FAILED",
                row.quantity.c_str(), Value(row, row.measured).c_str(), Value(row, row.expected.value).c_str(),
                Percent(row.error_pct).c_str(), Format("%g", row.expected.tolerance_pct).c_str(),
                Percent(row.half_error_pct).c_str(), Percent(row.twice_error_pct).c_str(),
                std::isnan(row.order) ? "-" : Format("%.1f", row.order).c_str(), row.expected.kind.c_str());
  return text;
}

void WriteHtml(const std::vector<Row>& rows, const std::filesystem::path& file) {
  std::string html =
      "<!doctype html><html lang='en'><meta charset='utf-8'><title>Fulcrum: validation</title><style>"
      "body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:76em;padding:0 1em;color:#1d2733}"
      "table{border-collapse:collapse;width:100%}th,td{padding:.3em .6em;text-align:right;border-bottom:1px solid "
      "#dde3ea}th:first-child,td:first-child,td:last-child,th:last-child{text-align:left}td:nth-child(-n+3){white-"
      "space:nowrap}"
      ".ok{color:#1a7f37}.bad{color:#b42318;font-weight:600}svg line{stroke:#b42318;stroke-dasharray:3 3}"
      "svg polyline{fill:none;stroke:#2563a8;stroke-width:1.5}svg circle{fill:#2563a8}small{color:#5b6775}"
      "</style><h1>Validation</h1><p>";
  html += std::to_string(rows.size() - Failed(rows)) + " of " + std::to_string(rows.size()) +
          " quantities are within their tolerance. Errors are in per cent of the expected value, on the default mesh, "
          "and on meshes half and twice as fine. The plot shows these errors from coarse to fine, on a logarithmic "
          "scale about the tolerance (dashed); below the line is within it.</p>";
  for (const Case& one : Cases()) {
    bool begun = false;
    for (const Row& row : rows) {
      if (row.case_name != one.name) continue;
      if (!begun) {
        html += "<h2>" + EscapeHtml(one.name) + "</h2><p>" + EscapeHtml(one.about) + " <small>" +
                Format("%.1f", row.run_s) +
                " s</small></p><table><tr><th>quantity<th>measured<th>expected<th>error, %"
                "<th>tolerance, %<th>half as fine, %<th>twice as fine, %<th>order<th>plot<th>source</tr>";
        begun = true;
      }
      html += "<tr><td class='" + std::string(row.passed() ? "ok'>✓ " : "bad'>✗ ") + EscapeHtml(row.quantity) + "<td>" +
              EscapeHtml(Value(row, row.measured)) + "<td>" + EscapeHtml(Value(row, row.expected.value)) + "<td>" +
              Percent(row.error_pct) + "<td>" + Format("%g", row.expected.tolerance_pct) + "<td>" +
              Percent(row.half_error_pct) + "<td>" + Percent(row.twice_error_pct) + "<td>" +
              (std::isnan(row.order) ? "-" : Format("%.1f", row.order)) + "<td>" + Plot(row) + "<td>" +
              EscapeHtml(row.expected.kind + ": " + row.expected.source) + "</tr>";
    }
    if (begun) html += "</table>";
  }
  WriteText(html + "</html>\n", file);
}

void WriteJUnit(const std::vector<Row>& rows, const std::filesystem::path& file) {
  const std::string counts =
      " tests=\"" + std::to_string(rows.size()) + "\" failures=\"" + std::to_string(Failed(rows)) + "\" errors=\"0\"";
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"fulcrum validate\"" + counts +
                    ">\n  <testsuite name=\"validation\"" + counts + ">\n";
  for (const Row& row : rows) {
    xml += "    <testcase classname=\"fulcrum." + EscapeHtml(row.case_name) + "\" name=\"" + EscapeHtml(row.quantity) +
           "\" time=\"" + Format("%.3f", row.run_s) + "\"";
    if (row.passed()) {
      xml += "/>\n";
      continue;
    }
    xml += "><failure message=\"" + Percent(row.error_pct) + " %; at most " + Format("%g", row.expected.tolerance_pct) +
           " % is allowed\">" + EscapeHtml(Line(row)) + "</failure></testcase>\n";
  }
  WriteText(xml + "  </testsuite>\n</testsuites>\n", file);
}

}  // namespace fulcrum::validation
