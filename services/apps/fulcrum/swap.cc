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
  namespace po = boost::program_options;
  po::options_description options;
  options.add_options()("build", po::value<std::string>()->value_name("NAME"),
                        "build of the node in NAME/bin of the folder `builds` of the cart file; own: the one of the "
                        "session's own programs")("recording", po::value<std::string>()->value_name("FILE"),
                                                  "what the node has published in this recording")(
      "with", po::value<std::string>()->value_name("COMMAND"),
      "any command, in a session started with --allow-swap-command. One word: a build of the node, which gets the "
      "node's arguments; more words: used as given, with {scene}, {session}, {domain} and {cart} filled in");
  AddDomain(&options);
  const Arguments arguments = Parse("swap", words, options, {"node"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  if (values.count("node") == 0 || values.count("build") + values.count("recording") + values.count("with") != 1) {
    throw InputError(
        "give NODE and one of --build NAME, --recording FILE and --with COMMAND. For example: fulcrum swap "
        "physics_node --build candidate");
  }
  std::string argument = values["node"].as<std::string>();
  if (values.count("build") != 0) {
    argument += "\nbuild\n" + values["build"].as<std::string>();
  } else if (values.count("recording") != 0) {
    argument += "\nrecording\n" + fs::absolute(values["recording"].as<std::string>()).string();
  } else {
    std::vector<std::string> command = po::split_unix(values["with"].as<std::string>());
    if (command.empty()) throw InputError("--with: the command is empty");
    command[0] = Found(command[0]);
    argument += "\ncommand";
    for (const std::string& word : command) argument += "\n" + word;
  }
  return Ask(DomainOf(arguments), "swap", argument);
}

}  // namespace fulcrum::supervisor::cli
