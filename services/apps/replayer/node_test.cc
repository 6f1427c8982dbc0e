#include "services/apps/replayer/node_test.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include "services/apps/replayer/report_format.h"
#include "services/base/core/error.h"
#include "services/base/core/escape.h"
#include "services/transport/bus/hex.h"

namespace fulcrum::replay {
namespace {

constexpr const char* kMismatches = "hash_mismatches";

void AddFigures(const NodeResult& node, double session_s, std::map<std::string, double>* figures) {
  for (const auto& [name, figure] : node.health) {
    (*figures)[name] = figure.last;
    (*figures)[name + ".min"] = figure.least;
    (*figures)[name + ".max"] = figure.most;
  }
  (*figures)["ticks"] = static_cast<double>(node.ticks);
  (*figures)["compared"] = static_cast<double>(node.compared);
  (*figures)[kMismatches] = static_cast<double>(node.mismatches);
  (*figures)["starts"] = static_cast<double>(node.starts);
  (*figures)["session_s"] = session_s;
  (*figures)["busy_s"] = node.busy_s;
  (*figures)["step_p50_ms"] = node.step_p50_ms;
  (*figures)["step_p99_ms"] = node.step_p99_ms;
}

std::string Names(const std::map<std::string, double>& figures) {
  std::string names;
  for (const auto& [name, value] : figures) {
    // The figures NAME.min and NAME.max are not listed.
    if (name.find('.') == std::string::npos) names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

TestCase JudgeHash(std::uint64_t expected, const std::optional<std::uint64_t>& hash) {
  TestCase test{"state_hash == " + bus::Hex(expected), Verdict::kPassed, {}};
  if (hash == expected) return test;
  test.verdict = hash ? Verdict::kFailed : Verdict::kError;
  test.message = hash ? "state_hash is " + bus::Hex(*hash) : "no tick was made";
  return test;
}

TestCase JudgeAssertion(const Assertion& assertion, const std::map<std::string, double>& figures) {
  TestCase test{TextOf(assertion), Verdict::kPassed, {}};
  const double value = figures.at(assertion.figure);
  if (Holds(assertion, value)) return test;
  test.verdict = Verdict::kFailed;
  test.message = assertion.figure + Format(" is %.10g", value);
  return test;
}

std::size_t CountOf(const std::vector<TestCase>& cases, Verdict verdict) {
  return static_cast<std::size_t>(
      std::count_if(cases.begin(), cases.end(), [&](const TestCase& test) { return test.verdict == verdict; }));
}

}  // namespace

bool NodeTestResult::passed() const { return CountOf(cases, Verdict::kPassed) == cases.size(); }

std::uint64_t ParseStateHash(const std::string& text) {
  std::string_view digits = text;
  if (digits.starts_with("0x")) digits.remove_prefix(2);
  std::uint64_t hash = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), hash, 16);
  if (digits.size() != 16 || error != std::errc() || end != digits.data() + digits.size()) {
    throw InputError("--expect \"" + text +
                     "\": a state hash has 16 hexadecimal digits; a test without --expect prints it");
  }
  return hash;
}

void Judge(const Demands& demands, NodeTestResult* result) {
  for (const Assertion& assertion : demands.assertions) {
    if (result->figures.contains(assertion.figure)) continue;
    throw InputError("--assert \"" + TextOf(assertion) + "\": " + NodeName(result->node) + " has no figure \"" +
                     assertion.figure + "\"; it has: " + Names(result->figures) +
                     ". Those of its Health also as NAME.min and NAME.max over the session");
  }
  if (demands.state_hash) result->cases.push_back(JudgeHash(*demands.state_hash, result->state_hash));
  for (const Assertion& assertion : demands.assertions) {
    result->cases.push_back(JudgeAssertion(assertion, result->figures));
  }
}

NodeTestResult TestNode(const LockStepSettings& settings, const Demands& demands, const SceneView& scene,
                        const config::CartConfig& cart, const std::function<void(double)>& progress) {
  LockStepSettings to_the_end = settings;
  to_the_end.go_on = true;
  to_the_end.figures = true;
  const LockStepResult replay = ReplayInLockStep(to_the_end, scene, cart, progress);
  const NodeResult& node = replay.nodes.at(0);
  NodeTestResult result;
  result.node = node.node;
  result.recording = settings.recording;
  result.wall_s = replay.wall_s;
  if (node.ticks > 0) result.state_hash = node.state_hash;
  AddFigures(node, replay.session_s, &result.figures);
  const std::string lacks = node.missing.empty() && !replay.faults.empty() ? replay.faults[0] : node.missing;
  result.cases.push_back({"replays the whole recording", lacks.empty() ? Verdict::kPassed : Verdict::kError, lacks});
  const bool nothing_asked = !demands.state_hash && demands.assertions.empty();
  Judge(nothing_asked ? Demands{{}, {Assertion{kMismatches, Relation::kEqual, 0}}} : demands, &result);
  for (TestCase& test : result.cases) {
    if (test.name.starts_with(kMismatches) && test.verdict == Verdict::kFailed && node.departure) {
      test.message += "; the first at tick " + std::to_string(node.departure->tick) + ": " + node.departure->field;
    }
  }
  return result;
}

NodeTestResult FailedTest(NodeId node, const std::filesystem::path& recording, const std::string& why) {
  NodeTestResult result;
  result.node = node;
  result.recording = recording;
  result.cases.push_back({"can be tested", Verdict::kError, why});
  return result;
}

std::string ReportText(const NodeTestResult& result) {
  std::string text;
  for (const auto& [name, value] : result.figures) {
    if (name.find('.') == std::string::npos) text += Format("  %-24s %.10g\n", name.c_str(), value);
  }
  if (result.state_hash) text += "  state hash               " + bus::Hex(*result.state_hash) + '\n';
  for (const TestCase& test : result.cases) {
    const char* mark = test.verdict == Verdict::kPassed   ? "ok    "
                       : test.verdict == Verdict::kFailed ? "FAILED"
                                                          : "ERROR ";
    text += std::string(mark) + ' ' + test.name + (test.message.empty() ? "" : ": " + test.message) + '\n';
  }
  return text + NodeName(result.node) + (result.passed() ? ": passed" : ": failed") + '\n';
}

void WriteJUnit(const NodeTestResult& result, const std::filesystem::path& file) {
  const auto attribute = [](const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + EscapeHtml(value) + '"';
  };
  const std::string counts = attribute("tests", std::to_string(result.cases.size())) +
                             attribute("failures", std::to_string(CountOf(result.cases, Verdict::kFailed))) +
                             attribute("errors", std::to_string(CountOf(result.cases, Verdict::kError))) +
                             attribute("time", Format("%.3f", result.wall_s));
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites" + attribute("name", "fulcrum test-node") +
                    counts + ">\n  <testsuite" + attribute("name", NodeName(result.node)) + counts +
                    ">\n    <properties>\n";
  const auto add_property = [&](const std::string& name, const std::string& value) {
    xml += "      <property" + attribute("name", name) + attribute("value", value) + "/>\n";
  };
  add_property("recording", result.recording.string());
  if (result.state_hash) add_property("state_hash", bus::Hex(*result.state_hash));
  for (const auto& [name, value] : result.figures) add_property(name, Format("%.10g", value));
  xml += "    </properties>\n";
  for (const TestCase& test : result.cases) {
    xml += "    <testcase" + attribute("classname", std::string("fulcrum.") + NodeName(result.node)) +
           attribute("name", test.name) + attribute("time", "0");
    if (test.verdict == Verdict::kPassed) {
      xml += "/>\n";
      continue;
    }
    const std::string kind = test.verdict == Verdict::kFailed ? "failure" : "error";
    xml.append(">\n      <").append(kind).append(attribute("message", test.message)).append(">");
    xml.append(EscapeHtml(test.name + ": " + test.message)).append("</").append(kind).append(">\n    </testcase>\n");
  }
  WriteText(file, xml + "  </testsuite>\n</testsuites>\n");
}

}  // namespace fulcrum::replay
