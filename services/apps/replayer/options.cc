#include "services/apps/replayer/options.h"

#include <unistd.h>

#include <algorithm>
#include <array>

#include "services/apps/replayer/assertion.h"
#include "services/apps/replayer/command_line.h"
#include "services/base/core/error.h"
#include "services/nodes/app/cart_security.h"
#include "services/nodes/app/version.h"
#include "services/records/recording/recorded_scene.h"
#include "services/transport/bus/access.h"

namespace fulcrum::replay {
namespace {

/// The nodes that `option` names, each once. Throws InputError for a name that is not in `valid`.
std::vector<NodeId> NodesNamed(const CommandLine& line, const char* option, const std::vector<NodeId>& valid) {
  std::vector<NodeId> nodes;
  for (const std::string& name : line.TextsOf(option)) {
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

/// All nodes that publish.
const std::vector<NodeId> kPublishers{NodeId::kSupervisor, NodeId::kHandleBridge, NodeId::kHaptics,
                                      NodeId::kPhysics,    NodeId::kThermal,      NodeId::kRender};
/// All nodes whose classes replayer contains.
const std::vector<NodeId> kReplayable{NodeId::kPhysics, NodeId::kThermal, NodeId::kHaptics, NodeId::kRender};

std::vector<std::filesystem::path> RecordingsOf(const CommandLine& line) {
  std::vector<std::filesystem::path> recordings;
  for (const std::string& text : line.TextsOf("recording")) {
    recordings.emplace_back(text);
    if (!std::filesystem::exists(recordings.back())) throw InputError(text + ": no such file");
  }
  if (recordings.empty()) throw InputError("RECORDING is missing, for example out/latest/recording.mcap; see --help");
  if (recordings.size() > 1 && !line.Has("lerobot")) {
    throw InputError(recordings[1].string() + ": only --lerobot takes several recordings");
  }
  return recordings;
}

constexpr std::array<const char*, 7> kKinds{"into", "live", "film", "video", "dataset", "lerobot", "test"};

void CheckKind(const CommandLine& line) {
  int kinds = 0;
  for (const char* kind : kKinds) kinds += line.Has(kind) ? 1 : 0;
  if (kinds != 1)
    throw InputError(
        "give one of --into NODE..., --live, --film, --video FILE, --dataset DIR, --lerobot DIR and --test NODE; see "
        "--help");
}

/// The kinds of replay that read an option. --quiet goes with all.
struct OptionKinds {
  const char* option;
  std::vector<std::string> kinds;
};
const std::vector<OptionKinds> kOptionKinds{{"within", {"video"}},
                                            {"every", {"dataset"}},
                                            {"baseline", {"dataset"}},
                                            {"vary", {"dataset"}},
                                            {"seed", {"dataset"}},
                                            {"expect", {"test"}},
                                            {"assert", {"test"}},
                                            {"junit", {"test"}},
                                            {"set", {"into"}},
                                            {"console", {"into"}},
                                            {"only", {"live"}},
                                            {"except", {"live"}},
                                            {"domain", {"live"}},
                                            {"from", {"live"}},
                                            {"frames", {"into", "test"}},
                                            {"threads", {"into", "test"}},
                                            {"rate", {"into", "test"}},
                                            {"until", {"into", "test", "video", "dataset", "lerobot"}},
                                            {"json", {"into", "video", "dataset", "lerobot"}},
                                            {"cart", {"into", "test", "live"}},
                                            {"scene", {"into", "test", "video", "dataset", "lerobot", "film"}}};

/// Throws InputError for an option that the kind of replay would ignore. @pre CheckKind().
void RefuseForeignOptions(const CommandLine& line) {
  for (const auto& [option, kinds] : kOptionKinds) {
    const auto given = [&](const std::string& kind) { return line.Has(kind.c_str()); };
    if (!line.IsGiven(option) || std::any_of(kinds.begin(), kinds.end(), given)) continue;
    const auto kind = std::find_if(kKinds.begin(), kKinds.end(), given);
    std::string problem = std::string("--") + option + " cannot be combined with --" + *kind + "; it goes with";
    for (const std::string& other : kinds) problem += (other == kinds.front() ? " --" : ", --") + other;
    throw InputError(problem);
  }
}

constexpr int kLongestRecording_s = 7 * 24 * 3600;  // As of fulcrum up.

LiveSettings LiveSettingsFrom(const CommandLine& line) {
  LiveSettings settings;
  settings.recording = RecordingsOf(line).front();
  settings.domain = line.ValueOf<int>("domain");
  settings.from_s = line.ValueOf<double>("from");
  if (!(settings.from_s >= 0 && settings.from_s <= kLongestRecording_s)) {
    throw InputError("--from: must be 0 (the first message) to " + std::to_string(kLongestRecording_s) + " seconds");
  }
  if (line.Has("only") && line.Has("except")) throw InputError("give --only or --except, not both");
  settings.nodes = line.Has("only") ? NodesNamed(line, "only", kPublishers) : kPublishers;
  for (const NodeId node : NodesNamed(line, "except", kPublishers)) std::erase(settings.nodes, node);
  if (const std::string& cart = line.TextOf("cart"); !cart.empty()) {
    settings.security = app::SecurityOf(config::LoadCart(cart), bus::kReplayerIdentity);
  }
  return settings;
}

/// Demands of a test.
void ReadDemands(const CommandLine& line, Options* options) {
  if (!options->test) return;
  if (options->lock_step.nodes.size() != 1) throw InputError("--test takes exactly one node");
  if (line.Has("expect")) options->demands.state_hash = ParseStateHash(line.TextOf("expect"));
  for (const std::string& text : line.TextsOf("assert")) options->demands.assertions.push_back(ParseAssertion(text));
  options->junit = line.TextOf("junit");
}

/// Render is not replayed in lock step: it has no state hash.
void ReadPictures(const CommandLine& line, Options* options) {
  options->pictures = std::erase(options->lock_step.nodes, NodeId::kRender) > 0;
  options->frames = line.TextOf("frames");
  if (line.IsGiven("frames") && !options->pictures) throw InputError("--frames goes with node render, which draws");
  if (options->frames.empty() && !options->test) {
    options->frames = options->lock_step.recording.parent_path() / "replayed_frames";
  }
}

/// Reads --rate, --threads and --until.
void ReadPace(const CommandLine& line, LockStepSettings* settings) {
  settings->rate = line.ValueOf<double>("rate");
  if (!(settings->rate >= 0)) throw InputError("--rate: must be 0 (as fast as possible) or more");
  settings->physics_threads = line.ValueOf<int>("threads");
  if (settings->physics_threads < 1 || settings->physics_threads > 64) {
    throw InputError("--threads: must be 1 to 64");
  }
  settings->until_s = line.ValueOf<double>("until");
}

/// Throws InputError for an option without effect on the pictures of render. @param alone no other node is replayed.
void RefuseBesidePictures(const CommandLine& line, bool alone) {
  for (const char* option : {"set", "console", "json", "rate", "threads"}) {
    const std::string name = option;
    const bool of_all = name == "set" || name == "console";
    if (!line.IsGiven(option) || !(of_all || alone)) continue;
    throw InputError("--" + name + " cannot be combined with node render, whose pictures are those of the recording" +
                     (of_all ? "" : "; name another node as well"));
  }
}

/// Reads --set and --console and refuses options that exclude them.
void ReadVariant(const CommandLine& line, Options* options) {
  options->changes = line.TextsOf("set");
  if (!options->changes.empty() && options->lock_step.rate > 0) {
    throw InputError("--rate cannot be combined with --set: both replays run as fast as possible");
  }
  options->console = line.Has("console");
  if (options->pictures) RefuseBesidePictures(line, options->lock_step.nodes.empty());
  if (options->console && !(options->changes.empty() && line.TextOf("json").empty())) {
    throw InputError("--console cannot be combined with --set or --json");
  }
  if (options->console && line.IsGiven("until")) {
    throw InputError("--console cannot be combined with --until; give the time to its command: go S");
  }
}

void ReadVideo(const CommandLine& line, Options* options) {
  options->video = line.TextOf("video");
  if (options->video.empty()) throw InputError("--video: needs the name of a file, for example video.mp4");
  options->video_within_s = line.ValueOf<double>("within");
  if (!(options->video_within_s >= 0)) throw InputError("--within: must be 0 (as long as it takes) or more seconds");
}

void ReadDataset(const CommandLine& line, Options* options) {
  options->dataset = line.TextOf("dataset");
  if (options->dataset.empty()) throw InputError("--dataset: needs the name of a new folder, for example dataset");
  options->dataset_every_s = line.ValueOf<double>("every");
  if (!(options->dataset_every_s >= 0.01 && options->dataset_every_s <= 3600)) {
    throw InputError("--every: must be 0.01 to 3600 seconds");
  }
  options->dataset_baseline_m = 1e-3 * line.ValueOf<double>("baseline");
  if (!(options->dataset_baseline_m >= 0 && options->dataset_baseline_m <= 0.1)) {
    throw InputError("--baseline: must be 0 (no right pictures) to 100 mm");
  }
  const auto whole = [&](const char* name, std::int64_t most) {
    const auto value = line.ValueOf<std::int64_t>(name);
    if (value < 0 || value > most) {
      throw InputError(std::string("--") + name + ": must be a whole number, 0 to " + std::to_string(most));
    }
    return static_cast<std::uint32_t>(value);
  };
  options->dataset_variations = whole("vary", 1000);
  options->dataset_seed = whole("seed", 1'000'000'000);
}

std::filesystem::path SceneOf(const CommandLine& line, const std::filesystem::path& recording) {
  std::filesystem::path scene = recording::BesideRecording(line.TextOf("scene"), recording, "scene.fulcrum");
  if (scene.empty()) {
    throw InputError("no scene.fulcrum beside " + recording.string() +
                     ": give the compiled scene of that session with --scene");
  }
  return scene;
}

void ReadLerobot(const CommandLine& line, Options* options) {
  options->lerobot.folder = line.TextOf("lerobot");
  if (options->lerobot.folder.empty()) {
    throw InputError("--lerobot: needs the name of a new folder, for example lerobot");
  }
  for (const std::filesystem::path& recording : RecordingsOf(line)) {
    options->lerobot.sessions.push_back({recording, SceneOf(line, recording), {}});
  }
}

void ReadFiles(const CommandLine& line, Options* options) {
  const std::filesystem::path& recording = options->lock_step.recording;
  options->scene = SceneOf(line, recording);
  options->cart = recording::BesideRecording(line.TextOf("cart"), recording, "cart.yaml");
  options->json = line.TextOf("json");
}

/// Writes the reason for which a test cannot begin into its JUnit file: a file of an earlier test would stay otherwise.
void ReportFailedTest(const CommandLine& line, const std::string& why) {
  const std::string& file = line.TextOf("junit");
  if (!line.Has("test") || file.empty()) return;
  NodeId node = NodeId::kPhysics;
  try {
    if (const auto nodes = NodesNamed(line, "test", kReplayable); !nodes.empty()) node = nodes[0];
  } catch (const InputError&) {  // `why` names it.
  }
  const std::vector<std::string> recordings = line.TextsOf("recording");
  WriteJUnit(FailedTest(node, recordings.empty() ? "" : recordings[0], why), file);
}

Options OptionsFrom(const CommandLine& line) {
  Options options;
  if (line.Has("help")) {
    options.answer = line.Help();
    return options;
  }
  if (line.Has("version")) {
    options.answer = std::string("replayer ") + app::kVersion + "\n";
    return options;
  }
  options.lock_step.recording = RecordingsOf(line).front();
  CheckKind(line);
  RefuseForeignOptions(line);
  options.live = line.Has("live");
  options.test = line.Has("test");
  options.film = line.Has("film");
  if (options.live) {
    options.live_settings = LiveSettingsFrom(line);
    return options;
  }
  if (options.film) {
    ReadFiles(line, &options);
    return options;
  }
  options.quiet = line.Has("quiet") || ::isatty(STDERR_FILENO) == 0;
  if (line.Has("video") || line.Has("dataset") || line.Has("lerobot")) {
    if (line.Has("video")) ReadVideo(line, &options);
    if (line.Has("lerobot")) ReadLerobot(line, &options);
    if (line.Has("dataset")) ReadDataset(line, &options);
    ReadPace(line, &options.lock_step);
    ReadFiles(line, &options);
    return options;
  }
  options.lock_step.nodes = NodesNamed(line, options.test ? "test" : "into", kReplayable);
  ReadDemands(line, &options);
  ReadPictures(line, &options);
  ReadPace(line, &options.lock_step);
  ReadVariant(line, &options);
  ReadFiles(line, &options);
  return options;
}

}  // namespace

Options ParseOptions(int argc, char** argv) {
  const CommandLine line(argc, argv);
  try {
    return OptionsFrom(line);
  } catch (const std::exception& error) {
    ReportFailedTest(line, error.what());
    throw;
  }
}

config::CartConfig LoadCart(const Options& options) {
  return options.cart.empty() ? config::CartConfig() : config::LoadCart(options.cart);
}

}  // namespace fulcrum::replay
