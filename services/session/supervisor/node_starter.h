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
  /// Command that replaces a node that was started by `now`. One word is a build of the node and gets the node's
  /// arguments. More words are used as given, with {scene}, {session}, {domain} and {cart} filled in. Throws InputError
  /// when the program cannot be run.
  [[nodiscard]] NodeCommand Replacement(const NodeCommand& now, const std::vector<std::string>& words) const;

 private:
  [[nodiscard]] std::string Filled(std::string word) const;
};

}  // namespace fulcrum::supervisor
