#include <boost/program_options.hpp>
#include <sstream>

#include "services/base/core/error.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/version.h"

namespace fulcrum::app {

bool NodeOptions::TakeFlag(std::string_view flag) { return std::erase(extra, flag) > 0; }

std::string NodeOptions::TakeValue(std::string_view name, std::string_view missing) {
  std::string value(missing);
  for (std::size_t k = 0; k < extra.size();) {
    const auto at = extra.begin() + static_cast<std::ptrdiff_t>(k);
    if (extra[k] == name) {
      if (k + 1 == extra.size()) {
        throw InputError(std::string(name) + " needs a value");
      }
      value = extra[k + 1];
      extra.erase(at, at + 2);
    } else if (extra[k].starts_with(std::string(name) + "=")) {
      value = extra[k].substr(name.size() + 1);
      extra.erase(at);
    } else {
      ++k;
    }
  }
  return value;
}

ParsedOptions ParseNodeOptions(int argc, const char* const* argv, NodeId node, const char* description) {
  namespace po = boost::program_options;
  po::options_description known("Options");
  known.add_options()                                                                                       //
      ("scene", po::value<std::string>()->value_name("FILE"), "compiled scene file (see scene_compiler)")   //
      ("session", po::value<std::string>()->value_name("DIR"), "session folder: checkpoints and pictures")  //
      ("domain", po::value<int>()->value_name("N")->default_value(config::DefaultDomain()),
       "DDS domain, 1 to 100: one per cart (default: one of this user)")                                    //
      ("cart", po::value<std::string>()->value_name("FILE"), "cart configuration; default: all simulated")  //
      ("version", "print the version")                                                                      //
      ("help", "print this");
  ParsedOptions parsed;
  try {
    po::variables_map values;
    // Abbreviations are off: "--dom" must not be accepted as "--domain".
    const auto style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    const auto line = po::command_line_parser(argc, argv).options(known).style(style).allow_unregistered().run();
    po::store(line, values);
    if (values.count("help") != 0) {
      std::ostringstream text;
      text << "usage: " << NodeName(node) << " --scene FILE --session DIR [options]\n\n"
           << description << "\nUsually started by `fulcrum up`.\n\n"
           << known;
      parsed.answer = text.str();
      return parsed;
    }
    if (values.count("version") != 0) {
      parsed.answer = std::string(NodeName(node)) + " " + kVersion + "\n";
      return parsed;
    }
    for (const char* required : {"scene", "session"}) {
      if (values.count(required) == 0) {
        throw InputError(std::string("--") + required + " is missing; see --help");
      }
    }
    parsed.options.scene = values["scene"].as<std::string>();
    parsed.options.session = values["session"].as<std::string>();
    if (values.count("cart") != 0) {
      parsed.options.cart = values["cart"].as<std::string>();
    }
    parsed.options.domain = values["domain"].as<int>();
    parsed.options.extra = po::collect_unrecognized(line.options, po::include_positional);
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see --help");
  }
  if (parsed.options.domain < 1 || parsed.options.domain > 100) {
    throw InputError("--domain " + std::to_string(parsed.options.domain) + ": must be 1 to 100");
  }
  return parsed;
}

}  // namespace fulcrum::app
