// A strip of membrane clamped at two ends and pulled until it tears, with the owner of the topology in the loop. Shared
// by the test and the benchmark of tearing.
#pragma once

#include <cstdint>
#include <string>

#include "services/scene/format/scene_file.h"

namespace fulcrum::cut {

struct StripSettings {
  float h_m = 0.002f;  ///< Mesh spacing.
  float length_m = 0.040f, width_m = 0.020f;
  float speed_m_s = 0.020f;  ///< Speed of the clamp.
  float tear_stretch = 1.8f;
  /// Frames along the sides stretch with the strip and keep its width, as in a planar tension test: the stretch is
  /// uniform. Otherwise the sides are free, and the largest stretch is at a corner of a clamp.
  bool guided = false;
  float prestrain = 0;
  double after_s =
      3;  ///< Duration after the pull, which ends when the strip is apart or a second after the first tear.
  double most_s = 6;
};

struct StripResult {
  bool torn = false, finite = true, asleep = false;
  float stretch = 0;    ///< Nominal (clamp to clamp, prestrain included) at the first tear.
  double apart_s = -1;  ///< From the first tear until no live edge joins the halves; -1: never.
  double still_s = -1;  ///< From the first tear until nothing moves faster than 1 mm/s for good; -1: never.
  std::uint32_t torn_edges = 0, severed_edges = 0;
  std::string fault;  ///< Fault found by the validator of mesh and cells; empty: none.
};

[[nodiscard]] scene::SceneData StripScene(const StripSettings& settings);
[[nodiscard]] StripResult PullStrip(const StripSettings& settings);

}  // namespace fulcrum::cut
