// Sessions with known results, for unit test and benchmark of the assessment.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "services/session/assessment/assessor.h"

namespace fulcrum::test {

/// A grasper and a hook, a straight planned line of 40 mm along t, a ureter 12 mm beside it. No geometry.
struct AssessedScene {
  AssessedScene();
  std::vector<Vec2f> line;
  std::vector<ProtectedStructure> structures;
  std::vector<ProtectedPoint> points;
  std::vector<Triangle> surface{{0, 1, 2}};  ///< Of the organ.
  SceneView view;
};

/// Messages at a session time, with increasing sequence numbers; the session begins at kStart_ns.
inline constexpr std::int64_t kStart_ns = 7'000'000'000;
[[nodiscard]] Stamp StampAt(double time_s);
[[nodiscard]] ToolState ToolAt(double time_s, const Vec3d& tip0, const Vec3d& tip1);
/// Tool 0 holds tissue at `tip` with a traction [N]; its jaws slip above `slip_N`.
[[nodiscard]] ContactModel GraspAt(double time_s, const Vec3d& tip, double force_N, double slip_N);
/// Tool 1 presses with a force [N].
[[nodiscard]] ContactModel PushAt(double time_s, double force_N);
[[nodiscard]] CauteryContact TipAt(double time_s, const Vec2f& material, bool touching);
/// Pressed pedal of a mode; no pedal for kOff.
[[nodiscard]] HandleState PedalAt(double time_s, CauteryMode mode);
/// Adds a sample of the tip, and the pedal at its time.
void AddTip(double time_s, const Vec2f& material, bool touching, CauteryMode mode, assessment::Assessor* assessor);
/// Patch of 256 x 256 texels at (x, y), with `damage` evaluated at each texel's centre in metres of the sheet.
[[nodiscard]] TemperaturePatch PatchAt(double time_s, std::uint32_t x, std::uint32_t y,
                                       const std::function<bool(const Eigen::Vector2d&)>& damaged);

/// Normalised position of a minimum-jerk reach, 0 … 1, at a fraction of its duration (Flash and Hogan 1985).
[[nodiscard]] double MinimumJerk(double fraction);

struct KnownAnswer {
  std::string name;  ///< Measure and case, such as "path_length.circle".
  double measured, known;
  [[nodiscard]] double error_pct() const;
};

/// Cases with known results; every measure at least once.
[[nodiscard]] std::vector<KnownAnswer> KnownAnswers();

}  // namespace fulcrum::test
