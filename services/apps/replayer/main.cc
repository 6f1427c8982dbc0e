// replayer: a recorded session again.
#include <unistd.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "services/apps/replayer/changed_scene.h"
#include "services/apps/replayer/console.h"
#include "services/apps/replayer/live.h"
#include "services/apps/replayer/lock_step.h"
#include "services/apps/replayer/lock_step_report.h"
#include "services/apps/replayer/node_test.h"
#include "services/apps/replayer/pictures.h"
#include "services/apps/replayer/what_if.h"
#include "services/apps/replayer/what_if_report.h"
#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/cart_security.h"
#include "services/nodes/app/version.h"
#include "services/records/recording/recorded_scene.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/access.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules
namespace po = boost::program_options;

constexpr const char* kUsage =
    R"(usage: replayer RECORDING --into NODE... [options]
       replayer RECORDING --live [--only NODE... | --except NODE...] [options]
       replayer RECORDING --test NODE [--expect HASH] [--assert EXPR...] [options]

Lets nodes make the ticks of a recorded session again, with exactly the inputs that they had then, and compares their
state with the recorded one after each tick. Stops a node at its first difference and says which tick, topic, field and
index. Needs no bus, no devices and no real time. Into render: the pictures are drawn again.

  replayer out/latest/recording.mcap --into physics thermal haptics

With --set it replays them twice instead, as they were and with a parameter of the scene changed, each time feeding each
other, and reports what the change does to positions, forces, temperature and the cut.

  replayer out/latest/recording.mcap --into physics thermal --set physics.grip_force_N=4

With --console it is led by hand: go, pause, step, seek forward and back.

With --live the recorded topics are published on the bus in real time, as if the session took place: for a node under
development, or in the place of one.

  replayer out/latest/recording.mcap --live --except physics

With --test one node makes all ticks of the session headless, past states that differ, and its figures are held against
what was asked for; --junit writes the result for a CI system. Without --expect and --assert each state must be the
recorded one. fulcrum test-node is the same.

  replayer out/latest/recording.mcap --test thermal --assert "cut_length_mm > 30" --junit thermal.xml

)";

constexpr const char* kExitCodes =
    "\nExit code: 0 every state was the same, 1 a state differed or the recording lacks something, 2 bad usage or "
    "file,\n"
    "3 the recording is of another scene. With --test: 0 passed, 1 failed.\n";

struct Options {
  replay::LockStepSettings lock_step;
  std::vector<std::string> changes;  ///< --set.
  std::filesystem::path scene, cart, json;
  std::filesystem::path frames;
  replay::LiveSettings live_settings;
  bool quiet = false, console = false, live = false, pictures = false, test = false;
  replay::Demands demands;
  std::filesystem::path junit;
  std::string answer;
};

/// All nodes of `option` by name, each once; `valid` says which there are.
std::vector<NodeId> NodesNamed(const po::variables_map& values, const char* option, const std::vector<NodeId>& valid) {
  std::vector<NodeId> nodes;
  if (values.count(option) == 0) return nodes;
  for (const std::string& name : values[option].as<std::vector<std::string>>()) {
    const auto named = [&](NodeId node) {
      const std::string full = NodeName(node);
      return name == full || name + "_node" == full || name + "_bridge" == full;
    };
    const auto node = std::find_if(valid.begin(), valid.end(), named);
    if (node == valid.end()) {
      std::string problem = "--";
      problem.append(option).append(" ").append(name).append(": no such node here; valid:");
      for (const NodeId v : valid) problem.append(" ").append(NodeName(v));
      throw InputError(problem);
    }
    if (std::find(nodes.begin(), nodes.end(), *node) == nodes.end()) nodes.push_back(*node);
  }
  return nodes;
}

/// All that publish.
const std::vector<NodeId> kPublishers{NodeId::kSupervisor, NodeId::kHandleBridge, NodeId::kHaptics,
                                      NodeId::kPhysics,    NodeId::kThermal,      NodeId::kRender};

replay::LiveSettings LiveSettingsFrom(const po::variables_map& values) {
  replay::LiveSettings settings;
  settings.recording = values["recording"].as<std::string>();
  settings.domain = values["domain"].as<int>();
  settings.from_s = values["from"].as<double>();
  if (values.count("only") != 0 && values.count("except") != 0) throw InputError("give --only or --except, not both");
  settings.nodes = values.count("only") != 0 ? NodesNamed(values, "only", kPublishers) : kPublishers;
  for (const NodeId node : NodesNamed(values, "except", kPublishers)) std::erase(settings.nodes, node);
  if (const std::string cart = values["cart"].as<std::string>(); !cart.empty()) {
    settings.security = app::SecurityOf(config::LoadCart(cart), bus::kReplayerIdentity);
  }
  return settings;
}

