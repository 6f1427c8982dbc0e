// A scene's description, which may be based on the shipped ones: refused with a file's name, or read to settings that
// are written and read again unchanged. From small ones a scene is built, which passes its validation.
#include "services/base/core/error.h"
#include "services/scene/builder/build.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/validate.h"
#include "tests/fuzz/config/keys_of.h"
#include "tests/fuzz/line_mutator.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

/// Up to these sizes a scene is built in a few milliseconds.
constexpr int kMostTubeVertices = 300, kMostMembraneNodes = 600;

class SceneYaml final : public Target {
 public:
  SceneYaml() {
    for (const Seed& seed : Seeds()) WriteFile(folder_.path() / seed.name, seed.bytes);
  }
  Outcome Offer(Input input) override {
    const std::filesystem::path file = folder_.path() / "fuzzed.yaml";
    WriteFile(file, input);
    std::optional<scene::SceneDescription> read;
    try {
      // The meshes of an imported organ are not available here.
      if (!NeedsFiles(scene::SceneRules(file))) read = scene::ReadSceneYaml(file, {});
    } catch (const InputError& refusal) {
      Promise(std::string_view(refusal.what()).starts_with(folder_.path().string()), "a refusal that names no file");
      return Outcome::kRefused;
    }
    if (read) Check(*read);
    return Outcome::kAccepted;
  }
  Bytes Mutate(Input input, unsigned seed) override { return BytesOf(MutateLines(TextOf(input), seed)); }
  std::vector<std::string> Words() override {
    std::vector<config::KeyRule> all;
    for (const Seed& seed : Seeds()) {
      const std::vector<config::KeyRule> rules = scene::SceneRules(folder_.path() / seed.name);
      all.insert(all.end(), rules.begin(), rules.end());
    }
    return KeysOf(all);
  }
  std::vector<Seed> Seeds() override { return FilesOf("deploy/scenes", ".yaml"); }

 private:
  static bool NeedsFiles(const std::vector<config::KeyRule>& rules) {
    return std::any_of(rules.begin(), rules.end(), [](const config::KeyRule& rule) {
      return rule.path == "organ.import" || rule.path.ends_with(".meshes");
    });
  }
  static void Check(const scene::SceneDescription& read) {
    try {
      const scene::SceneDescription again = scene::ParseSceneYaml(read.effective_yaml, "again.yaml", {});
      Promise(again.effective_yaml == read.effective_yaml, "it is not read as it is written");
    } catch (const InputError& refusal) {
      throw BrokenPromise(std::string("what was written is refused: ") + refusal.what());
    }
    const scene::SceneSettings& settings = read.settings;
    if (2 * settings.tube.rings * settings.tube.segments > kMostTubeVertices ||
        settings.membrane.rows * settings.membrane.cols > kMostMembraneNodes) {
      return;
    }
    try {
      const scene::SceneData data = scene::BuildProcedural(settings);
      const auto fault = scene::FindFault(data.View());
      Promise(!fault, fault ? "a scene was built with a fault: " + fault->section + ": " + fault->reason : "");
    } catch (const InputError&) {
      // Settings that give no scene are reported to the user.
    }
  }

  ScratchFolder folder_;
};

}  // namespace

std::unique_ptr<Target> MakeSceneYaml() { return std::make_unique<SceneYaml>(); }

}  // namespace fulcrum::fuzz
