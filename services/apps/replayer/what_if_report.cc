#include "services/apps/replayer/what_if_report.h"

#include <algorithm>

#include "services/apps/replayer/report_format.h"

namespace fulcrum::replay {
namespace {

std::string PairLine(const char* name, const Pair& pair) {
  return Format("%-28s %12.4g %12.4g %+12.4g\n", name, pair.before, pair.after, pair.after - pair.before);
}

}  // namespace

std::string ReportText(const WhatIfResult& result, const std::vector<NodeId>& nodes) {
  const auto has = [&](NodeId node) { return std::find(nodes.begin(), nodes.end(), node) != nodes.end(); };
  std::string text;
  if (result.first_difference_s < 0) {
    text = "no state differs: the change has no effect on this session\n";
  } else {
    text = Format("first difference: %s at %.3f s\n", NodeName(result.first_node), result.first_difference_s);
  }
  text += Format("%-28s %12s %12s %12s\n", "", "before", "after", "change");
  if (has(NodeId::kPhysics)) text += PairLine("peak force [N]", result.peak_tissue_force_N);
  if (has(NodeId::kHaptics)) text += PairLine("peak hand force at the tip [N]", result.peak_hand_force_N);
  if (has(NodeId::kThermal)) {
    text += PairLine("cut length [mm]", result.cut_length_mm);
    text += PairLine("highest temperature [C]", result.highest_temperature_C);
    text += PairLine("injuries", result.injuries);
    text += PairLine("burnt surface of organs [mm2]", result.burnt_mm2);
  }
  if (has(NodeId::kPhysics)) {
    text += Format("positions apart: rms %.4g mm, at most %.4g mm (at %.2f s)\n", result.rms_position_mm,
                   result.max_position_mm, result.max_position_s);
    text += Format("forces apart: rms %.4g N\n", result.rms_tissue_force_N);
  }
  if (has(NodeId::kHaptics)) text += Format("hand forces at the tip apart: rms %.4g N\n", result.rms_hand_force_N);
  if (!result.missing.empty()) text += "ended early: " + result.missing + '\n';
  return text + Format("%llu ticks, %.2f s of the session, twice in %.2f s\n",
                       static_cast<unsigned long long>(result.ticks), result.session_s, result.wall_s);
}

void WriteReportJson(const WhatIfResult& result, const std::filesystem::path& file) {
  std::string json = "{\n  \"missing\": " + JsonString(result.missing);
  const auto add = [&](const std::string& name, double value) {
    json += ",\n  \"" + name + "\": " + Format("%.9g", value);
  };
  const auto add_pair = [&](const std::string& name, const Pair& pair) {
    add(name + ".before", pair.before);
    add(name + ".after", pair.after);
  };
  add("ticks", static_cast<double>(result.ticks));
  add("session_s", result.session_s);
  add("wall_s", result.wall_s);
  add("first_difference_s", result.first_difference_s);
  add("frames", static_cast<double>(result.frames));
  add("rms_position_mm", result.rms_position_mm);
  add("max_position_mm", result.max_position_mm);
  add("max_position_s", result.max_position_s);
  add_pair("peak_tissue_force_N", result.peak_tissue_force_N);
  add("rms_tissue_force_N", result.rms_tissue_force_N);
  add_pair("peak_hand_force_N", result.peak_hand_force_N);
  add("rms_hand_force_N", result.rms_hand_force_N);
  add_pair("cut_length_mm", result.cut_length_mm);
  add_pair("highest_temperature_C", result.highest_temperature_C);
  add_pair("injuries", result.injuries);
  add_pair("burnt_mm2", result.burnt_mm2);
  WriteText(file, json + "\n}\n");
}

}  // namespace fulcrum::replay
