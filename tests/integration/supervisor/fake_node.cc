// A node that computes nothing: the supervisor's tests start it under the names of the real ones. Its behaviour is set
// by a file <session>/../<node name>.do: "crash" (abort at once), "exit N", "hang" (in the step), "hang once" (in the
// step after 1 s of the session, but not after a restart), "mismatch", "flicker" (degraded every other 0.1 s of the
// session), "step MS" (duration of each step), "end MS" (from its last step to its end, as of a recorder
// with a slow disk), "metric NAME VALUE" and "lost N" (samples) in Health.
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/spare.h"

namespace {

using fulcrum::ExitCode;
using fulcrum::HealthState;
using fulcrum::NodeId;

NodeId IdOf(const std::string& program) {
  for (int i = 0; i < fulcrum::kNodeCount; ++i) {
    if (program == fulcrum::NodeName(static_cast<NodeId>(i))) {
      return static_cast<NodeId>(i);
    }
  }
  return NodeId::kSupervisor;
}

std::filesystem::path OrderFile(const fulcrum::app::NodeOptions& options, NodeId node) {
  return options.session.parent_path() / (std::string(fulcrum::NodeName(node)) + ".do");
}

void Hang() {
  fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kInfo, "hanging");
  std::this_thread::sleep_for(std::chrono::hours(1));
}

std::string OrderFor(const fulcrum::app::NodeOptions& options, NodeId node) {
  std::ifstream stream(OrderFile(options, node));
  std::string order;
  std::getline(stream, order);
  return order;
}

}  // namespace

int main(int argc, char** argv) {
  const NodeId node = IdOf(std::filesystem::path(argv[0]).filename());
  return fulcrum::app::NodeMain(argc, argv, node, "Computes nothing.", [&](fulcrum::app::NodeApp& app) {
    if (app.options().TakeFlag("--spare")) {
      fulcrum::app::BecomeSpare(node);
      if (!fulcrum::app::WaitUntilNeeded(node)) return ExitCode::kDone;
    }
    const std::string order = OrderFor(app.options(), node);
    if (order == "crash") {
      std::abort();
    }
    if (order.starts_with("exit ")) {
      std::_Exit(std::stoi(order.substr(5)));
    }
    if (order == "mismatch") {
      throw fulcrum::MismatchError("the scene is another one");
    }
    (void)app.options().TakeFlag("--window");
    for (const char* option : {"--quality", "--file", "--keep"}) (void)app.options().TakeValue(option, "");
    std::istringstream words(order);
    std::string verb, metric;
    double number = 0;
    words >> verb;
    if (verb == "metric") words >> metric;
    words >> number;
    auto& frames = app.MakeOutput<fulcrum::TissueFrame>();
    (void)app.MakeInput<fulcrum::TissueFrame>();
    std::uint64_t sequence = 0, reports = 0;
    // The one folder that both a node for pictures and one for checkpoints may write to: nodes are confined.
    const std::filesystem::path hung =
        app.options().session / "frames" / (std::string(fulcrum::NodeName(node)) + ".hung");
    const std::chrono::duration<double, std::milli> end(verb == "end" ? number : 0);
    const ExitCode code = app.Run(
        {.name = "fake", .period_ns = 10'000'000},
        [&](const fulcrum::Tick& tick) {
          if (order == "hang") Hang();
          if (order == "hang once" && tick.session_time_s > 1 && !std::filesystem::exists(hung)) {
            std::ofstream(hung) << "once";
            Hang();
          }
          if (verb == "step") std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(number));
          if (node == NodeId::kPhysics) {
            frames.WriteInPlace([&](fulcrum::TissueFrame::View view) {
              view.header.stamp = {++sequence, 1, tick.stamp_ns};
              view.header.vertex_count = 0;
            });
          }
        },
        [&](fulcrum::Health* health) {
          if (node == NodeId::kPhysics) {
            health->metrics.push_back({"max_displacement_mm", 12.5});
          }
          if (verb == "metric") health->metrics.push_back({metric, number});
          if (verb == "lost") health->write_failures += static_cast<std::uint64_t>(number);
          if (order == "flicker" && ++reports % 2 == 0 && health->state == HealthState::kRunning) {
            health->state = HealthState::kDegraded;
            health->last_error = "a plug is loose";
          }
        });
    std::this_thread::sleep_for(end);
    if (verb == "end") fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kInfo, "has ended by itself");
    return code;
  });
}
