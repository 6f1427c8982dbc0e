#include "services/apps/replayer/pictures.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "services/apps/replayer/render_replay.h"

namespace fulcrum::replay {

PicturesResult ReplayPictures(const PicturesSettings& settings, const SceneView& scene,
                              const std::function<void(double)>& progress) {
  render::RenderSettings render_settings;
  // Quality auto depends on the speed of the machine, so that pictures would differ between runs.
  render_settings.quality = render::Quality::kHigh;
  render_settings.frames = settings.frames;
  RenderReplay replay(settings.recording, scene, render_settings);
  render::RenderNode& node = replay.node();
  const double period_s = 1.0 / std::max(0.001f, scene.render.rate_Hz);
  double due_s = 0, told_s = 0;
  while (const std::optional<double> time_s = replay.Next()) {
    if (settings.until_s >= 0 && *time_s > settings.until_s) break;
    if (*time_s < due_s) continue;
    due_s = period_s * (std::floor(*time_s / period_s) + 1);
    replay.Step(*time_s);
    // Without this wait, a replay faster than the disk would drop pictures.
    node.WaitForFiles();
    if (progress && *time_s > told_s + 0.1) {
      told_s = *time_s;
      progress(*time_s);
    }
  }
  node.Finish();
  node.WaitForFiles();
  Health health;
  node.FillHealth(&health);
  double missing = 0;
  for (const Metric& metric : health.metrics) {
    if (metric.name == "png_failed" || metric.name == "png_dropped") missing += metric.value;
  }
  if (missing > 0) {
    throw std::runtime_error(std::to_string(static_cast<std::uint64_t>(missing)) + " pictures were not written to " +
                             settings.frames.string() + "; the last error: " + health.last_error);
  }
  return {node.pictures_written(), health.metrics};
}

}  // namespace fulcrum::replay
