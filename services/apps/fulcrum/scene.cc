#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <optional>

#include "services/apps/fulcrum/commands.h"
#include "services/base/config/json_schema.h"
#include "services/base/core/error.h"
#include "services/base/runtime/install_places.h"
#include "services/scene/compiler/materials.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::supervisor::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUsage =
    R"(usage: fulcrum scene new NAME --from MESH [--unit U] [--at X,Y,Z] [--facing X,Y,Z] [--out FILE.yaml]
       fulcrum scene check SCENE [--data DIR]
       fulcrum scene preview SCENE [--out FILE.png] [--data DIR]
       fulcrum scene explain KEY
       fulcrum scene schema
       fulcrum scene list [DIR]
       fulcrum scene materials [SCENE]

new        writes NAME.yaml around a mesh of an organ, with membrane, tools, scope and a script that grasps and
           cuts, and draws it into NAME.png
check      reads and builds a scene without writing it, and prints its size and quality
preview    draws a scene from four sides
explain    prints a key's default and valid values; every key that contains the text
schema     prints a JSON Schema of the keys, for an editor that completes and checks YAML
list       lists the shipped scenes, or those described in DIR
materials  lists the materials of bodies and sheets with their source, with those beside SCENE

Examples:
  fulcrum scene new liver --from liver.stl && fulcrum up liver.yaml
  fulcrum scene explain cavity_mm
  fulcrum scene schema >scene.schema.json
)";

/// A file, or the description of a shipped scene.
std::string SceneFile(const std::string& name) {
  std::error_code error;
  const fs::path shipped = runtime::ShareFolder() / "scenes" / (name + ".yaml");
  return !fs::exists(name, error) && fs::exists(shipped, error) ? shipped.string() : name;
}

/// Every key that is read for the shipped scenes, once.
std::vector<config::KeyRule> AllRules() {
  std::vector<config::KeyRule> all;
  const auto add = [&](std::vector<config::KeyRule> rules) {
    for (config::KeyRule& rule : rules) {
      const auto is_same = [&](const config::KeyRule& other) { return other.path == rule.path; };
      if (std::none_of(all.begin(), all.end(), is_same)) all.push_back(std::move(rule));
    }
  };
  // Keys of lists are known where a scene has them.
  for (const char* scene : {"openhelp", "built-in", "dissection", "assisted", "gallbladder", "pelvis"}) {
    add(scene::SceneRules(runtime::ShareFolder() / "scenes" / (std::string(scene) + ".yaml")));
  }
  // Defaults of a sheet that names no material come before those of one that does.
  constexpr const char* kSheet =
      "name: sheet\nbodies: [{name: b, material: fat, shape: {ellipsoid_mm: [20, 20, 20]}}]\n"
      "sheets: [{name: s, over: b, at_mm: [0, 0, 20], facing: [0, 0, 1], width_mm: 20, length_mm: 20}]\n";
  for (const std::string region : {"box_mm", "ellipsoid_mm"}) {
    add(scene::ParseSceneYaml(kSheet + ("regions: [{name: r, " + region + ": [9, 9, 9]}]\n"), "sheet.yaml", {}).rules);
  }
  add(scene::SceneRules(runtime::ShareFolder() / "scenes" / "adhesions.yaml"));
  // What a material says is no default of the key, a sheet lies over a body or between two lines, and a region is a box
  // or an ellipsoid.
  constexpr std::array kOptional{"bodies[].look",
                                 "bodies[].youngs_modulus_kPa",
                                 "bodies[].density_kg_m3",
                                 "sheets[].over",
                                 "sheets[].at_mm",
                                 "sheets[].facing",
                                 "sheets[].width_mm",
                                 "sheets[].length_mm",
                                 "sheets[].youngs_modulus_kPa",
                                 "sheets[].thickness_mm",
                                 "regions[].box_mm",
                                 "regions[].ellipsoid_mm"};
  for (config::KeyRule& rule : all) {
    if (std::ranges::find(kOptional, rule.path) != kOptional.end()) rule.standard = "";
  }
  return all;
}

/// Also `base`, which is resolved before the keys are read, and for each tool the keys of all: those of its kind are
/// read, and the shipped scenes do not have each kind at each place.
std::vector<config::KeyRule> RulesForEditors() {
  std::vector<config::KeyRule> all{{"base", 0, "", "a text: a file beside this one, or the name of a shipped scene"}};
  const std::vector<config::KeyRule> read = AllRules();
  all.insert(all.end(), read.begin(), read.end());
  for (const config::KeyRule& rule : read) {
    for (const std::string section : {"tools.tool", "script.tool"}) {
      if (!rule.path.starts_with(section) || rule.path.size() <= section.size()) continue;
      for (int tool = 0; tool < kMaxTools; ++tool) {
        all.push_back(rule);
        all.back().path[section.size()] = static_cast<char>('0' + tool);
      }
    }
  }
  return all;
}

void Explain(const std::string& text) {
  std::vector<config::KeyRule> found = AllRules();
  std::erase_if(found, [&](const config::KeyRule& rule) {
    return rule.path.find(text) == std::string::npos || rule.valid.empty();
  });
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

/// `scene`: none, or one beside which there may be more.
void ListMaterials(const std::optional<std::string>& scene) {
  std::vector<fs::path> beside;
  if (scene) {
    const fs::path file = SceneFile(*scene);
    std::error_code error;
    if (!fs::is_regular_file(file, error)) throw InputError("scene materials: no scene '" + *scene + "'");
    beside.push_back(file.parent_path());
  }
  const scene::MaterialLibrary library(beside);
  std::printf("%-12s %10s  %-14s %8s  %s\n", "", "E, kPa", "spread, kPa", "kg/m3", "source");
  for (const std::string& name : library.Names()) {
    std::optional<scene::NamedMaterial> read;
    try {
      read = library.Find(name);
    } catch (const InputError& error) {
      std::printf("%-12s refused: %s\n", name.c_str(), error.what());
    }
    if (!read) continue;
    std::array<char, 40> spread{}, sheet{};
    std::snprintf(spread.data(), spread.size(), "%g to %g", 1e-3 * read->least_Pa, 1e-3 * read->most_Pa);
    if (read->thickness_m > 0) std::snprintf(sheet.data(), sheet.size(), "sheet of %g mm; ", 1e3 * read->thickness_m);
    std::printf("%-12s %10g  %-14s %8g  %s%s\n", name.c_str(), 1e-3 * read->material.youngs_modulus_Pa, spread.data(),
                read->material.density_kg_m3, sheet.data(), read->source.c_str());
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
  const std::ptrdiff_t own_words = what == "list" ? 1 : 2;
  Words rest(words.begin() + std::min(own_words, std::ssize(words)), words.end());
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
  } else if (what == "schema") {
    std::cout << config::JsonSchema(RulesForEditors(), "Fulcrum scene");
    return ExitCode::kDone;
  } else if (what == "materials") {
    ListMaterials(words.size() > 1 ? std::optional(words[1]) : std::nullopt);
    return ExitCode::kDone;
  } else if (what == "list") {
    command.emplace_back("--list");
  } else {
    throw InputError("no 'scene " + what + "'; valid: new, check, preview, explain, schema, list, materials");
  }
  command.insert(command.end(), rest.begin(), rest.end());
  Become(command);
}

}  // namespace fulcrum::supervisor::cli
