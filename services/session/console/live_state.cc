#include "services/session/console/live_state.h"

#include <algorithm>
#include <string_view>

#include "services/session/console/advice.h"
#include "services/session/console/json.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::console {
namespace {

/// The input that drives a node's step: the age of its newest sample is the node's latency. Other inputs are published
/// on changes only, so their age is no latency.
const InputHealth* MainInput(const Health& health) {
  const auto is_main = [&](TopicId topic) {
    switch (health.node) {
      case NodeId::kHaptics:
        return topic == TopicId::kContactModel;
      case NodeId::kPhysics:
        return topic == TopicId::kToolState;
      case NodeId::kThermal:
        return topic == TopicId::kCauteryContact;
      case NodeId::kRender:
        return topic == TopicId::kToolState;  // Frames of tissue at rest are rare.
      default:
        return false;
    }
  };
  for (const InputHealth& input : health.inputs) {
    if (is_main(input.topic) && input.matched && input.age_ms >= 0) return &input;
  }
  return nullptr;
}

NodeReport ReportOf(const SessionWatch& watch, NodeId node) {
  return {node, &watch.health(node), watch.restarts(node), watch.restarted_ns(node)};
}

std::string NodeJson(const NodeReport& report, std::int64_t now_ns) {
  const Health& health = *report.health;
  const NodeCondition condition = ConditionOf(report, now_ns);
  Json json('{');
  json.Text("name", NodeName(report.node)).Text("label", PlainName(report.node));
  json.Text("level", condition.level).Text("word", condition.word);
  json.Number("rate", static_cast<double>(health.rate_achieved_Hz), 0.1);
  json.Number("asked", static_cast<double>(health.rate_asked_Hz), 0.1);
  json.Number("p50", 1e-3 * static_cast<double>(health.step.p50_us), 0.001);
  json.Number("p99", 1e-3 * static_cast<double>(health.step.p99_us), 0.001);
  if (const InputHealth* input = MainInput(health)) {
    json.Text("input", bus::TopicLabel(input->topic)).Number("age", static_cast<double>(input->age_ms), 1);
  }
  json.Number("drops", static_cast<double>(supervisor::DropsOf(health)), 1);
  json.Number("overruns", static_cast<double>(health.overruns), 1);
  return json.Number("restarts", report.restarts, 1).Number("pid", health.pid, 1).Done();
}

std::string FiguresJson(const SessionWatch& watch) {
  Json json('{');
  const auto add = [&](std::string_view key, NodeId node, std::string_view metric, double step) {
    json.Number(key, supervisor::MetricOf(watch.health(node), metric), step);
  };
  if (watch.expects(NodeId::kThermal)) {
    add("temperature_C", NodeId::kThermal, "temperature_C", 0.1);
    add("highest_C", NodeId::kThermal, "highest_temperature_C", 0.1);
    add("power_W", NodeId::kThermal, "power_W", 0.1);
    add("cut_mm", NodeId::kThermal, "cut_length_mm", 0.1);
    add("set_cut_W", NodeId::kSupervisor, "generator_cut_W", 0.1);
    add("set_coag_W", NodeId::kSupervisor, "generator_coag_W", 0.1);
    add("set_blend_W", NodeId::kSupervisor, "generator_blend_W", 0.1);
  }
  double hand_N = 0;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    add(ForceMetric(i), NodeId::kPhysics, ForceMetric(i), 0.01);
    hand_N = std::max(hand_N, supervisor::MetricOf(watch.health(NodeId::kHaptics), "hand_" + ForceMetric(i)));
  }
  add("peak_force_N", NodeId::kPhysics, "peak_force_N", 0.01);
  json.Number("hand_force_N", hand_N, 0.01);
  add("operated_tools", NodeId::kHaptics, "operated_tools", 1);
  return json.Done();
}

