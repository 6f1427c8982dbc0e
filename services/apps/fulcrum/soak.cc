#include "services/session/soak/soak.h"

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/scene_cache.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

constexpr double kShortest_min = 0.2, kLongest_min = 7 * 24 * 60;

}  // namespace

ExitCode Soak(const Words& words) {
  soak::SoakSettings settings;
  po::options_description options;
  options.add_options()                                                                                    //
      ("minutes", po::value<double>()->value_name("N")->default_value(10, "10"), "session time")           //
      ("chaos", "kill and freeze nodes and take the processors away, until a third before the end")        //
      ("seed", po::value<std::uint32_t>()->value_name("N")->default_value(1), "of the blows")              //
      ("most-growth", po::value<double>()->value_name("MB")->default_value(20, "20"),                      //
       "of the resident memory of one process")                                                            //
      ("record", "record all topics meanwhile: some 4 MB a second of disk")                                //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "soak/ is made in here")  //
      ("set", po::value<Words>()->value_name("SECTION.KEY=VALUE")->composing(),
       "a parameter other than in the scene; as often as needed");
  AddCart(&options);
  AddDomain(&options);
  const Arguments arguments = Parse("soak", words, options, {"scene"});
  if (arguments.help) return ExitCode::kDone;
  const auto& values = arguments.values;
  if (values.count("scene") == 0) throw InputError("which scene? see fulcrum help soak");
  settings.minutes = values["minutes"].as<double>();
  settings.seed = values["seed"].as<std::uint32_t>();
  settings.limits.rss_growth_MB = values["most-growth"].as<double>();
  if (!(settings.minutes >= kShortest_min && settings.minutes <= kLongest_min)) {
    throw InputError("--minutes: must be 0.2 to 10080");
  }
  settings.chaos = values.count("chaos") != 0;
  settings.domain = DomainOf(arguments, kDefaultDomain);
  settings.out = values["out"].as<std::string>();
  settings.program = runtime::ProgramFolder() / "fulcrum";
  if (values.count("record") != 0) settings.up.emplace_back("--record");
  if (const fs::path cart = CartOf(arguments); !cart.empty()) {
    settings.up.insert(settings.up.end(), {"--cart", cart.string()});
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
