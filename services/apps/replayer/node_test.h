// Test of one node without other processes: it computes the ticks of a recording again, and its figures are checked
// against demands. Used by `replayer --test` and `fulcrum test-node`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/apps/replayer/assertion.h"
#include "services/apps/replayer/lock_step.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// Demands on the node. Without hash and assertions, each state must equal the recorded one.
struct Demands {
  std::optional<std::uint64_t> state_hash;  ///< Expected state hash after the last tick.
  std::vector<Assertion> assertions;
};

enum class Verdict { kPassed, kFailed, kError };  ///< kError: the case could not be checked.

struct TestCase {
  std::string name;
  Verdict verdict = Verdict::kPassed;
  std::string message;  ///< Empty when the case has passed.
};

struct NodeTestResult {
  NodeId node = NodeId::kPhysics;
  std::filesystem::path recording;
  std::vector<TestCase> cases;
  std::map<std::string, double> figures;  ///< All figures that an assertion may name.
  std::optional<std::uint64_t> state_hash;
  double wall_s = 0;
  [[nodiscard]] bool passed() const;
};

/// Parses 16 hexadecimal digits with or without "0x". Throws InputError.
[[nodiscard]] std::uint64_t ParseStateHash(const std::string& text);

/// Replays `settings.nodes`, which is one node, in lock step to the end and checks the demands. Figures are those of
/// its Health (the last value; `.min` and `.max` of the whole session) and of the replay: ticks, compared,
/// hash_mismatches, starts, session_s, busy_s, step_p50_ms, step_p99_ms. Throws like ReplayInLockStep, and InputError
/// when an assertion names no figure of the node.
[[nodiscard]] NodeTestResult TestNode(const LockStepSettings& settings, const Demands& demands, const SceneView& scene,
                                      const config::CartConfig& cart, const std::function<void(double)>& progress);

/// Checks the demands on figures that are already in `result`, such as those of render.
void Judge(const Demands& demands, NodeTestResult* result);

/// Result of a test that could not be executed, as one case with an error.
[[nodiscard]] NodeTestResult FailedTest(NodeId node, const std::filesystem::path& recording, const std::string& why);

/// Text with the figures, one line per case, and the verdict.
[[nodiscard]] std::string ReportText(const NodeTestResult& result);

/// Writes JUnit XML for a CI system: one suite with all cases. Throws InputError when the file cannot be written.
void WriteJUnit(const NodeTestResult& result, const std::filesystem::path& file);

}  // namespace fulcrum::replay
