#include "services/session/supervisor/outcome.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "services/session/supervisor/flat_json.h"
#include "services/session/supervisor/score_sheet.h"

namespace fulcrum::supervisor {
namespace {

double Ms(float us) { return 1e-3 * static_cast<double>(us); }

}  // namespace

std::string Fixed(double value, int decimals) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  std::string result = text.data();
  if (result.find_first_not_of("-0.") == std::string::npos && result.front() == '-') {
    result.erase(0, 1);
  }
  return result;
}

std::string SessionOutcome::verdict() const {
  std::string line;
  for (const Fault& fault : faults) line += (line.empty() ? "" : "; ") + fault.text;
  return line;
}

std::vector<KeyFigure> KeyFigures(const SessionOutcome& outcome, const SessionRecord& record) {
  using enum NodeId;
  struct Source {
    NodeId node;
    const char *key, *label, *unit;
    int decimals;
    bool at_end = false;  ///< The last value instead of the highest: a slit that is still short has larger deviations.
    bool if_any = false;  ///< Only if it was reported.
  };
  constexpr std::array kSources{
      Source{kPhysics, "peak_force_N", "peak force", "N", 2},
      Source{kHaptics, "peak_hand_force_N", "peak hand force", "N", 2},
      Source{kThermal, "highest_temperature_C", "highest temperature", "°C", 0},
      Source{kThermal, "cut_length_mm", "cut length", "mm", 1},
      Source{kThermal, "cut_width_p50_mm", "width of the slit, median", "mm", 2, true},
      Source{kThermal, "cut_off_way_mm", "slit off the metal's way, 95 %", "mm", 2, true},
      Source{kThermal, "hook_temperature_C", "highest temperature of the hook", "°C", 0},
      Source{kPhysics, "max_displacement_mm", "largest displacement", "mm", 1},
      Source{kPhysics, "largest_stretch", "largest stretch of the membrane", "", 2},
      Source{kPhysics, "torn_edges", "membrane edges torn", "", 0},
      Source{kPhysics, "grasped_particles", "particles grasped at most", "", 0},
      Source{kThermal, "dead_edges", "membrane edges severed", "", 0},
      Source{kThermal, "warnings", "warnings", "", 0},
      Source{kThermal, "injuries", "injuries", "", 0},
      Source{kPhysics, "quarantined", "particles quarantined", "", 0},
      Source{kPhysics, "time_lost_s", "time that the tissue fell behind", "s", 2, false, true},
      Source{kHaptics, "motion_to_force_p50_ms", "motion to force, median", "ms", 1, true, true},
      Source{kHaptics, "motion_to_force_p99_ms", "motion to force, 99 %", "ms", 1, true, true},
      Source{kRender, "motion_to_picture_p50_ms", "motion to picture, median", "ms", 0, true, true},
      Source{kRender, "motion_to_picture_p95_ms", "motion to picture, 95 %", "ms", 0, true, true},
      Source{kRender, "png_written", "pictures", "", 0}};
  std::vector<KeyFigure> figures;
  for (const Source& source : kSources) {
    if (!record.node(source.node).seen) continue;  // A scene without thermal_node has no temperature, rather than 0.
    if (source.if_any && record.curve(source.key).points().empty()) continue;
    figures.push_back({source.key, source.label, source.unit, source.decimals,
                       source.at_end ? record.last(source.key) : record.peak(source.key)});
  }
  for (const auto& [solid, m2] : record.burnt_m2()) {
    const std::string name = solid < outcome.solids.size()          ? outcome.solids[solid]
                             : outcome.solids.empty() && solid == 0 ? "organ"
                                                                    : "solid " + std::to_string(solid);
    std::string key = "burnt." + name + "_mm2";
    std::replace(key.begin(), key.end(), ' ', '_');
    figures.push_back({key, "burnt surface of " + name, "mm²", 1, 1e6 * m2});
  }
  return figures;
}

std::string RecordingLosses(const SessionRecord& record) {
  const std::uint64_t lost = record.node(NodeId::kRecorder).drops;
  const int restarts = record.node(NodeId::kRecorder).restarts;
  return (lost == 0 ? "no sample lost" : std::to_string(lost) + " samples lost") +
         (restarts == 0 ? "" : " but for those of " + std::to_string(restarts) + " restarts of the recorder");
}

