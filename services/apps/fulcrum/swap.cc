#include <boost/program_options/parsers.hpp>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;

/// Path of a program: as given when it contains '/', else beside this program.
std::string Found(const std::string& program) {
  if (program.find('/') != std::string::npos) return fs::absolute(program);
  return runtime::ProgramFolder() / program;
}

}  // namespace

ExitCode Swap(const Words& words) {
  boost::program_options::options_description options;
  options.add_options()("with", boost::program_options::value<std::string>()->value_name("COMMAND"),
                        "one word: a build of the node, which gets the node's arguments; more words: used as given, "
                        "with {scene}, {session}, {domain} and {cart} filled in");
  AddDomain(&options);
  const Arguments arguments = Parse("swap", words, options, {"node"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  if (arguments.values.count("node") == 0 || arguments.values.count("with") == 0) {
    throw InputError(
        "NODE or --with COMMAND is missing. For example: fulcrum swap physics_node --with "
        "build/other/bin/physics_node");
  }
  std::vector<std::string> command = boost::program_options::split_unix(arguments.values["with"].as<std::string>());
  if (command.empty()) {
    throw InputError("--with: the command is empty");
  }
  command[0] = Found(command[0]);
  std::string argument = arguments.values["node"].as<std::string>();
  for (const std::string& word : command) {
    argument += "\n" + word;
  }
  return Ask(DomainOf(arguments, kDefaultDomain), "swap", argument);
}

}  // namespace fulcrum::supervisor::cli