void ReadDemands(const po::variables_map& values, Options* options) {
  const bool asked = values.count("expect") + values.count("assert") > 0 || !values["junit"].as<std::string>().empty();
  if (!options->test && asked) throw InputError("--expect, --assert and --junit go with --test");
  if (!options->test) return;
  if (options->lock_step.nodes.size() != 1) throw InputError("--test: one node at a time");
  if (values.count("set") + values.count("console") > 0)
    throw InputError("--test goes with neither --set nor --console");
  if (values.count("expect") != 0) {
    options->demands.state_hash = replay::ParseStateHash(values["expect"].as<std::string>());
  }
  if (values.count("assert") != 0) {
    for (const std::string& text : values["assert"].as<std::vector<std::string>>()) {
      options->demands.assertions.push_back(replay::ParseAssertion(text));
    }
  }
  options->junit = values["junit"].as<std::string>();
}

Options Parse(int argc, char** argv) {
  Options options;
  po::options_description visible("Options"), all;
  visible.add_options()  //
      ("into", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "physics, thermal, haptics, render: one or more")                                                          //
      ("test", po::value<std::vector<std::string>>()->value_name("NODE"), "physics, thermal, haptics or render")  //
      ("expect", po::value<std::string>()->value_name("HASH"),
       "test: the state hash after the last tick, 16 hexadecimal digits")  //
      ("assert", po::value<std::vector<std::string>>()->value_name("EXPR"),
       "test: FIGURE < | <= | == | != | >= | > NUMBER, over the figures of the node's Health, each also as NAME.min "
       "and "
       "NAME.max of the session, and ticks, compared, hash_mismatches, starts, session_s, busy_s; as often as "
       "needed")  //
      ("junit", po::value<std::string>()->value_name("FILE")->default_value(""),
       "test: write the result as JUnit XML, too")  //
      ("set", po::value<std::vector<std::string>>()->value_name("SECTION.KEY=VALUE"),
       "a parameter to change, as in the scene's description; as often as needed")  //
      ("console", "read commands from standard input; \"help\" lists them")         //
      ("live", "publish the recorded topics on the bus in real time")               //
      ("only", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "live: those of these nodes")  //
      ("except", po::value<std::vector<std::string>>()->multitoken()->value_name("NODE"),
       "live: those of all but these nodes")                                                                         //
      ("domain", po::value<int>()->value_name("N")->default_value(7), "live: DDS domain, 1 to 100")                  //
      ("from", po::value<double>()->value_name("S")->default_value(0), "live: begin so far into the recording [s]")  //
      ("frames", po::value<std::string>()->value_name("DIR")->default_value(""),
       "folder for the pictures of render; default: replayed_frames beside the recording; in a test they are not "
       "kept")  //
      ("threads",
       po::value<int>()->value_name("N")->default_value(static_cast<int>(std::thread::hardware_concurrency())),
       "that share a step of physics; the states do not depend on it")                                           //
      ("rate", po::value<double>()->value_name("X")->default_value(0), "times real time; 0: as fast as it can")  //
      ("until", po::value<double>()->value_name("S")->default_value(-1), "end at this session time [s]")         //
      ("scene", po::value<std::string>()->value_name("FILE")->default_value(""),
       "compiled scene; default: scene.fulcrum beside the recording")  //
      ("cart", po::value<std::string>()->value_name("FILE")->default_value(""),
       "cart configuration; default: cart.yaml beside the recording; live: its keys, by default those of the session "
       "that runs")                                                                                             //
      ("json", po::value<std::string>()->value_name("FILE")->default_value(""), "write the result there, too")  //
      ("quiet", "no progress")                                                                                  //
      ("version", "print the version")                                                                          //
      ("help", "print this");
  po::options_description hidden;
  hidden.add_options()("recording", po::value<std::string>());
  all.add(visible).add(hidden);
  po::positional_options_description position;
  position.add("recording", 1);
  try {
    po::variables_map values;
    const auto style = po::command_line_style::default_style & ~po::command_line_style::allow_guessing;
    po::store(po::command_line_parser(argc, argv).options(all).positional(position).style(style).run(), values);
    if (values.count("help") != 0) {
      std::ostringstream text;
      text << kUsage << visible << kExitCodes;
      options.answer = text.str();
      return options;
    }
    if (values.count("version") != 0) {
      options.answer = std::string("replayer ") + app::kVersion + "\n";
      return options;
    }
    if (values.count("recording") == 0) throw InputError("which recording? See --help");
    options.lock_step.recording = values["recording"].as<std::string>();
    if (!std::filesystem::exists(options.lock_step.recording)) {
      throw InputError(options.lock_step.recording.string() + ": no such file");
    }
    options.live = values.count("live") != 0;
    options.test = values.count("test") != 0;
    if (values.count("into") + values.count("live") + values.count("test") != 1) {
      throw InputError("give one of --into NODE..., --live and --test NODE; see --help");
    }
    if (options.live) {
      options.live_settings = LiveSettingsFrom(values);
      return options;
    }
    options.lock_step.nodes = NodesNamed(values, options.test ? "test" : "into",
                                         {NodeId::kPhysics, NodeId::kThermal, NodeId::kHaptics, NodeId::kRender});
    ReadDemands(values, &options);
    options.pictures = std::erase(options.lock_step.nodes, NodeId::kRender) > 0;
    const std::string frames = values["frames"].as<std::string>();
    options.frames = !frames.empty() || options.test ? std::filesystem::path(frames)
                                                     : options.lock_step.recording.parent_path() / "replayed_frames";
    options.lock_step.rate = values["rate"].as<double>();
    if (!(options.lock_step.rate >= 0)) throw InputError("--rate: must be 0 (as fast as it can) or more");
    options.lock_step.physics_threads = values["threads"].as<int>();
    if (options.lock_step.physics_threads < 1 || options.lock_step.physics_threads > 64) {
      throw InputError("--threads: must be 1 to 64");
    }
    options.lock_step.until_s = values["until"].as<double>();
    if (values.count("set") != 0) options.changes = values["set"].as<std::vector<std::string>>();
    if (!options.changes.empty() && options.lock_step.rate > 0) {
      throw InputError("--rate says nothing with --set: both replays run as fast as they can");
    }
    options.console = values.count("console") != 0;
    if (options.console && !(options.changes.empty() && values["json"].as<std::string>().empty())) {
      throw InputError("--console goes with neither --set nor --json");
    }
    options.scene =
        recording::BesideRecording(values["scene"].as<std::string>(), options.lock_step.recording, "scene.fulcrum");
    options.cart =
        recording::BesideRecording(values["cart"].as<std::string>(), options.lock_step.recording, "cart.yaml");
    options.json = values["json"].as<std::string>();
    options.quiet = values.count("quiet") != 0 || ::isatty(STDERR_FILENO) == 0;
    if (options.scene.empty()) {
      throw InputError("no scene.fulcrum beside " + options.lock_step.recording.string() +
                       ": give the compiled scene of that session with --scene");
    }
  } catch (const po::error& error) {
    throw InputError(std::string(error.what()) + "; see --help");
  }
  return options;
}

