#include "services/session/supervisor/report.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <vector>

#include "services/base/core/escape.h"
#include "services/session/supervisor/picture.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/svg_plot.h"

namespace fulcrum::supervisor {
namespace {

constexpr std::size_t kSheetFrames = 9;
constexpr unsigned kSheetShrink = 2;
constexpr std::uintmax_t kMostEmbedded_B = 32'000'000;

constexpr const char* kStyle = R"css(
:root { color-scheme: light; --ink: #1d2733; --soft: #5b6876; --line: #dde3ea; --accent: #1f6feb; }
* { box-sizing: border-box; }
body { margin: 0; background: #f4f6f9; color: var(--ink); font: 18px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1240px; margin: 0 auto; padding: 36px 28px 80px; }
h1 { font-size: 38px; line-height: 1.15; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 25px; margin: 52px 0 16px; }
p.sub { color: var(--soft); margin: 8px 0 22px; }
.verdict { display: inline-block; padding: 9px 20px; border-radius: 8px; font-weight: 600; }
.verdict.good { background: #d9f2e2; color: #0b5a2b; } .verdict.bad { background: #fbdcdb; color: #8d1512; }
.tiles { display: grid; grid-template-columns: repeat(auto-fill, minmax(208px, 1fr)); gap: 14px; margin-top: 26px; }
.tile, .card { background: #fff; border: 1px solid var(--line); border-radius: 12px; padding: 16px 20px; }
.tile b { display: block; font-size: 32px; line-height: 1.2; font-variant-numeric: tabular-nums; }
.tile b small { font-size: 18px; color: var(--soft); font-weight: 500; } .tile span { color: var(--soft); font-size: 16px; }
img, video { display: block; width: 100%; border-radius: 10px; background: #000; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: 16px; padding: 6px 2px 0; }
.sheet { display: grid; grid-template-columns: repeat(3, 1fr); gap: 16px; margin-top: 20px; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(520px, 1fr)); gap: 16px; }
svg { width: 100%; height: auto; display: block; } svg text { font-size: 17px; fill: var(--soft); }
svg text.title { font-size: 20px; font-weight: 600; fill: var(--ink); } svg .grid { stroke: #e6eaf0; }
svg .mark { stroke: #d1242f; stroke-width: 1.5; stroke-dasharray: 5 4; }
table { width: 100%; border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 17px; }
th { text-align: right; font-weight: 600; color: var(--soft); font-size: 15px; border-bottom: 2px solid var(--line); }
th, td { padding: 9px 10px; } td { text-align: right; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child, td.text, th.text { text-align: left; } tr.bad td { color: #8d1512; } tr.soft td { color: var(--soft); } tr.sum td { font-weight: 600; } .scroll { overflow-x: auto; }
details { margin-top: 14px; } summary { cursor: pointer; font-weight: 600; }
pre { background: #fff; border: 1px solid var(--line); border-radius: 12px; padding: 18px; overflow-x: auto; font-size: 15px; }
@media (max-width: 760px) { .sheet { grid-template-columns: 1fr; } .plots { grid-template-columns: 1fr; } }
)css";

std::string Tag(const std::string& name, const std::string& text) {
  return "<" + name + ">" + EscapeHtml(text) + "</" + name.substr(0, name.find(' ')) + ">";
}

std::string MsText(float us) { return Fixed(1e-3 * static_cast<double>(us), 2); }

std::string Header(const SessionOutcome& outcome) {
  const bool good = outcome.exit_code == ExitCode::kDone;
  std::string html = Tag("h1", "Session on \"" + outcome.scene_name + "\"");
  html += Tag("p class='sub'", outcome.started_utc + " · " + Fixed(outcome.duration_s, 1) + " s of session time · " +
                                   std::to_string(outcome.nodes.size()) + " nodes · " + outcome.machine);
  html += Tag(std::string("div class='verdict ") + (good ? "good'" : "bad'"),
              good ? "✓ all well" : "✗ " + outcome.verdict());
  for (const std::string& notice : outcome.notices) html += Tag("p class='sub'", "! " + notice);
  return html;
}

std::string Tiles(const SessionOutcome& outcome, const SessionRecord& record) {
  std::string html = "<div class='tiles'>";
  for (const KeyFigure& figure : KeyFigures(outcome, record)) {
    html += "<div class='tile'><b>" + Fixed(figure.value, figure.decimals) + " <small>" + figure.unit +
            "</small></b><span>" + EscapeHtml(figure.label) + "</span></div>\n";
  }
  return html + "</div>\n";
}

std::string Picture(const Frame& frame, unsigned shrink) {
  const std::string data = EmbedPng(frame.file, shrink);
  if (data.empty()) {
    return {};
  }
  const std::string time = Fixed(frame.time_s, 1) + " s";
  return "<figure><img alt='the scene at " + time + "' src='" + data + "'><figcaption>" + time +
         "</figcaption></figure>\n";
}

std::string Base64Of(const std::string& text) {
  return Base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// Section with the video of a recorded session. It is embedded, so that the report stays one file, unless it is large.
std::string Video(const SessionOutcome& outcome) {
  if (outcome.recording.empty()) return {};
  const std::string title = Tag("h2", "The session as a video");
  const SessionVideo& video = outcome.video;
  if (video.file.empty()) {
    return video.missing.empty()
               ? std::string()
               : title + Tag("p", "There is none: " + video.missing + ". Draw it with: " + video.command);
  }
  std::string words;
  for (const std::string& chapter : video.chapters) words += (words.empty() ? "" : " · ") + chapter;
  if (video.is_part) words += ". The recorder was restarted: this is the part before.";
  std::error_code unknown;
  const bool embed = std::filesystem::file_size(video.file, unknown) <= kMostEmbedded_B && !unknown;
  std::string source = video.file.filename().string();
  if (embed) {
    std::ifstream in(video.file, std::ios::binary);
    source = "data:video/mp4;base64," + Base64Of({std::istreambuf_iterator<char>(in), {}});
  } else {
    words += ". The video is too large for this page: " + video.file.string();
  }
  return title + "<div class='card'><figure><video controls muted src='" + source +
         "'><track default kind='subtitles' label='events' src='data:text/vtt;base64," + Base64Of(video.subtitles) +
         "'></video>" + Tag("figcaption", words) + "</figure></div>\n";
}

std::string Pictures(const std::filesystem::path& folder) {
  const std::vector<Frame> frames = FindFrames(folder);
  if (frames.empty()) {
    return Tag("h2", "Pictures") + Tag("p", "No picture was written in this session.");
  }
  std::string html = Tag("h2", "The last picture") + "<div class='card'>" + Picture(frames.back(), 1) + "</div>\n";
  html += Tag("h2", "Over time") + "<div class='sheet'>\n";
  for (const Frame& frame : Spread(frames, kSheetFrames)) {
    html += Picture(frame, kSheetShrink);
  }
  return html + "</div>\n";
}

/// Section with the map of the cut, drawn from the recording.
std::string CutMap(const std::filesystem::path& picture) {
  const std::string data = picture.empty() ? std::string() : EmbedPng(picture, 1);
  return data.empty() ? std::string()
                      : Tag("h2", "The cut") +
                            "<div class='card'><figure><img style='width: auto; max-width: 100%; margin: 0 auto' "
                            "alt='map of the cut' src='" +
                            data +
                            "'><figcaption>Drawn from the recording; fulcrum log map draws it again."
                            "</figcaption></figure></div>\n";
}

std::string Plots(const SessionOutcome& outcome, const SessionRecord& record) {
  PlotSettings settings;
  settings.end_s = outcome.duration_s;
  for (const RestartRecord& restart : record.restarts()) {
    settings.marks_s.push_back(restart.time_s);
  }
  std::string html;
  const auto add = [&](const char* title, const char* unit, const std::vector<PlotLine>& lines) {
    settings.title = title;
    settings.unit = unit;
    const std::string plot = SvgPlot(settings, lines);
    if (!plot.empty()) {
      html += "<div class='card'>" + plot + "</div>\n";
    }
  };
  const auto line = [&](const std::string& label, const char* colour, const std::string& metric) {
    return PlotLine{label, colour, &record.curve(metric)};
  };
  const auto lines_of = [&](const char* force) {
    constexpr std::array kColours{"#1f6feb", "#bc4c00", "#8250df", "#1a7f37"};
    std::vector<PlotLine> lines;
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      PlotLine of_tool =
          line("tool " + std::to_string(i + 1), kColours[i % kColours.size()], force + std::to_string(i) + "_N");
      if (!of_tool.curve->points().empty()) lines.push_back(std::move(of_tool));
    }
    return lines;
  };
  add("Force (of the tissue on the tool)", "N", lines_of("force"));
  add("Hottest spot", "°C", {line("temperature", "#cf222e", "temperature_C")});
  add("Cut length", "mm", {line("cut", "#8250df", "cut_length_mm")});
  add("Power of the generator", "W", {line("set", "#57606a", "set_power_W"), line("delivered", "#bc4c00", "power_W")});
  add("Displacement of the tissue", "mm", {line("displacement", "#1a7f37", "displacement_mm")});
  add("Hand force (sent to the device)", "N", lines_of("hand_force"));
  if (html.empty()) {
    return {};
  }
  const char* note = settings.marks_s.empty() ? "" : "<p class='sub'>Dashed red lines: a node was restarted.</p>";
  return Tag("h2", "Figures over session time") + note + "<div class='plots'>" + html + "</div>\n";
}

std::string Nodes(const SessionOutcome& outcome, const SessionRecord& record) {
  std::string html = Tag("h2", "Nodes") + "<div class='card scroll'><table><tr>";
  for (const char* head : {"node", "rate asked Hz", "achieved Hz", "step p50 ms", "p99 ms", "max ms", "wake p99 ms",
                           "overruns", "drops", "restarts", "slowest rejoin s"}) {
    html += Tag("th", head);
  }
  html += "</tr>\n";
  for (const NodeId id : outcome.nodes) {
    const NodeFigures& node = record.node(id);
    html += node.failed ? "<tr class='bad'>" : "<tr>";
    html += Tag("td", std::string(NodeName(id)) + (node.failed ? " (failed)" : node.seen ? "" : " (silent)"));
    for (const std::string& cell :
         {Fixed(node.rate_asked_Hz, 0), Fixed(node.rate_achieved_Hz, 1), MsText(node.step.p50_us),
          MsText(node.step.p99_us), MsText(node.step.max_us), MsText(node.wake.p99_us), std::to_string(node.overruns),
          std::to_string(node.drops), std::to_string(node.restarts),
          node.restarts > 0 ? Fixed(node.longest_rejoin_s, 2) : std::string("–")}) {
      html += Tag("td", cell);
    }
    html += "</tr>\n";
    if (!node.last_error.empty()) {
      html += "<tr class='bad'><td class='text' colspan='11'>" + EscapeHtml(node.last_error) + "</td></tr>\n";
    }
  }
  return html + "</table></div>\n" +
         "<p class='sub'>Achieved: ticks per second of session time, time while a node was dead included. Drops: "
         "samples "
         "lost, refused at the gate or not written.</p>\n";
}

std::string Restarts(const SessionRecord& record) {
  if (record.restarts().empty()) {
    return {};
  }
  std::string html = Tag("h2", "Restarts") +
                     "<div class='card scroll'><table><tr><th class='text'>session time</th><th class='text'>node</th>"
                     "<th class='text'>cause</th><th>rejoined after s</th></tr>\n";
  for (const RestartRecord& restart : record.restarts()) {
    html += "<tr>" + Tag("td", Fixed(restart.time_s, 1) + " s") + Tag("td class='text'", NodeName(restart.node)) +
            Tag("td class='text'", restart.cause) +
            Tag("td", restart.rejoin_s >= 0 ? Fixed(restart.rejoin_s, 2) : std::string("did not rejoin")) + "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string Faults(const SessionOutcome& outcome) {
  if (outcome.faults.empty()) {
    return {};
  }
  std::string html = Tag("h2", "Faults") +
                     "<div class='card scroll'><table><tr><th class='text'>session time</th>"
                     "<th class='text'>fault</th></tr>\n";
  for (const Fault& fault : outcome.faults) {
    html += "<tr class='bad'>" + Tag("td", Fixed(std::max(0.0, fault.time_s), 1) + " s") +
            Tag("td class='text'", fault.text) + "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string Refusals(const SessionRecord& record) {
  if (record.refused().empty()) {
    return {};
  }
  std::string html = Tag("h2", "Refused on the bus") +
                     "<div class='card scroll'><table><tr><th class='text'>session time</th>"
                     "<th class='text'>participant and reason</th></tr>\n";
  for (const RefusalRecord& refusal : record.refused()) {
    html += "<tr>" + Tag("td", Fixed(refusal.time_s, 1) + " s") + Tag("td class='text'", refusal.what) + "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string Events(const SessionRecord& record) {
  std::string html = Tag("h2", "Thermal events");
  if (record.events().empty()) {
    return html + Tag("p", "None.");
  }
  html += "<p>";
  const char* separator = "";
  for (const auto& [kind, count] : record.event_counts()) {
    html += separator + std::string(EventName(kind)) + " × " + std::to_string(count);
    separator = " · ";
  }
  html +=
      "</p>\n<details><summary>All, in order</summary><div class='card scroll'><table>"
      "<tr><th class='text'>session time</th><th class='text'>event</th><th>temperature °C</th></tr>\n";
  for (const EventRecord& event : record.events()) {
    html += "<tr>" + Tag("td", Fixed(event.time_s, 2) + " s") + Tag("td class='text'", EventName(event.kind)) +
            Tag("td", Fixed(event.temperature_C, 0)) + "</tr>\n";
  }
  html += "</table></div></details>\n";
  return html;
}

}  // namespace

const char* PageStyle() { return kStyle; }

std::string ReportHtml(const SessionOutcome& outcome, const SessionRecord& record,
                       const std::filesystem::path& frames) {
  std::string html =
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'><title>Fulcrum · ";
  html += EscapeHtml(outcome.scene_name + " · " + outcome.session_id) + "</title><style>" + kStyle;
  html += "</style></head><body><main>\n";
  html += Header(outcome) + Tiles(outcome, record) + (outcome.sheet ? SheetHtml(*outcome.sheet, outcome.trainee) : "") +
          Video(outcome) + Pictures(frames) + CutMap(outcome.cut_map) + Plots(outcome, record) +
          Nodes(outcome, record) + Faults(outcome) + Restarts(record) + Refusals(record) + Events(record);
  if (!outcome.recording.empty()) {
    html += Tag("h2", "Recording") + Tag("p", "All topics: " + outcome.recording.string() + ", " +
                                                  RecordingLosses(record) + " (details: fulcrum log info).");
  }
  html += Tag("h2", "Configuration") + "<details><summary>Effective configuration of this session</summary><pre>" +
          EscapeHtml(outcome.configuration) + "</pre></details>\n</main></body></html>\n";
  return html;
}

}  // namespace fulcrum::supervisor
