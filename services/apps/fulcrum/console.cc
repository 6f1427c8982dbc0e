#include "services/session/console/console.h"

#include <unistd.h>

#include <cstdio>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"

namespace fulcrum::supervisor::cli {

ExitCode Console(const Words& words) {
  namespace po = boost::program_options;
  namespace fs = std::filesystem;
  po::options_description options;
  options.add_options()  //
      ("port", po::value<int>()->value_name("N")->default_value(8480),
       "port of the page, 1 to 65535; 0: any free port")                                     //
      ("bind", po::value<std::string>()->value_name("ADDRESS")->default_value("127.0.0.1"),  //
       "numeric address to listen on; with other than loopback, the page is served over TLS with a certificate of its "
       "own")                                                             //
      ("host-name", po::value<Words>()->value_name("NAME")->composing(),  //
       "further valid host name of the page, besides localhost, this machine's name and numeric addresses; may be "
       "repeated")                                                                                                  //
      ("token-file", po::value<std::string>()->value_name("FILE"),                                                  //
       "use the token in this file, or write a new one to it (default: a new token at each start)")                 //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "folder for the session folders")  //
      ("data", po::value<std::string>()->value_name("DIR"), "folder of the meshes that scenes import");
  AddDatabase(&options);
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
  settings.courses = runtime::ShareFolder() / "courses";
  settings.database = DatabaseOf(arguments);
  settings.programs = runtime::ProgramFolder();
  settings.domain = DomainOf(arguments);
  settings.state = UserFolder("XDG_STATE_HOME", ".local/state");
  console::Console console(settings);
  std::fputs(console::Greeting(console.Facts(), ::isatty(STDOUT_FILENO) == 1).c_str(), stdout);
  std::fflush(stdout);
  console.Run();
  if (console.session_runs()) {
    std::printf("a session still runs in domain %d: end it with fulcrum down, or show it with fulcrum console\n",
                settings.domain);
  }
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
