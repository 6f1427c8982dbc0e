#include "tests/support/session_bus.h"

#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "tests/support/cart.h"

namespace fulcrum::testing {
namespace {

bus::DdsSettings SettingsFor(int domain, const std::string& name, std::string_view identity) {
  constexpr double kLimit_s = 30;
  const std::filesystem::path memory = bus::SharedMemoryDirectory(domain);
  (void)WaitFor(kLimit_s, [&] { return bus::AnnouncedSession(memory) != 0; });
  return {.domain = domain,
          .node_name = name,
          .shared_memory = memory,
          .security = bus::AnnouncedSecurity(memory, identity)};
}

}  // namespace

bus::DdsSettings ReaderOf(int domain, const std::string& name) {
  return SettingsFor(domain, name, NodeName(NodeId::kRecorder));
}

bus::DdsSettings WriterOf(int domain, const std::string& name) {
  return SettingsFor(domain, name, bus::kReplayerIdentity);
}

}  // namespace fulcrum::testing
