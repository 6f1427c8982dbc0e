#include "services/session/supervisor/session_setup.h"

#include <ctime>

#include "services/base/config/operation.h"
#include "services/base/core/error.h"
#include "services/nodes/app/cart_security.h"
#include "services/nodes/app/physics_rate.h"
#include "services/records/recording/free_name.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/session_keys.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/link/options.h"

namespace fulcrum::supervisor {
namespace {

bool HasRecorder(const UpSettings& settings) { return settings.record || settings.keep_s > 0; }

/// Throws InputError where the cart cannot run the scene.
std::vector<NodeId> NodesOf(const SceneView& scene, const UpSettings& settings) {
  if ((scene.node_mask >> static_cast<unsigned>(NodeId::kPhysics) & 1u) != 0) {
    app::CheckPhysicsRate(scene, settings.cart);
  }
  std::vector<NodeId> nodes;
  for (int i = 0; i < kNodeCount; ++i) {
    const auto id = static_cast<NodeId>(i);
    if (id != NodeId::kSupervisor && (scene.node_mask >> i & 1u) != 0 && (settings.remote >> i & 1u) == 0) {
      nodes.push_back(id);
    }
  }
  if (nodes.empty()) {
    throw InputError(settings.scene.string() + ": the scene names no node to start here");
  }
  if (HasRecorder(settings)) {
    nodes.push_back(NodeId::kRecorder);
  }
  return nodes;
}

std::vector<NodeId> RemoteNodesOf(const SceneView& scene, const UpSettings& settings) {
  std::vector<NodeId> nodes;
  for (int i = 0; i < kNodeCount; ++i) {
    if ((scene.node_mask & settings.remote) >> i & 1u) nodes.push_back(static_cast<NodeId>(i));
  }
  return nodes;
}

std::string RunYaml(const UpSettings& settings, double end_s) {
  const auto yes_no = [](bool value) { return value ? "true" : "false"; };
  return "  seconds: " + (end_s > 0 ? Fixed(end_s, 3) : std::string("until stopped")) +
         "\n  domain: " + std::to_string(settings.cart.domain) + "\n  window: " + yes_no(settings.window) +
         "\n  keep_going: " + yes_no(settings.keep_going) + "\n  standby: " + yes_no(settings.standby) +
         "\n  record: " + yes_no(settings.record.has_value()) +
         (settings.remote != 0 ? "\n  peer: " + settings.peer + "\n  remote: " + link::NamesOfNodes(settings.remote)
                               : "") +
         "\n";
}

std::vector<std::string> NoticesOf(const UpSettings& settings) {
  std::vector<std::string> notices;
  if (settings.remote != 0 && settings.link_keys.empty()) notices.emplace_back(link::kInsecureLink);
  if (settings.open_bus) {
    notices.emplace_back("open bus: every process of this machine can read and write the topics of this session");
  }
  return notices;
}

/// Opens the cart's directory for a new session. Without keys of the cart file the session makes its own there.
std::filesystem::path OpenMemory(const UpSettings& up) {
  bus::Security security = app::SecurityOf(up.cart, NodeName(NodeId::kSupervisor));
  std::filesystem::path memory = bus::SharedMemoryDirectory(up.cart.domain);
  if (security.on() || up.open_bus) return bus::OpenSharedMemory(up.cart.domain, security);
  bus::ClearSharedMemory(memory);
  bus::PrepareSharedMemory(memory);
  security.keys = MakeKeysOfSession(memory);
  bus::AnnounceSession(memory, security);
  return memory;
}

std::filesystem::path RecordingFile(const UpSettings& settings, const SessionFolder& folder) {
  if (!settings.record) {
    return {};
  }
  const std::filesystem::path& wanted = *settings.record;
  return recording::FreeName(wanted.empty()                          ? folder.path / "recording.mcap"
                             : std::filesystem::is_directory(wanted) ? wanted / (folder.session_id + ".mcap")
                                                                     : wanted);
}

}  // namespace

double EndOfSession(const UpSettings& settings, const SceneView& scene) {
  if (settings.seconds >= 0) return settings.seconds;
  return config::MovedByPerson(settings.cart, scene.tools) ? 0 : static_cast<double>(scene.script_duration_s);
}

SessionMemory::~SessionMemory() { bus::RemoveSharedMemory(path); }

void SessionSetup::FreeDomain() {
  opened.reset();
  guard.reset();
}

SessionSetup::SessionSetup(const UpSettings& up)
    : settings(up),
      scene(up.scene),
      end_s(EndOfSession(up, scene.view())),
      keys_warning(CheckSessionKeys(up.cart, NodesOf(scene.view(), up), std::time(nullptr))),
      notices(NoticesOf(up)),
      guard(up.cart.domain),
      opened(OpenMemory(up)),
      memory(opened->path),
      training(OpenTrainingLog(up.trainee, up.training_database, scene.view())),
      folder(MakeSessionFolder(up.out, up.scene, scene, up.cart, RunYaml(up, end_s))),
      recording(RecordingFile(up, folder)),
      starter{settings, folder, recording},
      node_ids(NodesOf(scene.view(), up)),
      remote_ids(RemoteNodesOf(scene.view(), up)) {}

bus::Security SessionSetup::security() const { return bus::AnnouncedSecurity(memory, NodeName(NodeId::kSupervisor)); }

std::span<const ScriptKey> SessionSetup::operator_script() const {
  return settings.cart.pedal.kind == config::LinkKind::kSimulated ? scene.view().script : std::span<const ScriptKey>();
}

bool SessionSetup::has_recorder() const { return HasRecorder(settings); }

}  // namespace fulcrum::supervisor
