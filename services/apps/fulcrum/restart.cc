#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"

namespace fulcrum::supervisor::cli {

ExitCode Restart(const Words& words) {
  boost::program_options::options_description options;
  AddDomain(&options);
  const Arguments arguments = Parse("restart", words, options, {"node"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  if (arguments.values.count("node") == 0) {
    throw InputError("NODE is missing, for example physics_node; fulcrum status lists the nodes");
  }
  return Ask(DomainOf(arguments), "restart", arguments.values["node"].as<std::string>());
}

}  // namespace fulcrum::supervisor::cli
