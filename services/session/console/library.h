// Choices on the page: the scenes of a folder and the recordings of earlier sessions.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::console {

struct SceneChoice {
  std::string name, description;
  double duration_s = 0;
  double power_W = 0;  ///< Generator power of the script [W]; 0: the scene sets none.
  double picture_rate_Hz = 0;
};
/// Scene descriptions of a folder, sorted by file name; unreadable ones are left out.
[[nodiscard]] std::vector<SceneChoice> FindScenes(const std::filesystem::path& folder);

struct RecordingChoice {
  std::string name;  ///< SESSION/FILE.mcap
  std::uint64_t bytes = 0;
};
/// The newest `most` recordings in the session folders of `out`, newest first.
[[nodiscard]] std::vector<RecordingChoice> FindRecordings(const std::filesystem::path& out, std::size_t most);

}  // namespace fulcrum::console
