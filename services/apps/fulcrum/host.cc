#include "services/session/supervisor/host.h"

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/transport/link/options.h"

namespace fulcrum::supervisor::cli {

ExitCode Host(const Words& words) {
  namespace po = boost::program_options;
  po::options_description options;
  options.add_options()(
      "peer", po::value<std::string>()->value_name("ADDR"),
      "numeric address of the cart's machine, which runs fulcrum up --peer (this machine) --remote NODE,...")  //
      ("nodes", po::value<std::string>()->value_name("NODE,..."), "nodes that a cart may run here (default: all)")(
          "address", po::value<std::string>()->value_name("ADDR"),
          "own address on the network of the cart (default: that of the interface to --peer)")(
          "out", po::value<std::string>()->value_name("DIR")->default_value("out"), "folder for the session folders")(
          "cache", po::value<std::string>()->value_name("DIR"),
          "folder of received scenes, named by their hash (default: received, in the cache of compiled scenes)")(
          "keys", po::value<std::string>()->value_name("DIR"),
          "folder of the link's keys, made by fulcrum keys init on one machine and copied to the other (default: that "
          "of the cart file, else the default folder of fulcrum keys)")(
          "insecure-link", "no keys on the link to --peer, for a closed bench; also give it to fulcrum up")(
          "window", "also show the picture in a window")(
          "quality", po::value<std::string>()->value_name("NAME")->default_value("auto"),
          "quality of the picture: auto, low, high");
  AddCart(&options);
  AddDomain(&options);
  AddLinkDomain(&options);
  const Arguments arguments = Parse("host", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  if (values.count("peer") == 0) {
    throw InputError("--peer is missing: give the address of the cart's machine; see fulcrum help host");
  }
  const auto text = [&](const char* name) { return values.count(name) != 0 ? values[name].as<std::string>() : ""; };
  HostSettings settings;
  settings.domain = DomainOf(arguments);
  settings.far = link::FarSettingsFor(bus::FarSide::kHost, text("peer"), text("address"), LinkDomainOf(arguments));
  if (values.count("nodes") != 0) {
    settings.allowed = link::NodesFromNames(text("nodes"));
  }
  if (const std::filesystem::path cart = CartOf(arguments); !cart.empty()) {
    settings.cart = config::LoadCart(cart);
  }
  settings.far.keys = link::KeysOfLink(text("keys"), settings.cart ? settings.cart->security.keys : "",
                                       values.count("insecure-link") != 0);
  settings.out = text("out");
  settings.programs = runtime::ProgramFolder();
  settings.cache =
      values.count("cache") != 0 ? std::filesystem::path(text("cache")) : SceneCache(settings.programs) / "received";
  settings.window = values.count("window") != 0;
  settings.quality = text("quality");
  if (settings.quality != "auto" && settings.quality != "low" && settings.quality != "high") {
    throw InputError("--quality: \"" + settings.quality + "\"; valid: auto, low, high");
  }
  return RunHost(settings);
}

}  // namespace fulcrum::supervisor::cli
