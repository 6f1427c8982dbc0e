#include "services/apps/scene_compiler/arguments.h"

#include <algorithm>
#include <charconv>
#include <vector>

#include "services/base/core/error.h"

namespace fulcrum::scene_compiler {
namespace {

constexpr const char* kUsage =
    R"(usage: scene_compiler SCENE.yaml --out FILE [options]
       scene_compiler --new NAME --from MESH [--unit U] [--at X,Y,Z] [--facing X,Y,Z] [--out FILE.yaml]
       scene_compiler --anatomy LABELS.nii.gz|FOLDER [--map LABELS.yaml --out DIR]
       scene_compiler --info FILE [--preview FILE.png]
       scene_compiler --source FILE
       scene_compiler --list [DIR]

Compiles a scene description into the file that the nodes map, then reports its quality. With --new, first writes a
description around a mesh: membrane, tools, scope and a script that grasps and cuts, sized to the organ.

Examples:
  scene_compiler deploy/scenes/small.yaml --out small.fulcrum --set physics.grip_force_N=4
  scene_compiler --new liver --from liver.stl     writes liver.yaml and liver.png; then: fulcrum up liver.yaml

Options:
  --out FILE               compiled scene to write
  --data DIR               folder that is searched first for the mesh files of the description (default: the
                           description's folder)
  --set SECTION.KEY=VALUE  replace a parameter of physics, thermal, haptics, breathing or render in the description,
                           script.power_W (the power of all uses of the generator), or script.hand (expert, novice) and
                           script.seed: performs the script; may be repeated
  --check                  build the scene without writing it
  --preview FILE.png       draw the compiled scene from four sides
  --limit SECONDS          give up after this time (default: 300)
  --new NAME               write NAME.yaml (or --out) and the picture NAME.png beside it
  --from MESH              the organ: .stl, .obj, .off, .ply, .vtk, .vtp, .vtu, .msh, TetGen
  --unit U                 of the mesh: m, cm, mm, um (default: the one in which it has the size of an organ)
  --at X,Y,Z               the middle of the membrane, in mm in the frame of the mesh (default: found)
  --facing X,Y,Z           direction from the organ to the membrane, in the frame of the mesh (default: found)
  --anatomy FILE           a segmentation, as NIfTI label map, DICOM segmentation or folder of surfaces: writes a mesh
                           per organ, a scene and a report into --out; without --map, prints a map to be edited
  --map FILE               what becomes of each label or surface
  --quiet                  print no progress and no report
  --info FILE              print the content and quality of a compiled scene
  --source FILE            print the effective YAML of a compiled scene
  --list                   list the scenes described in DIR (default: those shipped)
  --help                   print this

Keys of a description: services/scene/README.md.
Exit code: 0 done, 1 failure, 2 bad usage or input, 3 a compiled scene of another version.
)";

double Seconds(const std::string& text) {
  double seconds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc() || end != text.data() + text.size() || !(seconds >= 1 && seconds <= 86400)) {
    throw InputError("--limit '" + text + "'; valid: 1 to 86400 seconds");
  }
  return seconds;
}

/// Options that choose what is done; without any a description is compiled.
const std::vector<std::string> kKinds{"--new", "--anatomy", "--info", "--source", "--list"};
const std::string kCompiling = "SCENE.yaml";

/// What reads an option. --quiet and --help go with all.
struct OptionKinds {
  std::string option;
  std::vector<std::string> kinds;
};
const std::vector<OptionKinds> kOptionKinds{{"--out", {kCompiling, "--new", "--anatomy"}},
                                            {"--data", {kCompiling}},
                                            {"--set", {kCompiling}},
                                            {"--check", {kCompiling}},
                                            {"--preview", {kCompiling, "--info"}},
                                            {"--limit", {kCompiling, "--new", "--anatomy"}},
                                            {"--from", {"--new"}},
                                            {"--unit", {"--new"}},
                                            {"--at", {"--new"}},
                                            {"--facing", {"--new"}},
                                            {"--map", {"--anatomy"}}};

bool Contains(const std::vector<std::string>& list, const std::string& text) {
  return std::ranges::find(list, text) != list.end();
}

/// Throws InputError for a word of the command line that would be dropped. @param given its options.
void RefuseForeignOptions(const std::vector<std::string>& given, const std::vector<std::string>& plain) {
  std::string kind = kCompiling;
  for (const std::string& option : kKinds) {
    if (!Contains(given, option)) continue;
    if (kind != kCompiling) throw InputError(kind + " cannot be combined with " + option);
    kind = option;
  }
  for (const auto& [option, kinds] : kOptionKinds) {
    if (!Contains(given, option) || Contains(kinds, kind)) continue;
    std::string problem = option + " cannot be combined with " + kind + "; it goes with";
    for (const std::string& other : kinds) problem += (other == kinds.front() ? " " : ", ") + other;
    throw InputError(problem);
  }
  if (Contains(given, "--check") && Contains(given, "--out")) {
    throw InputError("--check writes no scene: leave out --out, or leave out --check");
  }
  if (kind == "--anatomy" && Contains(given, "--out") && !Contains(given, "--map")) {
    throw InputError("--out goes with --map: without a map, one to be edited is printed and nothing is written");
  }
  const std::size_t most = kind == kCompiling || kind == "--list" ? 1 : 0;
  if (plain.size() > most) {
    throw InputError("'" + plain[most] + "' is one word too many; see --help");
  }
}

}  // namespace

const char* Usage() { return kUsage; }

Arguments ParseArguments(const std::vector<std::string>& words) {
  Arguments arguments;
  std::vector<std::string> given;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    const auto value = [&] {
      if (i + 1 == words.size()) {
        throw InputError(word + " needs a value; see --help");
      }
      return words[++i];
    };
    if (word.starts_with("-")) given.push_back(word);
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
    } else if (word == "--preview") {
      arguments.preview = value();
    } else if (word == "--limit") {
      arguments.limit_s = Seconds(value());
    } else if (word == "--new") {
      arguments.new_name = value();
    } else if (word == "--from") {
      arguments.from = value();
    } else if (word == "--anatomy") {
      arguments.anatomy = value();
    } else if (word == "--map") {
      arguments.map = value();
    } else if (word == "--unit") {
      arguments.unit = value();
    } else if (word == "--at") {
      arguments.at_mm = value();
    } else if (word == "--facing") {
      arguments.facing = value();
    } else if (word == "--list") {
      arguments.list = true;
    } else if (word == "--check") {
      arguments.check = true;
    } else if (word == "--quiet") {
      arguments.quiet = true;
    } else if (word.starts_with("-")) {
      throw InputError("unknown option '" + word + "'; see --help");
    } else {
      arguments.plain.push_back(word);
    }
  }
  if (!arguments.help) RefuseForeignOptions(given, arguments.plain);
  return arguments;
}

}  // namespace fulcrum::scene_compiler
