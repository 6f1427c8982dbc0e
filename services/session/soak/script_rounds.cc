#include "services/session/soak/script_rounds.h"

#include <algorithm>

#include "services/base/core/error.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::soak {

std::vector<ScriptKey> ScriptRounds(std::span<const ScriptKey> script, double round_s, double total_s) {
  std::vector<ScriptKey> rounds;
  for (auto first = script.begin(); first != script.end();) {
    const auto last =
        std::find_if(first, script.end(), [tool = first->tool](const ScriptKey& key) { return key.tool != tool; });
    for (double start_s = 0; start_s < total_s; start_s += round_s + kWayBack_s) {
      ScriptKey end = *first;
      for (auto key = first; key != last && start_s + static_cast<double>(key->time_s) <= total_s; ++key) {
        end = *key;
        end.time_s = static_cast<float>(start_s + static_cast<double>(key->time_s));
        if (rounds.empty() || rounds.back().tool != end.tool || rounds.back().time_s < end.time_s) {
          rounds.push_back(end);
        }
      }
      // A pedal that is down at the last key is released at the end of the round, so that the way back makes no cut.
      const double end_s = start_s + round_s;
      if (end.pedals != 0 && end_s <= total_s && rounds.back().time_s < static_cast<float>(end_s)) {
        end.time_s = static_cast<float>(end_s);
        rounds.push_back(end);
      }
      if (end_s <= total_s) {
        rounds.back().pedals = 0;
        rounds.back().power_W = 0;
      }
    }
    first = last;
  }
  return rounds;
}

void WriteSceneOfRounds(const std::filesystem::path& from, double total_s, const std::filesystem::path& to) {
  const scene::SceneFile file(from);
  SceneView view = file.view();
  if (view.script.empty()) {
    throw InputError("scene \"" + std::string(view.name) +
                     "\" has no script, so no tool would move; choose one with a script");
  }
  const std::vector<ScriptKey> rounds = ScriptRounds(view.script, static_cast<double>(view.script_duration_s), total_s);
  view.script = rounds;
  view.script_duration_s = static_cast<float>(total_s);
  scene::WriteSceneFile(view, file.source_yaml(), to);
}

}  // namespace fulcrum::soak