std::string SummaryJson(const SessionOutcome& outcome, const SessionRecord& record) {
  FlatJson json;
  json.Add("scene", outcome.scene_name);
  json.Add("session", outcome.session_id);
  json.Add("started", outcome.started_utc);
  json.Add("machine", outcome.machine);
  json.Add("ok", outcome.exit_code == ExitCode::kDone);
  json.Add("exit_code", static_cast<double>(outcome.exit_code));
  json.Add("verdict", outcome.verdict());
  json.Add("faults", static_cast<double>(outcome.faults.size()));
  json.Add("session_seconds", outcome.duration_s);
  json.Add("wanted_seconds", outcome.wanted_s);
  for (const KeyFigure& figure : KeyFigures(outcome, record)) {
    json.Add(figure.key, figure.value);
  }
  if (!outcome.recording.empty()) {
    json.Add("recording", outcome.recording.string());
    json.Add("samples_not_recorded", static_cast<double>(record.node(NodeId::kRecorder).drops));
  }
  if (outcome.sheet) {
    json.Add("score_pct", outcome.sheet->score.percent());
  }
  json.Add("restarts", static_cast<double>(record.restarts().size()));
  json.Add("refused.participants", static_cast<double>(record.refusals().participants));
  json.Add("refused.endpoints", static_cast<double>(record.refusals().endpoints));
  for (const auto& [kind, count] : record.event_counts()) {
    std::string name = EventName(kind);
    for (char& c : name) {
      c = c == ' ' ? '_' : c;
    }
    json.Add("events." + name, static_cast<double>(count));
  }
  for (const NodeId id : outcome.nodes) {
    const NodeFigures& node = record.node(id);
    const std::string prefix = std::string(NodeName(id)) + ".";
    json.Add(prefix + "failed", node.failed);
    json.Add(prefix + "rate_asked_Hz", node.rate_asked_Hz);
    json.Add(prefix + "rate_achieved_Hz", node.rate_achieved_Hz);
    json.Add(prefix + "ticks", static_cast<double>(node.ticks));
    json.Add(prefix + "step_p50_ms", Ms(node.step.p50_us));
    json.Add(prefix + "step_p99_ms", Ms(node.step.p99_us));
    json.Add(prefix + "step_max_ms", Ms(node.step.max_us));
    json.Add(prefix + "wake_p99_ms", Ms(node.wake.p99_us));
    json.Add(prefix + "overruns", static_cast<double>(node.overruns));
    json.Add(prefix + "drops", static_cast<double>(node.drops));
    json.Add(prefix + "restarts", static_cast<double>(node.restarts));
    json.Add(prefix + "longest_rejoin_s", node.longest_rejoin_s);
  }
  return json.text();
}

namespace {

/// Table with one row per node.
std::string NodeTable(const std::vector<NodeId>& nodes, const SessionRecord& record) {
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), "%-14s %-6s %15s %27s %9s %6s %8s\n", "node", "state", "rate / asked Hz",
                "step p50 / p99 / max ms", "overruns", "drops", "restarts");
  std::string table = line.data();
  for (const NodeId id : nodes) {
    const NodeFigures& node = record.node(id);
    const char* state = node.failed ? "failed" : node.seen ? "ok" : "silent";
    const std::string rate = Fixed(node.rate_achieved_Hz, 1) + " / " + Fixed(node.rate_asked_Hz, 0);
    const std::string step = Fixed(Ms(node.step.p50_us), 2) + " / " + Fixed(Ms(node.step.p99_us), 2) + " / " +
                             Fixed(Ms(node.step.max_us), 2);
    std::snprintf(line.data(), line.size(), "%-14s %-6s %15s %27s %9llu %6llu %8d\n", NodeName(id), state, rate.c_str(),
                  step.c_str(), static_cast<unsigned long long>(node.overruns),
                  static_cast<unsigned long long>(node.drops), node.restarts);
    table += line.data();
    if (!node.last_error.empty()) {
      table += "               └ " + node.last_error + "\n";
    }
  }
  return table;
}

}  // namespace

std::string FinalTable(const SessionOutcome& outcome, const SessionRecord& record) {
  std::string text = NodeTable(outcome.nodes, record) + "\n";
  for (const KeyFigure& figure : KeyFigures(outcome, record)) {
    std::array<char, 128> line{};
    std::snprintf(line.data(), line.size(), "%-34s %10s %s\n", figure.label.c_str(),
                  Fixed(figure.value, figure.decimals).c_str(), figure.unit);
    text += line.data();
  }
  for (const std::string& notice : outcome.notices) text += "! " + notice + "\n";
  for (const RestartRecord& restart : record.restarts()) {
    text += std::string("restart at ") + Fixed(restart.time_s, 1) + " s: " + NodeName(restart.node) + " " +
            restart.cause +
            (restart.rejoin_s >= 0 ? std::string(", rejoined after ") + Fixed(restart.rejoin_s, 2) + " s"
                                   : ", did not rejoin") +
            "\n";
  }
  for (const RefusalRecord& refusal : record.refused()) {
    text += "refused at " + Fixed(refusal.time_s, 1) + " s: " + refusal.what + "\n";
  }
  if (!outcome.recording.empty()) {
    text += "recording: " + outcome.recording.string() + ", " + RecordingLosses(record) + "\n";
  }
  for (const Fault& fault : outcome.faults) {
    text += "fault at " + Fixed(std::max(0.0, fault.time_s), 1) + " s: " + fault.text + "\n";
  }
  if (outcome.sheet) {
    text += "\n" + SheetTable(*outcome.sheet);
  }
  text += std::string("\n") + Fixed(outcome.duration_s, 1) + " s of \"" + outcome.scene_name + "\": ";
  text += outcome.faults.empty() ? "all well\n" : "NOT WELL: " + outcome.verdict() + "\n";
  return text;
}

}  // namespace fulcrum::supervisor
