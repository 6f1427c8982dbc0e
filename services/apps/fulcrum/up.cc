#include <cstdio>

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/operation.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/scene_cache.h"
#include "services/session/supervisor/scene_forecast.h"
#include "services/session/supervisor/supervisor.h"
#include "services/session/supervisor/training_log.h"
#include "services/transport/link/options.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

/// Tools, handles and pedal follow the operator's input, and no script sets the session's length.
void GiveToOperator(UpSettings* settings) {
  for (config::DeviceConfig& device : settings->cart.devices) device.kind = config::DeviceKind::kOperator;
  for (config::DeviceConfig& device : settings->cart.devices) device.motion.clear();
  for (config::HandleConfig& handle : settings->cart.handles) handle.kind = config::LinkKind::kOperator;
  settings->cart.pedal.kind = config::LinkKind::kOperator;
  settings->seconds = 0;
}

}  // namespace

fs::path SceneCache(const fs::path& programs) {
  if (fs::exists(programs.parent_path() / "CMakeCache.txt")) {
    return programs.parent_path() / "scenes";
  }
  return UserFolder("XDG_CACHE_HOME", ".cache") / "scenes";
}

/// Folder of --attach; empty: the nodes are children of the supervisor.
fs::path AttachTo(const po::variables_map& values) {
  if (values.count("attach") == 0) return {};
  if (values.count("standby") != 0) {
    throw InputError("--attach cannot be combined with --standby, because each node is one service");
  }
  if (values.count("peer") != 0) {
    throw InputError("--attach cannot be combined with --peer and --remote");
  }
  const char* folder = std::getenv("RUNTIME_DIRECTORY");
  if (folder == nullptr || !fs::is_directory(folder)) {
    throw InputError(
        "--attach: RUNTIME_DIRECTORY names no folder; the option is for fulcrum-supervisor.service, for which systemd "
        "sets this variable");
  }
  return folder;
}

