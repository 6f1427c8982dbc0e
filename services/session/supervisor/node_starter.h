// How the nodes of a session are started.
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
  const std::filesystem::path& recording;  ///< Empty: nothing is recorded.

  [[nodiscard]] NodeCommand Usual(NodeId id) const;
  /// One of two physics nodes. Whoever comes back follows, for the other one leads by then.
  [[nodiscard]] NodeCommand InPair(const std::string& seat, bool follows) const;
  /// What takes the place of a node that was started by `now`. One word: a build of the node, which gets the node's
  /// arguments. More words: as they stand, with {scene}, {session}, {domain} and {cart} filled in. Throws InputError
  /// when the program cannot be run.
  [[nodiscard]] NodeCommand Replacement(const NodeCommand& now, const std::vector<std::string>& words) const;

 private:
  [[nodiscard]] std::string Filled(std::string word) const;
};

}  // namespace fulcrum::supervisor
