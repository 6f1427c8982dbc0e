#include "services/nodes/app/node_confinement.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "services/base/runtime/realtime.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::app {
namespace {

namespace fs = std::filesystem;

/// Folder of the variable, or `otherwise` below the home of the user; empty when neither is known.
fs::path FromEnvironment(const char* variable, const char* otherwise) {
  if (const char* folder = std::getenv(variable); folder != nullptr && *folder != '\0') return folder;
  const char* home = std::getenv("HOME");
  return home != nullptr && *home != '\0' ? fs::path(home) / otherwise : fs::path();
}

/// Where drivers of graphics keep compiled shaders; without it each start compiles them again.
std::vector<fs::path> ShaderCaches() {
  std::vector<fs::path> caches{FromEnvironment("MESA_SHADER_CACHE_DIR", ".cache/mesa_shader_cache"),
                               FromEnvironment("XDG_CACHE_HOME", ".cache") / "mesa_shader_cache",
                               FromEnvironment("__GL_SHADER_DISK_CACHE_PATH", ".nv")};
  std::erase_if(caches, [](const fs::path& path) { return !path.is_absolute(); });
  std::error_code ignored;
  for (const fs::path& cache : caches) {
    if (fs::is_directory(cache.parent_path(), ignored)) fs::create_directory(cache, ignored);
  }
  return caches;
}

void AddGraphics(runtime::WritablePlaces* places) {
  for (const fs::path& cache : ShaderCaches()) places->folders.push_back(cache);
  for (const fs::path& device : GraphicsDevices("/dev")) places->devices.push_back(device);
}

bool HasForeignDriver(NodeId node, const config::CartConfig& cart) {
  return node == NodeId::kHaptics && std::any_of(cart.devices.begin(), cart.devices.end(), [](const auto& device) {
           return device.kind == config::DeviceKind::kTouch;
         });
}

}  // namespace

std::vector<fs::path> GraphicsDevices(const fs::path& devices) {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(devices, ignored)) {
    const std::string name = entry.path().filename();
    if (name == "dri" || name == "dxg" || name.starts_with("nvidia")) found.push_back(entry.path());
  }
  return found;
}

std::optional<runtime::WritablePlaces> WritablePlacesOf(NodeId node, const NodeOptions& options,
                                                        const config::CartConfig& cart) {
  if (HasForeignDriver(node, cart)) return std::nullopt;
  runtime::WritablePlaces places{{bus::SharedMemoryDirectory(options.domain)}, {"/dev/null"}};
  switch (node) {
    case NodeId::kPhysics:  // Checkpoints.
    case NodeId::kThermal:
      places.folders.push_back(options.session);
      break;
    case NodeId::kRecorder: {  // Recording and dumps.
      places.folders.push_back(options.session);
      NodeOptions copy = options;
      const fs::path file = copy.TakeValue("--file", "");
      if (!file.empty()) places.folders.push_back(fs::absolute(file).parent_path());
      break;
    }
    case NodeId::kRender: {  // Pictures.
      places.folders.push_back(options.session / "frames");
      AddGraphics(&places);
      places.devices.emplace_back("/dev/input");  // Rumble; a gamepad that is plugged in is a new file.
      break;
    }
    case NodeId::kHaptics:
    case NodeId::kHandleBridge:
      places.devices.emplace_back("/dev");  // A device that is plugged in again is a new file.
      break;
    case NodeId::kSupervisor:
      break;
  }
  return places;
}

void ConfineGraphics() {
  runtime::WritablePlaces places{{}, {"/dev/null"}};
  AddGraphics(&places);
  // `fulcrum doctor --security` lists what the kernel does not offer.
  (void)runtime::LimitWriting(places);
  (void)runtime::LimitSystemCalls();
}

void ConfineNode(NodeId node, const NodeOptions& options, const config::CartConfig& cart) {
  using runtime::Log;
  using runtime::LogLevel;
  if (const auto places = WritablePlacesOf(node, options, cart)) {
    bus::PrepareSharedMemory(places->folders.front());  // It must exist to be named.
    if (const std::string off = runtime::LimitWriting(*places); !off.empty()) Log(LogLevel::kWarning, off);
  } else {
    Log(LogLevel::kInfo, "may write where its user may: the driver of its device is not part of Fulcrum");
  }
  if (const std::string off = runtime::LimitSystemCalls(); !off.empty()) Log(LogLevel::kWarning, off);
}

}  // namespace fulcrum::app
