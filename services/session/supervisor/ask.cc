#include "services/session/supervisor/ask.h"

#include <unistd.h>

#include <chrono>
#include <thread>

#include "services/base/core/error.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::supervisor {

control::Reply AskSupervisor(int domain, const std::string& verb, const std::string& argument) {
  const auto socket = control::SocketOf(bus::SharedMemoryDirectory(domain), NodeName(NodeId::kSupervisor));
  // A supervisor that has just started reserves its domain a little before it listens.
  constexpr std::chrono::milliseconds kStart{10'000}, kAgain{20};
  for (const auto begin = std::chrono::steady_clock::now(); DomainGuard::IsHeld(domain);) {
    try {
      return control::Ask(socket, {verb, argument});
    } catch (const InputError&) {
      if (std::chrono::steady_clock::now() - begin > kStart) throw;
    }
    std::this_thread::sleep_for(kAgain);
  }
  // Another user's session: it takes commands of its group's members here.
  const int connection = DomainGuard::Connect(domain);
  if (connection < 0) {
    throw InputError("no session runs in domain " + std::to_string(domain) + "; start one with fulcrum up SCENE");
  }
  try {
    control::Reply reply = control::Ask(connection, {verb, argument});
    ::close(connection);
    if (!reply.ok && reply.text == control::kNotAdmitted) {
      reply.text =
          "the session in domain " + std::to_string(domain) +
          " is another user's and does not take your commands; its cart file can name a group (security.group)";
    }
    return reply;
  } catch (...) {
    ::close(connection);
    throw;
  }
}

}  // namespace fulcrum::supervisor
