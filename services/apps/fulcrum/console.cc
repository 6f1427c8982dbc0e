#include "services/session/console/console.h"

#include <cstdio>

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"

namespace fulcrum::supervisor::cli {

ExitCode Console(const Words& words) {
  namespace po = boost::program_options;
  namespace fs = std::filesystem;
  po::options_description options;
  options.add_options()                                                                                               //
      ("port", po::value<int>()->value_name("N")->default_value(8480), "of the page; 0: any that is free")            //
      ("bind", po::value<std::string>()->value_name("ADDRESS")->default_value("127.0.0.1"),                           //
       "numeric address to listen on; other than loopback, the page and its token cross the network in the clear")    //
      ("host-name", po::value<Words>()->value_name("NAME")->composing(),                                              //
       "a name under which the page may be asked for, beside localhost, this machine's and numeric addresses")        //
      ("token-file", po::value<std::string>()->value_name("FILE"),                                                    //
       "keep the token in this file, and use the one that is in it (default: a new one at each start)")               //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "session folders are made in here")  //
      ("data", po::value<std::string>()->value_name("DIR"), "folder of the meshes that scenes import");
  AddCart(&options);
  AddDomain(&options);
  const Arguments arguments = Parse("console", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  const auto path = [&](const char* name) {
    return values.count(name) != 0 ? fs::absolute(values[name].as<std::string>()) : fs::path();
  };
  console::ConsoleSettings settings;
  settings.port = values["port"].as<int>();
  if (settings.port < 0 || settings.port > 65535) {
    throw InputError("--port " + std::to_string(settings.port) + ": must be 0 to 65535");
  }
  settings.bind = values["bind"].as<std::string>();
  if (values.count("host-name") != 0) {
    settings.host_names = values["host-name"].as<Words>();
  }
  settings.token_file = path("token-file");
  settings.cart = CartOf(arguments);
  settings.data = path("data");
  settings.out = path("out");
  settings.scenes = runtime::ShareFolder() / "scenes";
  settings.programs = runtime::ProgramFolder();
  settings.domain =
      DomainOf(arguments, settings.cart.empty() ? kDefaultDomain : config::LoadCart(settings.cart).domain);
  console::Console console(settings);
  if (!settings.bind.starts_with("127.") && settings.bind != "::1") {
    std::fprintf(stderr, "fulcrum: --bind %s: whoever sees this network's traffic sees the token\n",
                 settings.bind.c_str());
  }
  std::printf("open %s\ntoken in %s\nCtrl-C ends the console; a session goes on\n", console.Address().c_str(),
              console.token_file().c_str());
  std::fflush(stdout);
  console.Run();
  if (console.session_runs()) {
    std::printf("a session runs still in domain %d: fulcrum down ends it, fulcrum console watches it again\n",
                settings.domain);
  }
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
