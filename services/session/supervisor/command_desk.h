// Execution of commands to the supervisor: calls the handler of their verb.
//
//   CommandDesk desk(memory, guard, "lab", {{"down", [&](auto&, auto) { return End(); }}});
//   desk.Serve(MonotonicNs());  // Each turn of the loop.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "services/session/supervisor/domain_guard.h"
#include "services/transport/control/control_socket.h"

namespace fulcrum::supervisor {

using CommandAnswer = control::Reply;

class CommandDesk {
 public:
  using Handler = std::function<CommandAnswer(const std::string& argument, std::int64_t now_ns)>;
  struct Verb {
    std::string name;
    Handler handle;
  };

  /// @param memory the cart's private directory, for the socket of this user.
  /// @param guard must outlive this.
  /// @param group name of the group whose members may send commands; empty: this user only. Throws InputError if there
  /// is no such group.
  /// @param verbs in the order in which the reply to an unknown verb lists them.
  CommandDesk(const std::filesystem::path& memory, const DomainGuard& guard, const std::string& group,
              std::vector<Verb> verbs);

  /// Executes the commands that have arrived.
  void Serve(std::int64_t now_ns);
  /// Descriptors that can be read when a command has arrived.
  [[nodiscard]] std::vector<int> descriptors() const;
  /// Callers that were refused: of another user and not of the group.
  [[nodiscard]] std::uint64_t refused() const { return own_.refused() + others_.refused(); }

 private:
  [[nodiscard]] CommandAnswer Execute(const control::Request& request, std::int64_t now_ns) const;

  const std::vector<Verb> verbs_;
  control::Server own_;     ///< In the private directory.
  control::Server others_;  ///< On the guard's socket.
};

}  // namespace fulcrum::supervisor
