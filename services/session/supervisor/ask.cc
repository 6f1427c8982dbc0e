#include "services/session/supervisor/ask.h"

#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/transport/bus/dds/participant.h"

namespace fulcrum::supervisor {

CommandReply AskSupervisor(int domain, const std::string& verb, const std::string& argument) {
  if (!DomainGuard::IsHeld(domain)) {
    throw InputError("no session runs in domain " + std::to_string(domain) + "; start one with fulcrum up SCENE");
  }
  bus::DdsParticipant participant(bus::ToolSettings(domain));
  const auto replies = participant.MakeInput<CommandReply>();
  const auto commands = participant.MakeOutput<Command>();
  const std::int64_t epoch = runtime::MonotonicNs();
  Command command;
  command.request_id = static_cast<std::uint64_t>(epoch) ^ static_cast<std::uint64_t>(::getpid()) << 48;
  command.target = NodeId::kSupervisor;
  command.verb = verb;
  command.argument = argument;
  using Clock = std::chrono::steady_clock;
  constexpr auto kPatience = std::chrono::seconds(10);
  constexpr auto kDiscovery = std::chrono::milliseconds(300), kAgain = std::chrono::milliseconds(500);
  const auto begin = Clock::now();
  auto next = begin + kDiscovery;
  std::uint64_t sent = 0;
  while (Clock::now() - begin < kPatience && !runtime::ShouldStop()) {
    // Late joiners get no commands, so command and reply topic must both be matched before the command is sent. The
    // match may be with a node instead of the supervisor: the command is repeated with the same request id.
    if (commands->has_readers() && replies->stats().matched && Clock::now() > next) {
      command.stamp = {++sent, static_cast<std::uint64_t>(epoch), runtime::MonotonicNs()};
      commands->Write(command);
      next = Clock::now() + kAgain;
    }
    CommandReply reply;
    while (replies->TakeNext(&reply)) {
      if (reply.request_id == command.request_id && reply.from_node == NodeId::kSupervisor) {
        return reply;
      }
    }
    if (const std::string mismatch = participant.schema_mismatch(); !mismatch.empty()) {
      throw MismatchError(mismatch);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw std::runtime_error("the supervisor of domain " + std::to_string(domain) +
                           " sent no reply within 10 s; see fulcrum status");
}

}  // namespace fulcrum::supervisor
