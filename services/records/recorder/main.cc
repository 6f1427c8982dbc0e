// recorder: every topic of the cart into a file, the newest seconds into dumps.
#include <fstream>
#include <iterator>
#include <mutex>

#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/cart_security.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/version.h"
#include "services/records/recorder/recorder.h"
#include "services/records/recording/free_name.h"
#include "services/transport/bus/hex.h"
#include "services/transport/bus/schema.h"

namespace fulcrum::recorder {
namespace {

namespace fs = std::filesystem;
using runtime::MonotonicNs;

/// Its arguments, as /proc knows them while it lives.
std::string CommandLine(int pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/cmdline", std::ios::binary);
  std::string line{std::istreambuf_iterator<char>(in), {}};
  while (!line.empty() && line.back() == '\0') line.pop_back();
  std::replace(line.begin(), line.end(), '\0', ' ');
  return line;
}

recording::TextMap Describe(const bus::Peer& peer) {
  return {{"node", peer.name}, {"pid", std::to_string(peer.pid)}, {"command", CommandLine(peer.pid)}};
}

RecorderSettings TakeSettings(app::NodeApp* node) {
  app::NodeOptions& options = node->options();
  RecorderSettings settings;
  if (const fs::path file = options.TakeValue("--file", ""); !file.empty()) settings.file = recording::FreeName(file);
  const std::string keep = options.TakeValue("--keep", "0");
  char* end = nullptr;
  settings.keep_s = std::strtod(keep.c_str(), &end);
  constexpr double kMostKept_s = 3600;
  if (*end != '\0' || !(settings.keep_s >= 0 && settings.keep_s <= kMostKept_s)) {
    throw InputError("--keep " + keep + ": must be 0 to 3600 seconds");
  }
  if (settings.file.empty() && settings.keep_s == 0) {
    throw InputError("nothing to do: give --file FILE, --keep SECONDS or both");
  }
  settings.library = std::string("fulcrum ") + app::kVersion;
  settings.metadata = {
      {"session",
       {{"id", options.session.filename()},
        {"scene", node->scene().name},
        {"scene_file", fs::absolute(options.scene)},
        {"scene_hash", bus::Hex(node->scene().hash)}}},
      {"versions", {{"fulcrum", app::kVersion}, {"schema_hash", bus::Hex(bus::SchemaHash())}}},
      {"cart", {{"yaml", config::CartToYaml(node->cart())}}},
  };
  return settings;
}

/// A dump that was asked for and is due on the writing thread.
class DumpRequest {
 public:
  void Ask(std::string reason) {
    const std::lock_guard lock(mutex_);
    reason_ = std::move(reason);
  }
  [[nodiscard]] std::optional<std::string> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(reason_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::optional<std::string> reason_;
};

ExitCode Run(app::NodeApp& node) {
  const fs::path folder = node.options().session;
  RecorderSettings settings = TakeSettings(&node);
  // The app's own participant has typed ports of some topics: there a type can be registered in one way only.
  bus::DdsParticipant bus({.domain = node.options().domain,
                           .node_name = bus::kRecorderPeer,
                           .security = app::SecurityOf(node.cart(), NodeName(NodeId::kRecorder)),
                           .gathers = true});
  settings.describe = [&](const bus::WriterGuid& writer) { return Describe(bus.PeerOf(writer)); };
  Recorder recorder(settings);
  std::vector<std::unique_ptr<bus::RawInput>> inputs;
  for (const auto& role : bus::kTopicRoles) {
    inputs.push_back(bus.MakeRawInput(
        role.id, [&](const bus::RawSample& sample, const auto& is_whole) { recorder.Receive(sample, is_whole); }));
    node.Watch(role.id, [&recorder, id = role.id, input = inputs.back().get()] {
      bus::InputStats stats = recorder.topic_stats(id);
      stats.matched = input->matched();
      return stats;
    });
  }
  DumpRequest request;
  if (settings.keep_s > 0) {
    node.OnCommand("dump", [&](const std::string& reason) {
      request.Ask(reason);
      return "writing the last seconds into " + folder.string();
    });
  }
  if (!settings.file.empty()) {
    runtime::Log(runtime::LogLevel::kInfo, "recording into " + settings.file.string());
  }
  const ExitCode code = node.Run(
      node.timing(),
      [&](const Tick& tick) {
        recorder.Flush(tick.stamp_ns);
        const std::optional<std::string> reason = request.Take();
        if (!reason) return;
        const fs::path file = recording::FreeName(folder / "dump.mcap");
        try {
          recorder.Dump(file, *reason, tick.stamp_ns);
          runtime::Log(runtime::LogLevel::kInfo, "dumped into " + file.string() + ": " + *reason);
        } catch (const InputError& error) {
          runtime::Log(runtime::LogLevel::kError, error.what());
        }
      },
      [&](Health* health) {
        const RecorderStats stats = recorder.stats();
        health->metrics = {{"recorded_samples", static_cast<double>(stats.received - stats.unwritten)},
                           {"recorded_MB", 1e-6 * static_cast<double>(stats.file_B)},
                           {"lost_samples", static_cast<double>(stats.lost())},
                           {"queue_pct", stats.queue_pct}};
        if (stats.error.empty()) return;
        health->state = HealthState::kDegraded;
        health->last_error = stats.error + ": " + std::to_string(stats.unwritten) + " samples are not in the file";
      });
  inputs.clear();
  recorder.Close(MonotonicNs());
  return code;
}

}  // namespace
}  // namespace fulcrum::recorder

int main(int argc, char** argv) {
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kRecorder,
                                "Every topic of the cart into a file (--file FILE), and the newest seconds (--keep\n"
                                "SECONDS) into dumps when a node dies or is degraded, or `fulcrum dump` asks for\none.",
                                fulcrum::recorder::Run);
}
