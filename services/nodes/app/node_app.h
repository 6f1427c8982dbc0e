// Common parts of every node's main: options, scene, bus, session clock, health, exit codes. A main is then options →
// node object → Run → finish, in under 60 lines:
//
//   int main(int argc, char** argv) {
//     return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kThermal, "Heat in the membrane.",
//                                   [](fulcrum::app::NodeApp& app) {
//       ThermalNode node(app.scene(), {app.MakeInput<CauteryContact>(), app.MakeOutput<TopologyState>()});
//       return app.Run(app.timing(), [&](const Tick& tick) { node.Step(tick); },
//                      [&](Health* health) { node.FillHealth(health); });
//     });
//   }
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/exit_code.h"
#include "services/base/core/messages.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/checkpoint.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/port.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::app {

/// The common command line: --scene FILE (compiled), --session DIR, --domain N, --cart FILE, --help, --version.
struct NodeOptions {
  std::filesystem::path scene;
  std::filesystem::path session;  ///< Folder for logs, checkpoints and pictures.
  std::filesystem::path cart;     ///< Effective cart configuration; may be empty.
  int domain = config::DefaultDomain();
  std::vector<std::string> extra;  ///< Remaining options, which the node itself interprets, for example --window.

  /// Removes a flag such as "--window" from `extra`; true if it was there.
  [[nodiscard]] bool TakeFlag(std::string_view flag);
  /// Removes "NAME VALUE" or "NAME=VALUE" from `extra` and returns the value; returns `missing` if the name is not
  /// there. Throws InputError if the value is missing.
  [[nodiscard]] std::string TakeValue(std::string_view name, std::string_view missing);
};

/// Result of reading a command line.
struct ParsedOptions {
  NodeOptions options;
  std::string answer;  ///< Not empty: the program prints this (help or version) and exits with code 0.
};
/// Reads the command line. Throws InputError naming an unusable option. Options that are not common remain in `extra`.
[[nodiscard]] ParsedOptions ParseNodeOptions(int argc, const char* const* argv, NodeId node, const char* description);

/// Resources of a node beside its own object.
class NodeApp {
 public:
  /// Opens the scene. The bus is joined when the first port is made. Both throw InputError (exit 2) or MismatchError
  /// (exit 3).
  NodeApp(NodeId node, const NodeOptions& options);
  ~NodeApp();
  NodeApp(const NodeApp&) = delete;
  NodeApp& operator=(const NodeApp&) = delete;

  [[nodiscard]] const SceneView& scene() const;
  [[nodiscard]] NodeOptions& options();
  /// The configuration of the cart file, or the simulated cart if no file was given.
  [[nodiscard]] const config::CartConfig& cart() const;
  /// Name, rate, priority and CPU of this node's thread, from the cart.
  [[nodiscard]] runtime::CyclicThreadSettings timing() const;
  [[nodiscard]] bus::DdsParticipant& bus();

  /// Makes ports that the app owns: they exist as long as the app, and their statistics are part of Health. Make all
  /// ports before Run(). `notify` as for DdsParticipant::MakeInput.
  template <class T>
  [[nodiscard]] bus::Input<T>& MakeInput(std::function<void()> notify = {}) {
    auto port = bus().MakeInput<T>(std::move(notify));
    bus::Input<T>& input = *port;
    Watch(bus::kTopicOf<T>, [&input] { return input.stats(); });
    Keep(std::shared_ptr<void>(std::move(port)));
    return input;
  }
  template <class T>
  [[nodiscard]] typename bus::OutputOf<T>::type& MakeOutput() {
    auto port = bus().MakeOutput<T>();
    typename bus::OutputOf<T>::type& output = *port;
    Watch([&output] { return output.stats(); });
    Keep(std::shared_ptr<void>(std::move(port)));
    return output;
  }
  /// Adds a port made elsewhere to Health. The functions are called on the health thread.
  void Watch(TopicId topic, std::function<bus::InputStats()> stats);
  void Watch(std::function<bus::OutputStats()> stats);

  /// Session time of a monotonic stamp, from SceneManifest [s]; negative until the session is known. Real-time safe.
  [[nodiscard]] double SessionTime(std::int64_t stamp_ns) const noexcept;

  /// Sets the handler of an order of the supervisor with this verb, in addition to "stop" and "restart": it receives
  /// the argument and returns the text of the reply; an exception refuses the order. Called on the thread of Run(). Set
  /// before Run().
  void OnOrder(std::string verb, std::function<std::string(const std::string&)> handler);

  /// Fills in the part of Health other than rates and timing: metrics, state, last_error. Called at 10 Hz on the health
  /// thread, so it must be thread-safe.
  using HealthFill = std::function<void(Health*)>;
  /// Waits for the session, then runs `step` at the given rate on a thread of its own until a stop signal, the order
  /// "stop", a schema or scene mismatch, or Finish(). Publishes Health at 10 Hz from the start. `step` receives a tick
  /// with session_time_s and is never called before the session is known. Call once.
  ExitCode Run(const runtime::CyclicThreadSettings& settings, const std::function<void(const Tick&)>& step,
               const HealthFill& fill_health);

  /// Publishes Health at once instead of after its period, because an event has occurred for which other processes
  /// wait. Any thread but that of the servo: it takes a lock and wakes the thread of Health.
  void PublishHealthNow();

  /// Ends Run() with this code, for example kDeviceLost; `reason` is logged. Any thread except a real-time one.
  void Finish(ExitCode code, std::string_view reason);

 private:
  void Keep(std::shared_ptr<void> port);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Logs the state of a node's checkpoint. @param restored the node continues from it.
void LogCheckpoint(const runtime::CheckpointFile& checkpoint, bool restored);

/// main() of a node: parses options, and converts exceptions into one log line and the exit code. Options left in
/// `extra` after `run` has taken its own are refused before Run() starts.
int NodeMain(int argc, char** argv, NodeId node, const char* description, const std::function<ExitCode(NodeApp&)>& run);

}  // namespace fulcrum::app
