// A node tested headless: it makes the ticks of a recording again, and what it comes to is held against what was asked
// for. `replayer --test`, `fulcrum test-node`.
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

/// What is asked of the node. Neither hash nor assertion: each state as recorded.
struct Demands {
  std::optional<std::uint64_t> state_hash;  ///< After the last tick.
  std::vector<Assertion> assertions;
};

enum class Verdict { kPassed, kFailed, kError };  ///< Error: it could not be found out.

struct TestCase {
  std::string name;
  Verdict verdict = Verdict::kPassed;
  std::string message;  ///< Empty when it has passed.
};

struct NodeTestResult {
  NodeId node = NodeId::kPhysics;
  std::filesystem::path recording;
  std::vector<TestCase> cases;
  std::map<std::string, double> figures;  ///< All that an assertion may name.
  std::optional<std::uint64_t> state_hash;
  double wall_s = 0;
  [[nodiscard]] bool passed() const;
};

/// 16 hexadecimal digits, "0x" before them or not. Throws InputError.
[[nodiscard]] std::uint64_t ParseStateHash(const std::string& text);

/// Replays `settings.nodes`, one node, in lock step to the end, and judges. Figures are those of its Health (the last
/// value; `.min` and `.max` of the whole session), and of the replay: ticks, compared, hash_mismatches, starts,
/// session_s, busy_s. Throws as ReplayInLockStep, and InputError when an assertion names no figure of the node.
[[nodiscard]] NodeTestResult TestNode(const LockStepSettings& settings, const Demands& demands, const SceneView& scene,
                                      const config::CartConfig& cart, const std::function<void(double)>& progress);

/// Judges figures that were come by in another way, as render's are.
void Judge(const Demands& demands, NodeTestResult* result);

/// A test that could not be made, as one case.
[[nodiscard]] NodeTestResult FailedTest(NodeId node, const std::filesystem::path& recording, const std::string& why);

/// A line a case, the figures, the verdict.
[[nodiscard]] std::string ReportText(const NodeTestResult& result);

/// For a CI system: one suite, a case each. Throws InputError when the file cannot be written.
void WriteJUnit(const NodeTestResult& result, const std::filesystem::path& file);

}  // namespace fulcrum::replay