ExitCode Up(const Words& words) {
  po::options_description options;
  options.add_options()                                  //
      ("seconds", po::value<double>()->value_name("N"),  //
       "session time [s], above 0, at most 604800 (default: the script's duration; without a script, and where Touch "
       "devices move the tools, until Ctrl-C)")                                                                     //
      ("out", po::value<std::string>()->value_name("DIR")->default_value("out"), "folder for the session folders")  //
      ("window", "also show the picture in a window")                                                               //
      ("hands", po::value<std::string>()->value_name("INPUT"),
       "operate the tools yourself, with INPUT: mouse (and keyboard or gamepad, in the window), browser (the page of "
       "fulcrum console): no script, until Ctrl-C or --seconds; or script: the scene's script moves all, whatever "
       "devices the cart has")                                                                              //
      ("quality", po::value<std::string>()->value_name("NAME")->default_value("auto"),                      //
       "quality of the picture: auto, low, high")                                                           //
      ("data", po::value<std::string>()->value_name("DIR"), "folder of the meshes that the scene imports")  //
      ("set", po::value<Words>()->value_name("SECTION.KEY=VALUE")->composing(),
       "replace a parameter of physics, thermal, haptics, breathing or render in the scene, script.power_W (the "
       "power of all uses of the generator), or script.hand (expert, novice) and script.seed: performs the script; "
       "may be repeated")  //
      ("record", "record all topics into recording.mcap in the session folder")(
          "record-to", po::value<std::string>()->value_name("FILE|DIR"), "record all topics into this file or folder")(
          "no-video",
          "draw no video of a recorded session for the report (services draw none); fulcrum log video draws it later")(
          "keep-last", po::value<double>()->value_name("SECONDS"),
          "keep the newest seconds in memory, above 0, at most 3600, and write them into a file when a node dies, when "
          "its Health turns to degraded, and at fulcrum dump (default: off)")(
          "peer", po::value<std::string>()->value_name("ADDR"),
          "address of the host that runs the nodes of --remote; start fulcrum host --peer (this machine) there")(
          "remote", po::value<std::string>()->value_name("NODE,..."), "nodes that run on the host --peer")(
          "keys", po::value<std::string>()->value_name("DIR"),
          "folder of the link's keys, made by fulcrum keys init and copied to the host --peer (default: that of the "
          "cart "
          "file, else the default folder of fulcrum keys)")(
          "insecure-link", "no keys on the link to --peer, for a closed bench; also give it to fulcrum host")(
          "address", po::value<std::string>()->value_name("ADDR"),
          "own address on the network of the peer (default: that of the interface to --peer)")(
          "standby", "run a second physics_node that takes over when the first is silent")(
          "open-bus",
          "make no keys for this session: every process of this machine can read and write its topics (default: the "
          "keys that the cart file names, or new ones for this session)")(
          "allow-swap-command", "let fulcrum swap --with start any command as this user (default: named builds only)")(
          "keep-going", "continue the session without a node that failed for good (default: end it)")(
          "attach",
          "for nodes that are systemd services: write their arguments below $RUNTIME_DIRECTORY/session; start and kill "
          "none");
  options.add_options()("trainee", po::value<std::string>()->value_name("NAME"),
                        "store the score under this name, 1 to 63 bytes; see fulcrum trainee");
  AddDatabase(&options);
  AddCart(&options);
  AddDomain(&options);
  AddLinkDomain(&options);
  const Arguments arguments = Parse("up", words, options, {"scene"});
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const auto& values = arguments.values;
  if (values.count("scene") == 0) {
    throw InputError("SCENE is missing, for example built-in; see fulcrum help up");
  }
  // Nodes inherit the limit. The recorder has 27 open, and each guest, device or thread of a driver adds some.
  constexpr unsigned kNeededFiles = 128;
  if (const std::string few = runtime::RaiseFileLimit(kNeededFiles); !few.empty()) throw InputError(few);
  UpSettings settings;
  settings.programs = runtime::ProgramFolder();
  if (const fs::path cart = CartOf(arguments); !cart.empty()) {
    settings.cart = config::LoadCart(cart);
  }
  settings.cart.domain = DomainOf(arguments, settings.cart.domain);
  settings.out = values["out"].as<std::string>();
  settings.window = values.count("window") != 0;
  bool on_page = false;
  if (values.count("hands") != 0) {
    const std::string input = values["hands"].as<std::string>();
    if (input != "mouse" && input != "browser" && input != "script") {
      throw InputError("--hands: \"" + input + "\"; valid: mouse, browser, script");
    }
    if (input == "script") {
      config::LetScriptMove(&settings.cart);
    } else {
      GiveToOperator(&settings);
    }
    on_page = input == "browser";
    settings.window = settings.window || input == "mouse";
  }
  settings.quality = values["quality"].as<std::string>();
  if (settings.quality != "auto" && settings.quality != "low" && settings.quality != "high") {
    throw InputError("--quality: \"" + settings.quality + "\"; valid: auto, low, high");
  }
  settings.standby = values.count("standby") != 0;
  if (values.count("peer") != values.count("remote")) {
    throw InputError("--peer and --remote must be given together: the host, and the nodes that run there");
  }
  for (const char* option : {"keys", "insecure-link", "address", "link-domain"}) {
    if (values.count(option) != 0 && values.count("peer") == 0) {
      throw InputError(std::string("--") + option + " is about the link to another host and goes with --peer");
    }
  }
  if (values.count("peer") != 0) {
    settings.peer = values["peer"].as<std::string>();
    settings.remote = link::NodesFromNames(values["remote"].as<std::string>());
    settings.address = values.count("address") != 0 ? values["address"].as<std::string>() : "";
    settings.link_domain = LinkDomainOf(arguments);
    // Invalid addresses are refused here, before any node is started.
    (void)link::FarSettingsFor(bus::FarSide::kCart, settings.peer, settings.address, settings.link_domain);
    settings.link_keys = link::KeysOfLink(values.count("keys") != 0 ? values["keys"].as<std::string>() : "",
                                          settings.cart.security.keys, values.count("insecure-link") != 0);
    if (settings.standby && (settings.remote >> static_cast<unsigned>(NodeId::kPhysics) & 1u) != 0) {
      throw InputError("--standby cannot be combined with --remote physics_node");
    }
  }
  const bool renders_here = (settings.remote >> static_cast<unsigned>(NodeId::kRender) & 1u) == 0;
  if (settings.window && renders_here && std::getenv("DISPLAY") == nullptr) {
    throw InputError("the window needs a display, and DISPLAY is not set; log in on a desktop or start an X server");
  }
  settings.allow_swap_command = values.count("allow-swap-command") != 0;
  settings.open_bus = values.count("open-bus") != 0;
  if (settings.open_bus && !settings.cart.security.keys.empty()) {
    throw InputError("--open-bus: the cart file names keys (security.keys); drop one of the two");
  }
  settings.keep_going = values.count("keep-going") != 0;
  settings.attach = AttachTo(values);
  if (values.count("seconds") != 0) {
    settings.seconds = values["seconds"].as<double>();
    constexpr double kLongest = 7 * 24 * 3600.0;
    if (!(settings.seconds > 0 && settings.seconds <= kLongest)) {
      throw InputError("--seconds " + Fixed(settings.seconds, 2) + ": must be above 0 and at most " +
                       std::to_string(static_cast<int>(kLongest)));
    }
  }
  if (values.count("record-to") != 0) {
    settings.record = fs::absolute(values["record-to"].as<std::string>());
  } else if (values.count("record") != 0) {
    settings.record = fs::path();
  }
  // A service stops soon, and its memory may not be run, as software OpenGL needs it.
  settings.video = values.count("no-video") == 0 && settings.attach.empty();
  if (values.count("keep-last") != 0) {
    settings.keep_s = values["keep-last"].as<double>();
    if (!(settings.keep_s > 0 && settings.keep_s <= 3600)) {
      throw InputError("--keep-last " + Fixed(settings.keep_s, 2) + ": must be above 0 and at most 3600 seconds");
    }
  }
  if (values.count("trainee") != 0) {
    settings.trainee = values["trainee"].as<std::string>();
    CheckTraineeName(settings.trainee);
    if (values.count("hands") == 0 && !config::HasTouch(settings.cart) && !config::IsOperated(settings.cart)) {
      throw InputError("--trainee: this cart has no Touch, so the scene's script would operate, and its score be " +
                       settings.trainee + "'s; add --hands mouse or browser (--hands script to store it all the same)");
    }
    settings.training_database = DatabaseOf(arguments);
  } else if (values.count("database") != 0) {
    throw InputError("--database goes with --trainee NAME; give both");
  }
  SceneRequest request;
  request.name = values["scene"].as<std::string>();
  if (values.count("data") != 0) {
    request.data = fs::absolute(values["data"].as<std::string>());
  }
  if (values.count("set") != 0) {
    request.changes = values["set"].as<Words>();
  }
  request.library = runtime::ShareFolder() / "scenes";
  request.compiler = settings.programs / "scene_compiler";
  request.cache = SceneCache(settings.programs);
  request.for_services = !settings.attach.empty();
  settings.scene = ResolveScene(request);
  if ((settings.remote >> static_cast<unsigned>(NodeId::kPhysics) & 1u) == 0) {
    const std::string expected = ForecastOf(settings.scene, request.cache, settings.programs / "scene_profiler",
                                            settings.cart.timing(NodeId::kPhysics).threads);
    if (!expected.empty()) std::printf("%s\n", expected.c_str());
    std::fflush(stdout);
  }
  if (on_page && !renders_here) {
    // No picture crosses the link, and the page gives the controls only where it shows one.
    std::printf(
        "the tools wait for you: open the page of fulcrum console on %s, where the picture is drawn, and take "
        "the controls; the page of this machine shows no picture\n",
        settings.peer.c_str());
    std::fflush(stdout);
  } else if (on_page) {
    std::printf("the tools wait for you: open the page of fulcrum console --domain %d and take the controls\n",
                settings.cart.domain);
    std::fflush(stdout);
  }
  return Supervisor(settings).Run();
}

}  // namespace fulcrum::supervisor::cli
