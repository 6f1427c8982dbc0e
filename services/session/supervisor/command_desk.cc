#include "services/session/supervisor/command_desk.h"

#include <algorithm>
#include <utility>

#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::supervisor {
namespace {

// Replies kept for repeated requests: more than there are operators and client programs on one cart (assumed).
constexpr std::size_t kAnswersKept = 8;

}  // namespace

CommandDesk::CommandDesk(std::unique_ptr<bus::Input<Command>> commands,
                         std::unique_ptr<bus::Output<CommandReply>> replies, std::vector<Verb> verbs)
    : verbs_(std::move(verbs)),
      stamper_(runtime::MonotonicNs()),
      replies_(std::move(replies)),
      commands_(std::move(commands)) {}

void CommandDesk::Serve(std::int64_t now_ns) {
  Command command;
  while (commands_->TakeNext(&command)) {
    if (command.target != NodeId::kSupervisor || Repeat(command.request_id, now_ns)) {
      continue;
    }
    CommandReply reply;
    reply.stamp = stamper_.Next(now_ns);
    reply.request_id = command.request_id;
    reply.from_node = NodeId::kSupervisor;
    const CommandAnswer answer = Execute(command, now_ns);
    reply.ok = answer.ok;
    reply.text = answer.text;
    replies_->Write(reply);
    if (answered_.size() == kAnswersKept) answered_.pop_front();
    answered_.push_back(reply);
  }
}

bool CommandDesk::Repeat(std::uint64_t request_id, std::int64_t now_ns) {
  const auto past = std::find_if(answered_.begin(), answered_.end(),
                                 [&](const CommandReply& reply) { return reply.request_id == request_id; });
  if (past == answered_.end()) return false;
  past->stamp = stamper_.Next(now_ns);
  replies_->Write(*past);
  return true;
}

CommandAnswer CommandDesk::Execute(const Command& command, std::int64_t now_ns) const {
  std::string known;
  for (const Verb& verb : verbs_) {
    if (verb.name == command.verb) return verb.handle(command.argument, now_ns);
    known += (known.empty() ? "" : ", ") + verb.name;
  }
  return {false, "unknown verb \"" + command.verb + "\"; valid: " + known};
}

}  // namespace fulcrum::supervisor
