#include "services/session/supervisor/node_starter.h"

#include <unistd.h>

#include <array>
#include <cstring>
#include <utility>

#include "services/base/core/error.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {

NodeCommand NodeStarter::Usual(NodeId id) const {
  NodeCommand command;
  command.id = id;
  command.program = settings.programs / NodeName(id);
  command.arguments = {"--scene",   folder.scene.string(),
                       "--session", folder.path.string(),
                       "--domain",  std::to_string(settings.cart.domain),
                       "--cart",    folder.cart.string()};
  if (id == NodeId::kRender) {
    command.arguments.insert(command.arguments.end(), {"--quality", settings.quality});
    if (settings.window) {
      command.arguments.emplace_back("--window");
    }
    command.has_spare = !settings.window;  // A spare would open a second window.
  }
  if (id == NodeId::kRecorder) {
    if (settings.record) {
      command.arguments.insert(command.arguments.end(), {"--file", recording.string()});
    }
    command.arguments.insert(command.arguments.end(), {"--keep", Fixed(settings.keep_s, 3)});
  }
  command.log = folder.logs / (std::string(NodeName(id)) + ".log");
  return command;
}

NodeCommand NodeStarter::InPair(const std::string& seat, bool follows) const {
  NodeCommand command = Usual(NodeId::kPhysics);
  command.arguments.insert(command.arguments.end(), {"--pair", seat});
  (follows ? command.arguments : command.again).emplace_back("--follow");
  command.log = folder.logs / (std::string(NodeName(NodeId::kPhysics)) + "-" + seat + ".log");
  return command;
}

NodeCommand NodeStarter::Replacement(const NodeCommand& now, const std::vector<std::string>& words) const {
  if (words.empty() || ::access(words.front().c_str(), X_OK) != 0) {
    throw InputError((words.empty() ? "no command" : words.front()) +
                     ": is not an executable program; nothing was changed. Give its path to --with");
  }
  // A program that is not a build of the node gets its own arguments only, not those added at a restart.
  NodeCommand command = now.foreign ? Usual(now.id) : now;
  command.program = words.front();
  command.foreign = words.size() > 1;
  if (command.foreign) {
    command.has_spare = false;
    command.arguments.clear();
    command.again.clear();
    for (std::size_t i = 1; i < words.size(); ++i) command.arguments.push_back(Filled(words[i]));
  }
  return command;
}

std::string NodeStarter::Filled(std::string word) const {
  const std::array<std::pair<const char*, std::string>, 4> names{{{"{scene}", folder.scene.string()},
                                                                  {"{session}", folder.path.string()},
                                                                  {"{domain}", std::to_string(settings.cart.domain)},
                                                                  {"{cart}", folder.cart.string()}}};
  for (const auto& [name, value] : names) {
    if (const std::size_t at = word.find(name); at != std::string::npos) {
      word.replace(at, std::strlen(name), value);
    }
  }
  return word;
}

}  // namespace fulcrum::supervisor
