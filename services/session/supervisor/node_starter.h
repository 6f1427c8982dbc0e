// Command lines of the nodes of a session.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/supervisor.h"

namespace fulcrum::supervisor {

struct NodeStarter {
  const UpSettings& settings;
  const SessionFolder& folder;
  const std::filesystem::path& recording;  ///< Empty: no recording.

  [[nodiscard]] NodeCommand Usual(NodeId id) const;
  /// Command of one of two physics nodes. After a restart it follows, because the other one leads by then.
  [[nodiscard]] NodeCommand InPair(const std::string& seat, bool follows) const;
  /// Command that replaces a node that was started by `now`. Throws InputError when it cannot be run or is not allowed,
  /// and for one of two physics nodes.
  /// @param words by what:
  ///   "build" NAME: another build of the node, in NAME/bin of the folder that the cart file names; with the node's
  ///   arguments;
  ///   "recording" FILE: what the node has published there;
  ///   "command" WORD...: any program, in a session with allow_swap_command. One word is a build of the node; more
  ///   words are used as given, with {scene}, {session}, {domain} and {cart} filled in.
  [[nodiscard]] NodeCommand Replacement(const NodeCommand& now, const std::vector<std::string>& words) const;

 private:
  [[nodiscard]] std::filesystem::path BuildOf(NodeId id, const std::string& name) const;
  [[nodiscard]] NodeCommand CommandFrom(const NodeCommand& now, const std::vector<std::string>& words) const;
  [[nodiscard]] std::string Filled(std::string word) const;
};

}  // namespace fulcrum::supervisor
