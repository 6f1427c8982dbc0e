#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {

ExitCode Dump(const Words& words) {
  boost::program_options::options_description options;
  AddDomain(&options);
  const Arguments arguments = Parse("dump", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  return Ask(DomainOf(arguments), "dump", "requested by fulcrum dump");
}

}  // namespace fulcrum::supervisor::cli