std::string WarningsJson(const SessionWatch& watch, const std::vector<NodeReport>& nodes, std::int64_t now_ns) {
  SituationReport situation;
  situation.now_ns = now_ns;
  situation.begun = watch.begun();
  situation.nodes = nodes;
  for (std::size_t i = 0; i < situation.events_ns.size(); ++i) {
    situation.events_ns[i] = watch.event_ns(static_cast<ThermalEventKind>(i));
  }
  situation.bus_trouble = watch.trouble();
  situation.insecure_link =
      watch.alive() && supervisor::MetricOf(watch.health(NodeId::kSupervisor), "insecure_link") > 0;
  Json list('[');
  for (const Warning& warning : WarningsOf(situation)) {
    list.Item(Json('{').Text("level", warning.level).Text("text", warning.text).Text("todo", warning.todo).Done());
  }
  return list.Done();
}

std::string PointsJson(const SessionWatch& watch, std::uint64_t* cursor) {
  Json list('[');
  for (const PlotPoint& point : watch.points()) {
    if (point.number <= *cursor) continue;
    *cursor = point.number;
    Json values('[');
    values.Item(Json::Rounded(point.time_s, 0.01)).Item(Json::Rounded(point.temperature_C, 0.1));
    for (const double force_N : point.force_N) values.Item(Json::Rounded(force_N, 0.001));
    list.Item(values.Done());
  }
  return list.Done();
}

std::string TaskJson(const GuidedTask& task) {
  Json json('{');
  json.Text("title", task.title()).Text("text", task.text()).Flag("running", task.running());
  json.Flag("wants_enter", task.wants_enter()).Flag("cancelled", task.cancelled());
  if (task.end()) {
    json.Flag("ok", task.end()->signal == 0 && task.end()->exit_code == 0).Text("end", task.end()->Describe());
  }
  return json.Done();
}

const char* PhaseOf(const LiveState& state) {
  if (state.run->stopping()) return "stopping";
  if (state.watch->begun()) {
    const Health& supervisor = state.watch->health(NodeId::kSupervisor);
    return supervisor.pid != 0 && supervisor.state == HealthState::kStopping ? "stopping" : "running";
  }
  // The session has left the bus by itself, and its report is being written.
  if (state.run->begun()) return "stopping";
  return state.watch->alive() || state.run->running() ? "starting" : "idle";
}

void AddSession(const LiveState& state, Json* json) {
  const SessionWatch& watch = *state.watch;
  std::vector<NodeReport> reports;
  Json nodes('[');
  for (int i = 0; i < kNodeCount; ++i) {
    const auto node = static_cast<NodeId>(i);
    if (node == NodeId::kSupervisor || !watch.expects(node)) continue;
    reports.push_back(ReportOf(watch, node));
    nodes.Item(NodeJson(reports.back(), state.now_ns));
  }
  json->Raw("nodes", nodes.Done()).Raw("warnings", WarningsJson(watch, reports, state.now_ns));
  if (!watch.begun()) return;
  json->Text("scene", watch.manifest().scene_name);
  json->Number("time", 1e-9 * static_cast<double>(state.now_ns - watch.manifest().session_start_ns), 0.1);
  json->Number("end", supervisor::MetricOf(watch.health(NodeId::kSupervisor), "session_end_s"), 0.1);
  json->Raw("figures", FiguresJson(watch));
}

}  // namespace

std::string LiveJson(const LiveState& state, std::uint64_t* cursor) {
  Json json('{');
  json.Text("phase", PhaseOf(state)).Text("session", state.session).Text("picture", state.picture);
  json.Flag("own", state.run->running()).Flag("recording", state.run->recording()).Flag("has_report", state.has_report);
  json.Number("person_changes", static_cast<double>(state.person_changes), 1);
  if (state.watch->alive()) AddSession(state, &json);
  if (state.run->running() && !state.watch->begun()) json.Text("said", state.run->LastWord());
  if (state.run->end()) {
    json.Raw("ended", Json('{').Flag("well", state.run->end()->well).Text("text", state.run->end()->text).Done());
  }
  if (state.task != nullptr) json.Raw("task", TaskJson(*state.task));
  if (state.notice.number != 0) {
    json.Raw("notice", Json('{')
                           .Number("number", static_cast<double>(state.notice.number), 1)
                           .Flag("ok", state.notice.ok)
                           .Text("text", state.notice.text)
                           .Done());
  }
  return json.Raw("points", PointsJson(*state.watch, cursor)).Done();
}

}  // namespace fulcrum::console
