// scene_compiler: from a scene description to the file that the nodes map.
#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/core/exit_code.h"
#include "services/base/runtime/install_places.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {
namespace {

constexpr const char* kUsage =
    R"(scene_compiler: compiles a scene description into the file that the nodes map

  scene_compiler SCENE.yaml --out FILE [--data DIR] [--set SECTION.KEY=VALUE]... [--quiet]
                                                                compile, then report quality
  scene_compiler --info FILE                                    what a compiled scene holds
  scene_compiler --source FILE                                  the effective YAML it was compiled from
  scene_compiler --list [DIR]                                   the scenes described in DIR (default: those shipped)

  --data DIR   look here first for the mesh files that the description names
  --set        a parameter of physics, thermal, haptics, breathing or render other than the description has it, or
               script.power_W, the generator's setting; as often as needed
  --quiet      no progress and no report

Keys of a description: services/scene/README.md.
Exit code: 0 done, 1 failure, 2 bad usage or input, 3 a compiled scene of another version.
)";

struct Arguments {
  std::vector<std::string> plain, changes;
  std::string out, data, info, source;
  bool list = false, quiet = false, help = false;
};

Arguments Parse(const std::vector<std::string>& words) {
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

void List(const std::filesystem::path& folder) {
  for (const SceneSummary& scene : ListScenes(folder)) {
    std::cout << scene.name << "\t" << scene.file.string() << "\t" << scene.description << "\n";
  }
}

void Compile(const Arguments& arguments) {
  if (arguments.plain.size() != 1 || arguments.out.empty()) {
    throw InputError("needs one SCENE.yaml and --out FILE; see --help");
  }
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  const auto progress = [&](const std::string& text) {
    if (!arguments.quiet) {
      std::fprintf(stderr, "%6.2f s  %s\n", seconds(), text.c_str());
    }
  };
  const CompiledScene scene = CompileScene(arguments.plain[0], arguments.data, progress, arguments.changes);
  progress("writing " + arguments.out);
  WriteSceneFile(scene.data, scene.effective_yaml, arguments.out);
  const SceneFile written(arguments.out);  // Reads it back with every check a node makes.
  if (!arguments.quiet) {
    std::fprintf(stderr, "%6.2f s  done: scene '%s'\n", seconds(), written.view().name);
    std::cout << Describe(written.view(), Measure(written.view()));
  }
}

ExitCode Run(const Arguments& arguments) {
  if (arguments.help) {
    std::cout << kUsage;
  } else if (!arguments.info.empty()) {
    const SceneFile file(arguments.info);
    std::cout << "scene '" << file.view().name << "'\n" << Describe(file.view(), Measure(file.view()));
  } else if (!arguments.source.empty()) {
    std::cout << SceneFile(arguments.source).source_yaml();
  } else if (arguments.list) {
    List(arguments.plain.empty() ? runtime::ShareFolder() / "scenes" : std::filesystem::path(arguments.plain[0]));
  } else {
    Compile(arguments);
  }
  return ExitCode::kDone;
}

int Main(const std::vector<std::string>& words) {
  ExitCode code = ExitCode::kFailure;
  try {
    code = Run(Parse(words));
  } catch (const InputError& error) {
    std::cerr << "scene_compiler: " << error.what() << "\n";
    code = ExitCode::kBadUsage;
  } catch (const MismatchError& error) {
    std::cerr << "scene_compiler: " << error.what() << "\n";
    code = ExitCode::kMismatch;
  } catch (const std::exception& error) {
    std::cerr << "scene_compiler: " << error.what() << "\n";
  }
  return static_cast<int>(code);
}

}  // namespace
}  // namespace fulcrum::scene

int main(int argc, char** argv) { return fulcrum::scene::Main({argv + 1, argv + argc}); }