/// A folder of its own that goes with it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "fulcrum-replay-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw InputError("cannot make a folder " + name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

int RunLive(const replay::LiveSettings& settings) {
  runtime::InstallStopSignals();
  const replay::LiveResult result = ReplayLive(settings, [] { return runtime::ShouldStop(); });
  std::printf("published %llu messages, at most %.1f ms late; %llu could not be sent, %llu could not be read\n",
              static_cast<unsigned long long>(result.published), 1e3 * result.latest_s,
              static_cast<unsigned long long>(result.failed), static_cast<unsigned long long>(result.undecodable));
  return static_cast<int>(result.published > 0 ? ExitCode::kDone : ExitCode::kFailure);
}

config::CartConfig LoadCart(const Options& options) {
  return options.cart.empty() ? config::CartConfig() : config::LoadCart(options.cart);
}

std::function<void(double)> ProgressOf(const Options& options) {
  if (options.quiet) return {};
  return [](double time_s) { std::fprintf(stderr, "\rsession time %.1f s ", time_s); };
}

replay::NodeTestResult TestRender(const Options& options, const SceneView& scene) {
  if (options.demands.state_hash) {
    throw InputError("--expect: render_node has no state hash, its pictures are its machine's; use --assert");
  }
  const replay::PicturesSettings settings{options.lock_step.recording, options.frames, options.lock_step.until_s};
  const std::int64_t begin = runtime::MonotonicNs();
  const replay::PicturesResult pictures = ReplayPictures(settings, scene, ProgressOf(options));
  replay::NodeTestResult result;
  result.node = NodeId::kRender;
  result.recording = options.lock_step.recording;
  result.wall_s = 1e-9 * static_cast<double>(runtime::MonotonicNs() - begin);
  for (const Metric& metric : pictures.health) result.figures[metric.name] = metric.value;
  result.cases.push_back({"draws the recording", replay::Verdict::kPassed, {}});
  if (pictures.written == 0) {
    result.cases.back() = {"draws the recording", replay::Verdict::kError, "the recording holds nothing to draw"};
  }
  Judge(options.demands, &result);
  return result;
}

