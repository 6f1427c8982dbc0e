#include "services/session/soak/soak.h"

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/scene_cache.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

constexpr double kShortest_min = 0.2, kLongest_min = 24 * 60;  // That of a script.

}  // namespace

ExitCode Soak(const Words& words) {
  soak::SoakSettings settings;
  po::options_description options;
  options.add_options()                                                                                              //
      ("minutes", po::value<double>()->value_name("N")->default_value(10, "10"), "session time [min], 0.2 to 1440")  //
      ("chaos", "kill and freeze nodes and occupy all processors at random times in the first two thirds")           //
      ("seed", po::value<std::uint32_t>()->value_name("N")->default_value(1), "seed of the random faults")           //
      ("most-growth", po::value<double>()->value_name("MB")->default_value(20, "20"),                                //
       "largest growth of the resident memory of one process [MB]; more fails the soak")                             //
      ("record", "record all topics; needs about 4 MB of disk per second")                                           //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "folder in which soak/ is made")    //
      ("set", po::value<Words>()->value_name("SECTION.KEY=VALUE")->composing(),
       "replace a parameter of the scene; may be repeated");
  AddCart(&options);
  AddDomain(&options);
  const Arguments arguments = Parse("soak", words, options, {"scene"});
  if (arguments.help) return ExitCode::kDone;
  const auto& values = arguments.values;
  if (values.count("scene") == 0) throw InputError("SCENE is missing, for example small; see fulcrum help soak");
  settings.minutes = values["minutes"].as<double>();
  settings.seed = values["seed"].as<std::uint32_t>();
  settings.limits.rss_growth_MB = values["most-growth"].as<double>();
  if (!(settings.minutes >= kShortest_min && settings.minutes <= kLongest_min)) {
    throw InputError("--minutes " + Fixed(settings.minutes, 2) + ": must be 0.2 to 1440");
  }
  settings.chaos = values.count("chaos") != 0;
  settings.domain = DomainOf(arguments);
  settings.out = values["out"].as<std::string>();
  settings.program = runtime::ProgramFolder() / "fulcrum";
  if (values.count("record") != 0) settings.up.insert(settings.up.end(), {"--record", "--no-video"});
  if (const fs::path cart = CartOf(arguments); !cart.empty()) {
    settings.cart = config::LoadCart(cart);
  }
  SceneRequest request;
  request.name = values["scene"].as<std::string>();
  if (values.count("set") != 0) request.changes = values["set"].as<Words>();
  request.library = runtime::ShareFolder() / "scenes";
  request.compiler = runtime::ProgramFolder() / "scene_compiler";
  request.cache = SceneCache(runtime::ProgramFolder());
  settings.scene = ResolveScene(request);
  return soak::RunSoak(settings);
}

}  // namespace fulcrum::supervisor::cli
