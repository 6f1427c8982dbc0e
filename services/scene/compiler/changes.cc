#include "services/scene/compiler/changes.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/error.h"

namespace fulcrum::scene {
namespace {

constexpr std::string_view kPower = "script.power_W=";
/// Keys of the script itself that can be changed.
constexpr std::array<std::string_view, 2> kOfTheScript{"script.hand", "script.seed"};

std::string Names(std::span<const std::string_view> sections) {
  std::string names;
  for (const std::string_view section : sections) names.append(names.empty() ? "" : ", ").append(section);
  return names;
}

}  // namespace

std::optional<double> PowerOfChange(const std::string& change) {
  if (!change.starts_with(kPower)) return std::nullopt;
  config::StrictYaml yaml = config::StrictYaml::FromText("power_W: " + change.substr(kPower.size()), "--set " + change);
  const double power_W = yaml.root().NumberSi("power_W", config::Range::Between(0, 300));
  yaml.Finish();
  return power_W;
}

std::string ApplyChanges(const std::string& yaml, const std::vector<std::string>& changes,
                         std::span<const std::string_view> sections, std::string_view option) {
  std::string what = std::string(option) + ": the scene's description cannot be read";
  try {
    YAML::Node description = YAML::Load(yaml);
    for (const std::string& change : changes) {
      what = std::string(option) + " " + change;
      const std::size_t dot = change.find('.'), equals = change.find('=');
      const bool whole = dot != std::string::npos && equals != std::string::npos && dot > 0 && dot + 1 < equals &&
                         equals + 1 < change.size();
      const std::string section = whole ? change.substr(0, dot) : std::string();
      if (std::find(sections.begin(), sections.end(), section) == sections.end()) {
        throw InputError(what + ": must be section.key=value with a section of " + Names(sections) +
                         "; for example physics.grip_force_N=5");
      }
      const std::string key = change.substr(0, equals);
      if (section == "script" && std::ranges::find(kOfTheScript, key) == kOfTheScript.end()) {
        throw InputError(what + ": of the script only power_W, hand and seed can be changed");
      }
      description[section][change.substr(dot + 1, equals - dot - 1)] = YAML::Load(change.substr(equals + 1));
    }
    YAML::Emitter text;
    text << description;
    return text.c_str();
  } catch (const YAML::Exception& error) {
    throw InputError(what + ": " + error.what());
  }
}

}  // namespace fulcrum::scene