int RunTest(Options* options) {
  const bool render = options->pictures;
  const NodeId node = render ? NodeId::kRender : options->lock_step.nodes[0];
  const auto report = [&](const replay::NodeTestResult& result) {
    if (!options->junit.empty()) WriteJUnit(result, options->junit);
  };
  try {
    const scene::SceneFile scene(options->scene);
    const config::CartConfig cart = LoadCart(*options);
    const ScratchFolder scratch;
    options->lock_step.folder = scratch.path();
    if (options->frames.empty()) options->frames = scratch.path() / "frames";
    const replay::NodeTestResult result =
        render ? TestRender(*options, scene.view())
               : TestNode(options->lock_step, options->demands, scene.view(), cart, ProgressOf(*options));
    std::fputs(options->quiet ? "" : "\r\033[K", stderr);
    std::cout << ReportText(result);
    report(result);
    return static_cast<int>(result.passed() ? ExitCode::kDone : ExitCode::kFailure);
  } catch (const std::exception& error) {
    // A CI system reads the file, not the exit code.
    report(replay::FailedTest(node, options->lock_step.recording, error.what()));
    throw;
  }
}

/// Not every scene has each node (an exercise without heat): those are left out, with a line.
void LeaveOutMissing(const SceneView& scene, Options* options) {
  const auto missing = [&](NodeId node) { return (scene.node_mask >> static_cast<unsigned>(node) & 1u) == 0; };
  std::string names;
  std::erase_if(options->lock_step.nodes, [&](NodeId node) {
    if (missing(node)) names += std::string(names.empty() ? "" : ", ") + NodeName(node);
    return missing(node);
  });
  if (names.empty()) return;
  if (options->lock_step.nodes.empty() && !options->pictures) {
    throw InputError("--into: scene \"" + std::string(scene.name) + "\" has no " + names);
  }
  std::cout << names << ": not in scene \"" << scene.name << "\", left out\n";
}

int Run(int argc, char** argv) {
  Options options = Parse(argc, argv);
  if (!options.answer.empty()) {
    std::cout << options.answer;
    return static_cast<int>(ExitCode::kDone);
  }
  if (options.live) return RunLive(options.live_settings);
  if (options.test) return RunTest(&options);
  const scene::SceneFile scene(options.scene);
  LeaveOutMissing(scene.view(), &options);
  const config::CartConfig cart = LoadCart(options);
  const ScratchFolder scratch;
  options.lock_step.folder = scratch.path();
  // A process with one thread: its moments are kept by forking it.
  if (options.console) return RunConsole(options.lock_step, scene.view(), cart);
  const std::function<void(double)> progress = ProgressOf(options);
  const auto end_progress = [&] { std::fputs(options.quiet ? "" : "\r\033[K", stderr); };
  if (options.pictures) {
    const replay::PicturesSettings pictures{options.lock_step.recording, options.frames, options.lock_step.until_s};
    const std::uint64_t written = ReplayPictures(pictures, scene.view(), progress).written;
    end_progress();
    std::cout << written << " pictures in " << options.frames.string() << '\n';
    if (options.lock_step.nodes.empty()) return static_cast<int>(written > 0 ? ExitCode::kDone : ExitCode::kFailure);
  }
  if (!options.changes.empty()) {
    const SceneView changed = replay::WithChanges(scene, options.changes);
    const replay::WhatIfResult result = ReplayWhatIf(options.lock_step, scene.view(), changed, cart, progress);
    end_progress();
    std::cout << ReportText(result, options.lock_step.nodes);
    if (!options.json.empty()) WriteReportJson(result, options.json);
    return static_cast<int>(result.missing.empty() ? ExitCode::kDone : ExitCode::kFailure);
  }
  const replay::LockStepResult result = ReplayInLockStep(options.lock_step, scene.view(), cart, progress);
  end_progress();
  std::cout << ReportText(result);
  if (!options.json.empty()) WriteReportJson(result, options.json);
  return static_cast<int>(result.good() ? ExitCode::kDone : ExitCode::kFailure);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc, argv);
  } catch (const InputError& error) {
    std::cerr << "replayer: " << error.what() << '\n';
    return static_cast<int>(ExitCode::kBadUsage);
  } catch (const MismatchError& error) {
    std::cerr << "replayer: " << error.what() << '\n';
    return static_cast<int>(ExitCode::kMismatch);
  } catch (const std::exception& error) {
    std::cerr << "replayer: " << error.what() << '\n';
    return static_cast<int>(ExitCode::kFailure);
  }
}
