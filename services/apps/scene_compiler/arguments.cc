#include "services/apps/scene_compiler/arguments.h"

#include "services/base/core/error.h"

namespace fulcrum::scene_compiler {
namespace {

constexpr const char* kUsage =
    R"(usage: scene_compiler SCENE.yaml --out FILE [options]
       scene_compiler --info FILE
       scene_compiler --source FILE
       scene_compiler --list [DIR]

Compiles a scene description into the file that the nodes map, then reports its quality.

Example:
  scene_compiler deploy/scenes/small.yaml --out small.fulcrum --set physics.grip_force_N=4

Options:
  --out FILE               compiled scene to write
  --data DIR               folder that is searched first for the mesh files of the description (default: the
                           description's folder)
  --set SECTION.KEY=VALUE  replace a parameter of physics, thermal, haptics, breathing or render in the description,
                           script.power_W (the power of all uses of the generator), or script.hand (expert, novice) and
                           script.seed: performs the script; may be repeated
  --quiet                  print no progress and no report
  --info FILE              print the content and quality of a compiled scene
  --source FILE            print the effective YAML of a compiled scene
  --list                   list the scenes described in DIR (default: those shipped)
  --help                   print this

Keys of a description: services/scene/README.md.
Exit code: 0 done, 1 failure, 2 bad usage or input, 3 a compiled scene of another version.
)";

}  // namespace

const char* Usage() { return kUsage; }

Arguments ParseArguments(const std::vector<std::string>& words) {
  Arguments arguments;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    const auto value = [&] {
      if (i + 1 == words.size()) {
        throw InputError(word + " needs a value; see --help");
      }
      return words[++i];
    };
    if (word == "--help" || word == "-h") {
      arguments.help = true;
    } else if (word == "--out") {
      arguments.out = value();
    } else if (word == "--set") {
      arguments.changes.push_back(value());
    } else if (word == "--data") {
      arguments.data = value();
    } else if (word == "--info") {
      arguments.info = value();
    } else if (word == "--source") {
      arguments.source = value();
    } else if (word == "--list") {
      arguments.list = true;
    } else if (word == "--quiet") {
      arguments.quiet = true;
    } else if (word.starts_with("-")) {
      throw InputError("unknown option '" + word + "'; see --help");
    } else {
      arguments.plain.push_back(word);
    }
  }
  return arguments;
}

}  // namespace fulcrum::scene_compiler
