#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor::cli {

ExitCode Generator(const Words& words) {
  boost::program_options::options_description options;
  const auto power = [] { return boost::program_options::value<double>()->value_name("W"); };
  options.add_options()("cut", power(), "power of mode cut, 0 to 300 W")(
      "coag", power(), "power of mode coag, 0 to 300 W")("blend", power(), "power of mode blend, 0 to 300 W");
  AddDomain(&options);
  const Arguments arguments = Parse("generator", words, options, {});
  if (arguments.help) return ExitCode::kDone;
  std::string turned;
  for (const char* knob : {"cut", "coag", "blend"}) {
    if (arguments.values.count(knob) == 0) continue;
    turned.append(turned.empty() ? "" : " ").append(knob).append("=");
    turned.append(Fixed(arguments.values[knob].as<double>(), 2));
  }
  return Ask(DomainOf(arguments), "generator", turned);
}

}  // namespace fulcrum::supervisor::cli
