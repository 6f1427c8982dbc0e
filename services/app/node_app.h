// What every node's main shares: options, scene, bus, session clock, health, exit codes. A main is then options →
// node object → Run → finish, in under 60 lines.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/bus/dds/participant.h"
#include "services/bus/port.h"
#include "services/core/exit_code.h"
#include "services/core/messages.h"
#include "services/core/tick.h"
#include "services/runtime/cyclic_thread.h"
#include "services/scene/scene_file.h"

namespace fulcrum::app {

/// The common command line: --scene FILE (compiled), --session DIR, --domain N, --cart FILE, --help, --version.
struct NodeOptions {
  std::filesystem::path scene;
  std::filesystem::path session;  ///< Logs, checkpoints and pictures go here.
  std::filesystem::path cart;     ///< Effective cart configuration; may be empty.
  int domain = 7;
  std::vector<std::string> extra;  ///< Options the node itself understands, for example --window.
};

/// Everything a node needs around its own object.
class NodeApp {
 public:
  /// Parses, opens scene and bus. Throws InputError (exit 2) or MismatchError (exit 3).
  NodeApp(NodeId node, const NodeOptions& options);
  ~NodeApp();

  [[nodiscard]] const SceneView& scene() const;
  [[nodiscard]] const NodeOptions& options() const;
  [[nodiscard]] bus::DdsParticipant& bus();
  /// Session time of a monotonic stamp, from SceneManifest; negative until the session is known.
  [[nodiscard]] double SessionTime(std::int64_t stamp_ns) const;

  /// What goes into Health beside rates and timing; called at 10 Hz on the health thread, so it must be thread-safe.
  using HealthFill = std::function<void(Health*)>;
  /// Runs `step` at the given rate until a stop signal, a Command "stop" or a scene mismatch; publishes Health.
  ExitCode Run(const runtime::CyclicThreadSettings& settings, const std::function<void(const Tick&)>& step,
               const HealthFill& fill_health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// main() of a node: parses options, turns exceptions into one clear line and the right exit code.
int NodeMain(int argc, char** argv, NodeId node, const char* description, const std::function<ExitCode(NodeApp&)>& run);

}  // namespace fulcrum::app
