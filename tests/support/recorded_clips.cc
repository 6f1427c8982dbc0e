#include "tests/support/recorded_clips.h"

#include <span>
#include <type_traits>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/bleeding.h"
#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/tissue_pattern.h"
#include "services/records/log_tools/recording.h"

namespace fulcrum::testing {
namespace {

// Of the picture's pattern.
constexpr int kPatternTexels = 512;
constexpr float kPatternPerMetre = 16;
constexpr double kPicturePeriod_s = 1.0 / 15;

}  // namespace

ClipOutcome FollowClips(const SceneView& scene, const std::filesystem::path& recording) {
  const std::vector<std::uint8_t> vessels = render::MakeSerosaPattern(kPatternTexels);
  render::MembraneMesh membrane(scene);
  // The shape decides where blood runs, not whether it flows.
  std::vector<float> xyz;
  for (const Vec3f& p : scene.rest_position) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
  membrane.Update(xyz);
  render::Atlas atlas(scene);
  render::Bleeding bleeding(scene, vessels, kPatternTexels, kPatternPerMetre);
  ClipOutcome outcome;
  // The picture takes the events of a period after all of its patches.
  std::vector<ThermalEvent> cuts;
  double last_s = 0, taken_s = 0;
  const auto take_cuts = [&] {
    for (const ThermalEvent& cut : cuts) bleeding.Cut(cut.material, atlas, cut.session_time_s);
    cuts.clear();
    (void)bleeding.Update(last_s, membrane, {}, &atlas);
  };
  log_tools::Recording file(recording, {.topics = {"ClipState", "TopologyState", "TemperaturePatch", "ThermalEvent"}});
  log_tools::Entry entry;
  while (file.Next(&entry)) {
    if (entry.time_s >= taken_s + kPicturePeriod_s) {
      taken_s = entry.time_s;
      take_cuts();
    }
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, ClipState>) {
        outcome.clips = message.count;
        bleeding.SetClips(std::span(message.clips).first(message.count));
      } else if constexpr (std::is_same_v<T, TopologyState>) {
        if (membrane.SetTopology(message)) (void)atlas.PaintCuts(scene, message);
        membrane.Update(xyz);
      } else if constexpr (std::is_same_v<T, TemperaturePatch>) {
        if (message.header.surface != BurntSurface::kSolids) (void)atlas.Apply(message);
      } else if constexpr (std::is_same_v<T, ThermalEvent>) {
        if (message.kind != ThermalEventKind::kCut) return;
        ++outcome.cuts;
        last_s = message.session_time_s;
        cuts.push_back(message);
      }
    });
  }
  take_cuts();
  (void)bleeding.Update(last_s + 1, membrane, {}, &atlas);
  outcome.shed_m3 = bleeding.shed_m3();
  return outcome;
}

}  // namespace fulcrum::testing
