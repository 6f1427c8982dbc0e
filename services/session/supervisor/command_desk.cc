#include "services/session/supervisor/command_desk.h"

#include <grp.h>

#include <optional>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/messages.h"

namespace fulcrum::supervisor {
namespace {

std::optional<gid_t> GroupOf(const std::string& name) {
  if (name.empty()) return std::nullopt;
  const group* found = ::getgrnam(name.c_str());
  if (found == nullptr) {
    throw InputError("security.group: \"" + name + "\" is no group of this machine; see getent group");
  }
  return found->gr_gid;
}

}  // namespace

CommandDesk::CommandDesk(const std::filesystem::path& memory, const DomainGuard& guard, const std::string& group,
                         std::vector<Verb> verbs)
    : verbs_(std::move(verbs)),
      own_(control::SocketOf(memory, NodeName(NodeId::kSupervisor))),
      others_(guard.listening(), GroupOf(group)) {}

void CommandDesk::Serve(std::int64_t now_ns) {
  const auto execute = [&](const control::Request& request) { return Execute(request, now_ns); };
  own_.Serve(execute);
  others_.Serve(execute);
}

std::vector<int> CommandDesk::descriptors() const {
  std::vector<int> descriptors;
  own_.AddDescriptors(&descriptors);
  others_.AddDescriptors(&descriptors);
  return descriptors;
}

CommandAnswer CommandDesk::Execute(const control::Request& request, std::int64_t now_ns) const {
  std::string known;
  for (const Verb& verb : verbs_) {
    if (verb.name == request.verb) return verb.handle(request.argument, now_ns);
    known += (known.empty() ? "" : ", ") + verb.name;
  }
  return {false, "unknown verb \"" + request.verb + "\"; valid: " + known};
}

}  // namespace fulcrum::supervisor
