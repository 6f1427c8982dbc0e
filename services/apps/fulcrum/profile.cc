// fulcrum profile: what a scene costs on this machine. The program `scene_profiler` contains the solver and measures.
#include <cstdio>
#include <filesystem>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/session/supervisor/scene_cache.h"

namespace fulcrum::supervisor::cli {
namespace fs = std::filesystem;
namespace po = boost::program_options;

ExitCode Profile(const Words& words) {
  po::options_description options;
  options.add_options()                                                                                     //
      ("data", po::value<std::string>()->value_name("DIR"), "folder of the meshes that the scene imports")  //
      ("set", po::value<Words>()->value_name("SECTION.KEY=VALUE")->composing(),
       "replace a parameter of the scene; may be repeated")  //
      ("seconds", po::value<std::string>()->value_name("S"),
       "first part of the script [s], 1 to 3600 (default: all)")  //
      ("threads", po::value<std::string>()->value_name("N"),
       "most threads to try, 1 to 64 (default: cores less two, which the other nodes need)")  //
      ("json", po::value<std::string>()->value_name("FILE"), "also write the figures to FILE");
  const Arguments arguments = Parse("profile", words, options, {"scene"});
  if (arguments.help) {
    std::puts(
        "The tissue alone moves through the scene's script, without heat and cuts, with each preset of mode accurate,\n"
        "and is compared with eight substeps in a quarter of the period. Takes ten times as long as the script.\n"
        "Run it on an idle machine. Exit codes: 0 a preset is in time, 1 none is, 2 bad use or scene.");
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  if (values.count("scene") == 0) throw InputError("SCENE is missing, for example: fulcrum profile built-in");
  SceneRequest request;
  request.name = values["scene"].as<std::string>();
  if (values.count("data") != 0) request.data = fs::absolute(values["data"].as<std::string>());
  if (values.count("set") != 0) request.changes = values["set"].as<Words>();
  request.library = runtime::ShareFolder() / "scenes";
  request.compiler = runtime::ProgramFolder() / "scene_compiler";
  request.cache = SceneCache(runtime::ProgramFolder());
  Words command{"scene_profiler", ResolveScene(request).string()};
  for (const char* name : {"seconds", "threads", "json"}) {
    if (values.count(name) != 0)
      command.insert(command.end(), {std::string("--") + name, values[name].as<std::string>()});
  }
  Become(command);
}

}  // namespace fulcrum::supervisor::cli
