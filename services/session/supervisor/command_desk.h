// Execution of commands to the supervisor: reads them from the bus, calls the handler of their verb, publishes the
// reply.
//
//   CommandDesk desk(std::move(commands), std::move(replies), {{"down", [&](auto&, auto) { return End(); }}});
//   desk.Serve(MonotonicNs());  // Each turn of the loop.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::supervisor {

/// Result of a command.
struct CommandAnswer {
  bool ok = true;    ///< False: refused, and nothing was changed.
  std::string text;  ///< One line, for people.
};

class CommandDesk {
 public:
  using Handler = std::function<CommandAnswer(const std::string& argument, std::int64_t now_ns)>;
  struct Verb {
    std::string name;
    Handler handle;
  };

  /// @param verbs in the order in which the reply to an unknown verb lists them.
  CommandDesk(std::unique_ptr<bus::Input<Command>> commands, std::unique_ptr<bus::Output<CommandReply>> replies,
              std::vector<Verb> verbs);

  /// Executes the commands that have arrived, in their order. A command with the request id of a recent one is a
  /// repetition, sent because no reply has arrived yet: it gets the same reply again and is not executed.
  void Serve(std::int64_t now_ns);

 private:
  [[nodiscard]] bool Repeat(std::uint64_t request_id, std::int64_t now_ns);
  [[nodiscard]] CommandAnswer Execute(const Command& command, std::int64_t now_ns) const;

  const std::vector<Verb> verbs_;
  std::deque<CommandReply> answered_;  ///< The newest replies.
  bus::Stamper stamper_;
  // The input is closed before the output.
  std::unique_ptr<bus::Output<CommandReply>> replies_;
  std::unique_ptr<bus::Input<Command>> commands_;
};

}  // namespace fulcrum::supervisor
