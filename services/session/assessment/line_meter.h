// Measures of the hook on the membrane: trace along the planned line, distance to protected structures, time in the air
// with the pedal down.
#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <vector>

#include "services/base/core/scene_view.h"

namespace fulcrum::assessment {

/// Foot of the perpendicular on a polyline.
struct LinePlace {
  double distance_m = 0;
  double along_m = 0;  ///< Arc length from the beginning of the line.
};

/// A polyline on the flattened membrane.
class SheetLine {
 public:
  explicit SheetLine(std::span<const Vec2f> points);
  [[nodiscard]] bool empty() const { return points_.size() < 2; }
  [[nodiscard]] double length_m() const { return empty() ? 0 : along_.back(); }
  /// Nearest place on the line. @pre !empty()
  [[nodiscard]] LinePlace Nearest(const Eigen::Vector2d& p) const;

 private:
  std::vector<Eigen::Vector2d> points_;
  std::vector<double> along_;  ///< Arc length at each point [m].
};

[[nodiscard]] inline Eigen::AlignedBox2d WholeAtlas() {
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  return {-far, far};
}

/// Place in the atlas [m] of the first sheet, on which planned line and protected structures lie: its box, in whole
/// patches. WholeAtlas() in a scene that has no other sheet.
[[nodiscard]] Eigen::AlignedBox2d PlaceOfFirstSheet(const SheetScene& scene);

/// Place of a CauteryContact, and whether a pedal was down at its time.
struct HookSample {
  double time_s = 0;
  bool touching = false;  ///< The membrane; `material` is its place there.
  Vec2f material = Vec2f::Zero();
  bool energised = false;
  bool on_solid = false;  ///< It touches a solid instead.
};

/// Takes each sample in order.
class LineMeter {
 public:
  explicit LineMeter(const SceneView& scene);

  struct Finding {
    bool pedal_without_contact = false, off_line = false, ureter_near = false, nerve_near = false;
  };
  Finding Add(const HookSample& contact);

  [[nodiscard]] const SheetLine& line() const { return line_; }
  [[nodiscard]] double pedal_without_contact_s() const { return pedal_without_contact_s_; }
  [[nodiscard]] double traced_m() const { return traced_m_; }
  /// Mean deviation over the length of the trace; nullopt without a trace.
  [[nodiscard]] std::optional<double> deviation_mean_m() const;
  [[nodiscard]] std::optional<double> deviation_max_m() const;
  /// Share of the planned line that was traced, 0 … 1.
  [[nodiscard]] double done() const;

 private:
  struct Spared {
    ProtectedKind kind;
    double reach_m;
    SheetLine line;
  };
  bool Trace(const Eigen::Vector2d& at, bool continues);

  AssessmentParams params_;
  SheetLine line_;
  Eigen::AlignedBox2d place_;  ///< Of the first sheet: nothing is measured elsewhere.
  std::vector<Spared> spared_;
  std::vector<std::uint8_t> done_;  ///< Whether each piece of length kBin of the line was traced.
  std::optional<Eigen::Vector2d> last_;
  LinePlace last_place_;
  double last_s_ = -1;
  double dry_s_ = 0;  ///< Present uninterrupted time in the air with the pedal down.
  double pedal_without_contact_s_ = 0;
  double traced_m_ = 0, deviation_m2_ = 0, deviation_max_m_ = 0;
};

}  // namespace fulcrum::assessment
