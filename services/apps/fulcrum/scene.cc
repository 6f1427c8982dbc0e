#include <algorithm>
#include <cstdio>
#include <iostream>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUsage =
    R"(usage: fulcrum scene new NAME --from MESH [--unit U] [--at X,Y,Z] [--facing X,Y,Z] [--out FILE.yaml]
       fulcrum scene check SCENE [--data DIR]
       fulcrum scene preview SCENE [--out FILE.png] [--data DIR]
       fulcrum scene explain KEY
       fulcrum scene list

new      writes NAME.yaml around a mesh of an organ, with membrane, tools, scope and a script that grasps and
         cuts, and draws it into NAME.png
check    reads and builds a scene without writing it, and prints its size and quality
preview  draws a scene from four sides
explain  prints a key's default and valid values; every key that contains the text
list     lists the shipped scenes

Examples:
  fulcrum scene new liver --from liver.stl && fulcrum up liver.yaml
  fulcrum scene explain cavity_mm
)";

/// A file, or the description of a shipped scene.
std::string SceneFile(const std::string& name) {
  std::error_code error;
  const fs::path shipped = runtime::ShareFolder() / "scenes" / (name + ".yaml");
  return !fs::exists(name, error) && fs::exists(shipped, error) ? shipped.string() : name;
}

void Explain(const std::string& text) {
  std::vector<config::KeyRule> found;
  // Keys of lists are known where a scene has them.
  for (const char* scene : {"openhelp", "built-in", "dissection", "assisted", "gallbladder"}) {
    for (const config::KeyRule& rule :
         scene::SceneRules(runtime::ShareFolder() / "scenes" / (std::string(scene) + ".yaml"))) {
      const auto is_same = [&](const config::KeyRule& other) { return other.path == rule.path; };
      if (rule.path.find(text) != std::string::npos && !rule.valid.empty() &&
          std::none_of(found.begin(), found.end(), is_same)) {
        found.push_back(rule);
      }
    }
  }
  if (found.empty()) {
    throw InputError("no key contains '" + text + "'; all of them: fulcrum reference scene " +
                     (runtime::ShareFolder() / "scenes/openhelp.yaml").string());
  }
  for (const config::KeyRule& rule : found) {
    std::printf("%-44s %s%s; valid: %s\n", rule.path.c_str(), rule.standard ? "default " : "must be given",
                !rule.standard           ? ""
                : rule.standard->empty() ? "none"
                                         : rule.standard->c_str(),
                rule.valid.c_str());
  }
}

}  // namespace

ExitCode Scene(const Words& words) {
  if (words.empty() || words[0] == "--help" || words[0] == "-h" ||
      std::find(words.begin(), words.end(), "--help") != words.end()) {
    std::cout << kUsage;
    return ExitCode::kDone;
  }
  const std::string& what = words[0];
  const auto needs = [&](const char* name) -> const std::string& {
    if (words.size() < 2) throw InputError("scene " + what + " needs " + name + "; see fulcrum scene --help");
    return words[1];
  };
  Words rest(words.begin() + std::min<std::ptrdiff_t>(2, std::ssize(words)), words.end());
  Words command{"scene_compiler"};
  if (what == "new") {
    command.insert(command.end(), {"--new", needs("NAME")});
  } else if (what == "check") {
    command.insert(command.end(), {SceneFile(needs("SCENE")), "--check"});
  } else if (what == "preview") {
    const std::string file = SceneFile(needs("SCENE"));
    std::string picture = fs::path(file).stem().string() + ".png";
    if (const auto out = std::find(rest.begin(), rest.end(), "--out"); out != rest.end() && out + 1 != rest.end()) {
      picture = out[1];
      rest.erase(out, out + 2);
    }
    command.insert(command.end(), {file, "--preview", picture});
  } else if (what == "explain") {
    Explain(needs("KEY"));
    return ExitCode::kDone;
  } else if (what == "list") {
    command.emplace_back("--list");
  } else {
    throw InputError("no 'scene " + what + "'; valid: new, check, preview, explain, list");
  }
  command.insert(command.end(), rest.begin(), rest.end());
  Become(command);
}

}  // namespace fulcrum::supervisor::cli
