#include "services/apps/replayer/lock_step_report.h"

#include "services/apps/replayer/report_format.h"

namespace fulcrum::replay {
namespace {

std::string Describe(const Departure& departure) {
  return Format("tick %llu (session time %.3f s): state hash recorded %016llx, replayed %016llx; ",
                static_cast<unsigned long long>(departure.tick), departure.session_time_s,
                static_cast<unsigned long long>(departure.recorded_hash),
                static_cast<unsigned long long>(departure.replayed_hash)) +
         departure.field;
}

double Speed(const LockStepResult& result) { return result.wall_s > 0 ? result.session_s / result.wall_s : 0; }

}  // namespace

std::string ReportText(const LockStepResult& result) {
  std::string text;
  for (const NodeResult& node : result.nodes) {
    const bool restarted = node.starts > 1;
    text += Format("%-14s %8llu ticks to %8.2f s, %8llu states compared%s: %s\n", NodeName(node.node),
                   static_cast<unsigned long long>(node.ticks), node.session_time_s,
                   static_cast<unsigned long long>(node.compared),
                   restarted ? Format(", %llu restarts", static_cast<unsigned long long>(node.starts - 1)).c_str() : "",
                   node.good()      ? "all the same"
                   : node.departure ? "DIFFERENT"
                                    : "NOT COMPLETE");
    if (node.departure) text += "  first difference: " + Describe(*node.departure) + '\n';
    if (!node.missing.empty()) text += "  missing: " + node.missing + '\n';
  }
  for (const std::string& fault : result.faults) text += "INCOMPLETE RECORDING: " + fault + '\n';
  text += Format("%.2f s of the session in %.2f s: %.1f x real time\n", result.session_s, result.wall_s, Speed(result));
  return text;
}

void WriteReportJson(const LockStepResult& result, const std::filesystem::path& file) {
  std::string json = Format("{\n  \"same\": %s,\n  \"session_s\": %.6f,\n  \"speed_x_realtime\": %.3f",
                            result.good() ? "true" : "false", result.session_s, Speed(result));
  for (const NodeResult& node : result.nodes) {
    const auto add = [&](const char* key, const std::string& value) {
      json += std::string(",\n  \"") + NodeName(node.node) + "." + key + "\": " + value;
    };
    add("ticks", std::to_string(node.ticks));
    add("compared", std::to_string(node.compared));
    add("mismatches", std::to_string(node.mismatches));
    add("starts", std::to_string(node.starts));
    add("busy_s", Format("%.6f", node.busy_s));
    add("departure", JsonString(node.departure ? Describe(*node.departure) : std::string()));
    add("missing", JsonString(node.missing));
  }
  json += "\n}\n";
  WriteText(file, json);
}

}  // namespace fulcrum::replay
