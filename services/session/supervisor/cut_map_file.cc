#include "services/session/supervisor/cut_map_file.h"

#include <exception>
#include <system_error>

#include "services/records/log_tools/cut_map.h"
#include "services/records/log_tools/cut_picture.h"
#include "services/session/supervisor/session_folder.h"

namespace fulcrum::supervisor {
namespace {

/// Largest recording that is read: about two minutes of the built-in scene, which takes some ten seconds.
constexpr std::uintmax_t kLongest_B = 200'000'000;

}  // namespace

std::filesystem::path WriteCutMap(const std::filesystem::path& recording, const SceneView& scene,
                                  const std::filesystem::path& folder) {
  std::error_code none;
  const std::uintmax_t size_B = recording.empty() ? 0 : std::filesystem::file_size(recording, none);
  if (size_B == 0 || none || size_B > kLongest_B) return {};
  try {
    const log_tools::CutMap map = log_tools::ReadCutMap(recording, scene);
    if (!map.has_cut()) return {};
    std::filesystem::path picture = folder / "cut.png";
    WriteFile(picture, log_tools::DrawCutMap(map, std::string(scene.name) + "  " + map.recorded.session_id));
    WriteFile(folder / "cut.json", log_tools::FiguresJson(map));
    return picture;
  } catch (const std::exception&) {
    // A report without its map is still a report.
    return {};
  }
}

}  // namespace fulcrum::supervisor
