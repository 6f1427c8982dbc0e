#include "services/apps/scene_compiler/commands.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>

#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/scene/builder/quality.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene_compiler {
namespace {

void List(const std::filesystem::path& folder) {
  for (const scene::SceneSummary& summary : scene::ListScenes(folder)) {
    std::cout << summary.name << "\t" << summary.file.string() << "\t" << summary.description << "\n";
  }
}

void Compile(const Arguments& arguments) {
  if (arguments.plain.size() != 1 || arguments.out.empty()) {
    throw InputError("SCENE.yaml or --out FILE is missing, or there is more than one SCENE.yaml; see --help");
  }
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  const auto progress = [&](const std::string& text) {
    if (!arguments.quiet) {
      std::fprintf(stderr, "%6.2f s  %s\n", seconds(), text.c_str());
    }
  };
  const scene::CompiledScene compiled =
      scene::CompileScene(arguments.plain[0], arguments.data, progress, arguments.changes);
  progress("writing " + arguments.out);
  scene::WriteSceneFile(compiled.data, compiled.effective_yaml, arguments.out);
  const scene::SceneFile written(arguments.out);  // Reads the file back with all checks that a node makes.
  if (!arguments.quiet) {
    std::fprintf(stderr, "%6.2f s  done: scene '%s'\n", seconds(), written.view().name);
    std::cout << scene::Describe(written.view(), scene::Measure(written.view()));
  }
}

}  // namespace

void Run(const Arguments& arguments) {
  if (arguments.help) {
    std::cout << Usage();
  } else if (!arguments.info.empty()) {
    const scene::SceneFile file(arguments.info);
    std::cout << "scene '" << file.view().name << "'\n" << scene::Describe(file.view(), scene::Measure(file.view()));
  } else if (!arguments.source.empty()) {
    std::cout << scene::SceneFile(arguments.source).source_yaml();
  } else if (arguments.list) {
    List(arguments.plain.empty() ? runtime::ShareFolder() / "scenes" : std::filesystem::path(arguments.plain[0]));
  } else {
    Compile(arguments);
  }
}

}  // namespace fulcrum::scene_compiler
