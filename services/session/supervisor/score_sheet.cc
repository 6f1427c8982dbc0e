#include "services/session/supervisor/score_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "services/base/core/escape.h"
#include "services/session/supervisor/flat_json.h"
#include "services/session/supervisor/svg_plot.h"

namespace fulcrum::supervisor {
namespace {

using assessment::ScoreItem;

std::string ValueText(const MeasureInfo& info, double value) {
  return std::isnan(value) ? std::string("–") : Fixed(value, info.decimals);
}

std::string LimitText(const MeasureInfo& info, double limit) {
  return std::string(info.at_least ? "≥ " : "≤ ") + Fixed(limit, info.decimals);
}

const char* Mark(const ScoreItem& item) { return item.passed ? "✓" : "✗"; }

/// `text` padded to `columns` characters on the left or right; printf would count bytes.
std::string Pad(const std::string& text, int columns, bool right) {
  int seen = 0;
  for (const char c : text) seen += (static_cast<unsigned char>(c) & 0xc0u) != 0x80u;
  const std::string fill(static_cast<std::size_t>(std::max(0, columns - seen)), ' ');
  return right ? fill + text : text + fill;
}

/// Tools of which anything was measured: those that the scene has and a hand moves.
std::vector<std::size_t> MeasuredTools(const assessment::Figures& figures) {
  std::vector<std::size_t> tools;
  for (std::size_t i = 0; i < figures.tool.size(); ++i) {
    const assessment::MeasureValues& values = figures.tool[i];
    if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isnan(value); })) tools.push_back(i);
  }
  return tools;
}

}  // namespace

std::string SheetTable(const ScoreSheet& sheet) {
  std::string table = Pad("measure", 40, false) + Pad("value", 10, true) + Pad("threshold", 12, true) + "     points\n";
  for (const ScoreItem& item : sheet.score.items) {
    const MeasureInfo& info = InfoOf(item.measure);
    const std::string label = info.label + (*info.unit != '\0' ? std::string(" [") + info.unit + "]" : "");
    table += Pad(label, 40, false) + Pad(ValueText(info, item.value), 10, true);
    if (item.of > 0) {
      table += Pad(LimitText(info, item.limit), 12, true) + " " + Mark(item) +
               Pad(Fixed(item.points, 1) + " / " + Fixed(item.of, 0), 12, true);
    }
    table += "\n";
  }
  return table + "score " + Fixed(sheet.score.percent(), 0) + " % (" + Fixed(sheet.score.points, 1) + " of " +
         Fixed(sheet.score.of, 0) + " points)\n";
}

std::string SheetHtml(const ScoreSheet& sheet, const std::string& trainee) {
  const auto cell = [](const std::string& text, const char* style = "") {
    return std::string("<td") + style + ">" + EscapeHtml(text) + "</td>";
  };
  const std::vector<std::size_t> tools = MeasuredTools(sheet.figures);
  std::string tool_heads;  // People count from 1, as in picture, page and time line.
  for (const std::size_t i : tools) tool_heads += "<th>tool " + std::to_string(i + 1) + "</th>";
  std::string html = "<h2>Score sheet" + (trainee.empty() ? std::string() : " of " + EscapeHtml(trainee)) + "</h2>\n" +
                     "<div class='tiles'><div class='tile'><b>" + Fixed(sheet.score.percent(), 0) +
                     " <small>%</small></b><span>" + Fixed(sheet.score.points, 1) + " of " + Fixed(sheet.score.of, 0) +
                     " points</span></div></div>\n<div class='card scroll' style='margin-top:14px'><table><tr>" +
                     "<th class='text'>measure</th>" + tool_heads + "<th>session</th><th>threshold</th>" +
                     "<th class='text'>kept</th><th>points</th></tr>\n";
  for (const ScoreItem& item : sheet.score.items) {
    const MeasureInfo& info = InfoOf(item.measure);
    const auto index = static_cast<std::size_t>(item.measure);
    const bool scored = item.of > 0;
    html += scored ? item.passed ? "<tr>" : "<tr class='bad'>" : "<tr class='soft'>";
    html += cell(info.label + (*info.unit != '\0' ? std::string(" [") + info.unit + "]" : ""), " class='text'");
    for (const std::size_t i : tools) html += cell(ValueText(info, sheet.figures.tool[i][index]));
    html += cell(ValueText(info, item.value)) + cell(scored ? LimitText(info, item.limit) : "") +
            cell(scored ? Mark(item) : "", " class='text'") +
            cell(scored ? Fixed(item.points, 1) + " / " + Fixed(item.of, 0) : std::string("not scored")) + "</tr>\n";
  }
  return html +
         "</table></div>\n<p class='sub'>A kept threshold (≤ or ≥) gives all points. Beyond it the points decrease " +
         "in proportion, to none at twice a threshold with ≤ and at half a threshold with ≥. Points for skill are " +
         "scaled by the completed share of the task.</p>\n";
}

std::string SheetJson(const ScoreSheet& sheet, const SheetFacts& facts) {
  FlatJson json;
  json.Add("scene", facts.scene);
  json.Add("session", facts.session);
  if (!facts.started_utc.empty()) json.Add("started", facts.started_utc);
  if (!facts.trainee.empty()) json.Add("trainee", facts.trainee);
  json.Add("score_pct", sheet.score.percent());
  json.Add("points", sheet.score.points);
  json.Add("of", sheet.score.of);
  for (const ScoreItem& item : sheet.score.items) {
    const MeasureInfo& info = InfoOf(item.measure);
    const std::string key = info.key;
    json.Add(key, item.value);
    for (std::size_t i = 0; i < sheet.figures.tool.size(); ++i) {
      const double own = sheet.figures.tool[i][static_cast<std::size_t>(item.measure)];
      if (!std::isnan(own)) json.Add("tool" + std::to_string(i) + "." + key, own);
    }
    json.Add(key + ".threshold", item.limit);
    json.Add(key + ".passed", item.passed);
    json.Add(key + ".points", item.points);
    json.Add(key + ".of", item.of);
  }
  return json.text();
}

}  // namespace fulcrum::supervisor
