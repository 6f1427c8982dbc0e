#include "services/session/supervisor/session_keys.h"

#include "services/transport/keys/issuing.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::supervisor {
namespace {

constexpr std::time_t kExpiryWarning_s = 30 * 24 * 3600;

}  // namespace

std::string CheckSessionKeys(const config::CartConfig& cart, std::vector<NodeId> nodes, std::time_t now) {
  if (cart.security.keys.empty()) return {};
  nodes.push_back(NodeId::kSupervisor);
  std::time_t until = 0;
  for (const NodeId id : nodes) {
    until = keys::CheckIdentity(cart.security.keys, NodeName(id), cart.security.encrypt, now).until;
  }
  if (until - now > kExpiryWarning_s) return {};
  return "the keys of this cart expire on " + keys::DateOf(until) + ": make new ones with fulcrum keys init " +
         cart.security.keys + " --force";
}

std::filesystem::path MakeKeysOfSession(const std::filesystem::path& memory) {
  // The keys end with the session, whatever the wall clock says: they stay valid when it is set.
  constexpr std::time_t kDay_s = 24 * 3600, kFrom_s = 10 * kDay_s, kUntil_s = 47'000 * kDay_s;  // 1970 to 2098.
  std::filesystem::path folder = memory / "keys";
  keys::MakeSessionKeys(folder, {kFrom_s, kUntil_s});
  return folder;
}

}  // namespace fulcrum::supervisor
