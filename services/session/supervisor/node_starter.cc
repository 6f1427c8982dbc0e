#include "services/session/supervisor/node_starter.h"

#include <unistd.h>

#include <array>
#include <cstring>
#include <utility>

#include "services/base/core/error.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {
namespace {

constexpr const char* kOwnBuild = "own";  // The programs with which the session was started.

}  // namespace

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
      if (config::IsOperated(settings.cart)) command.arguments.emplace_back("--hands");
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
  if (settings.standby && now.id == NodeId::kPhysics) {
    throw InputError(
        "physics_node of this session runs twice (--standby): a replacement would only follow the other one; nothing "
        "was changed. Start a session without --standby");
  }
  const std::string kind = words.empty() ? std::string() : words.front();
  if (kind == "build" && words.size() == 2) return CommandFrom(now, {BuildOf(now.id, words[1]).string()});
  if (kind == "recording" && words.size() == 2) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(words[1], ignored)) {
      throw InputError(words[1] + ": is no recording; nothing was changed");
    }
    return CommandFrom(now, {(settings.programs / "replayer").string(), words[1], "--live", "--only", NodeName(now.id),
                             "--domain", std::to_string(settings.cart.domain)});
  }
  if (kind == "command" && words.size() > 1) {
    if (!settings.allow_swap_command) {
      throw InputError(
          "this session takes no command lines; nothing was changed. Start it with fulcrum up --allow-swap-command, or "
          "name a build (--build NAME)");
    }
    return CommandFrom(now, {words.begin() + 1, words.end()});
  }
  throw InputError("swap: needs a build, a recording or a command; nothing was changed");
}

std::filesystem::path NodeStarter::BuildOf(NodeId id, const std::string& name) const {
  if (name == kOwnBuild) return settings.programs / NodeName(id);
  const std::filesystem::path builds = settings.cart.builds;
  if (builds.empty()) {
    throw InputError(
        "the cart file names no folder of builds (`builds: DIR`); nothing was changed. Valid without it: " +
        std::string(kOwnBuild));
  }
  // A name, never a path.
  std::string found = kOwnBuild;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(builds, ignored)) {
    const std::string build = entry.path().filename();
    if (build == name) return entry.path() / "bin" / NodeName(id);
    found += ", " + build;
  }
  throw InputError("no build \"" + name + "\" in " + builds.string() + "; nothing was changed. Valid: " + found);
}

NodeCommand NodeStarter::CommandFrom(const NodeCommand& now, const std::vector<std::string>& words) const {
  if (::access(words.front().c_str(), X_OK) != 0) {
    throw InputError(words.front() + ": is not an executable program; nothing was changed");
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
