#include <cstdlib>

#include "services/core/error.h"
#include "services/runtime/install_places.h"
#include "services/supervisor/cli/commands.h"
#include "services/supervisor/scene_cache.h"
#include "services/supervisor/supervisor.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

/// Beside the programs in a build tree, else in the user's cache.
fs::path SceneCache(const fs::path& programs) {
  if (fs::exists(programs.parent_path() / "CMakeCache.txt")) {
    return programs.parent_path() / "scenes";
  }
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  if (cache != nullptr && *cache != '\0') {
    return fs::path(cache) / "fulcrum" / "scenes";
  }
  return (home != nullptr ? fs::path(home) / ".cache" : fs::temp_directory_path()) / "fulcrum" / "scenes";
}

/// Empty: the nodes are children.
fs::path AttachTo(const po::variables_map& values) {
  if (values.count("attach") == 0) return {};
  if (values.count("standby") != 0) {
    throw InputError("--attach: a standby is not possible, as each node is one service");
  }
  const char* folder = std::getenv("RUNTIME_DIRECTORY");
  if (folder == nullptr || !fs::is_directory(folder)) {
    throw InputError(
        "--attach: RUNTIME_DIRECTORY names no folder; it is for services of systemd (fulcrum-supervisor.service), "
        "which sets it");
  }
  return folder;
}

}  // namespace

ExitCode Up(const Words& words) {
  po::options_description options;
  options.add_options()                                                                                               //
      ("seconds", po::value<double>()->value_name("N"),                                                               //
       "session time (default: the script's duration; without a script until Ctrl-C)")                                //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "session folders are made in here")  //
      ("window", "show the picture in a window as well")                                                              //
      ("quality", po::value<std::string>()->value_name("NAME")->default_value("auto"),                                //
       "of the picture: auto, low, high")                                                                             //
      ("cart", po::value<std::string>()->value_name("FILE"),
       "cart configuration (default: /etc/fulcrum/cart.yaml of an installation, else everything simulated)")  //
      ("data", po::value<std::string>()->value_name("DIR"), "folder of the meshes that the scene imports")    //
      ("record", "record all topics into recording.mcap of the session folder")(
          "record-to", po::value<std::string>()->value_name("FILE|DIR"), "record all topics into this file or folder")(
          "keep-last", po::value<double>()->value_name("SECONDS"),
          "keep the newest past in memory and write it into a file when a node dies or at fulcrum dump")(
          "standby", "a second physics_node that takes over when the first falls silent")(
          "keep-going", "go on without a node that failed for good")(
          "attach", "the nodes are services: wait for them below $RUNTIME_DIRECTORY/session, start and kill none");
  AddDomain(&options);
  const Arguments arguments = Parse("up", words, options, {"scene"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  if (values.count("scene") == 0) {
    throw InputError("which scene? see fulcrum help up");
  }
  UpSettings settings;
  settings.programs = runtime::ProgramFolder();
  const fs::path machine = runtime::MachineCart();
  if (values.count("cart") != 0) {
    settings.cart = config::LoadCart(values["cart"].as<std::string>());
  } else if (!machine.empty() && fs::exists(machine)) {
    settings.cart = config::LoadCart(machine);
  }
  settings.cart.domain = DomainOf(arguments, settings.cart.domain);
  settings.out = values["out"].as<std::string>();
  settings.window = values.count("window") != 0;
  settings.quality = values["quality"].as<std::string>();
  if (settings.quality != "auto" && settings.quality != "low" && settings.quality != "high") {
    throw InputError("--quality: \"" + settings.quality + "\"; valid: auto, low, high");
  }
  settings.standby = values.count("standby") != 0;
  settings.keep_going = values.count("keep-going") != 0;
  settings.attach = AttachTo(values);
  if (values.count("seconds") != 0) {
    settings.seconds = values["seconds"].as<double>();
    constexpr double kLongest = 7 * 24 * 3600.0;
    if (!(settings.seconds > 0 && settings.seconds <= kLongest)) {
      throw InputError("--seconds: must be above 0 and at most " + std::to_string(static_cast<int>(kLongest)));
    }
  }
  if (values.count("record-to") != 0) {
    settings.record = fs::absolute(values["record-to"].as<std::string>());
  } else if (values.count("record") != 0) {
    settings.record = fs::path();
  }
  if (values.count("keep-last") != 0) {
    settings.keep_s = values["keep-last"].as<double>();
    if (!(settings.keep_s > 0 && settings.keep_s <= 3600)) {
      throw InputError("--keep-last: must be above 0 and at most 3600 seconds");
    }
  }
  SceneRequest request;
  request.name = values["scene"].as<std::string>();
  if (values.count("data") != 0) {
    request.data = fs::absolute(values["data"].as<std::string>());
  }
  request.library = runtime::ShareFolder() / "scenes";
  request.compiler = settings.programs / "scene_compiler";
  request.cache = SceneCache(settings.programs);
  settings.scene = ResolveScene(request);
  return Supervisor(settings).Run();
}

}  // namespace fulcrum::supervisor::cli
