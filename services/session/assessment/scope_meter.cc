#include "services/session/assessment/scope_meter.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/sheets.h"
#include "services/session/assessment/gap.h"

namespace fulcrum::assessment {
namespace {

/// Time between two samples that are evaluated [s]: a picture is shown 30 times a second.
constexpr double kPeriod_s = 0.02;
/// Distance of a node of the membrane from the line of sight below which it counts for the place where the two meet
/// [m]: about three times that between nodes.
constexpr float kMeets_m = 0.005f;

/// By node of the grid: 1 where it belongs to the first sheet, on which the planned line is.
std::vector<std::uint8_t> NodesOfFirstSheet(const SheetScene& scene) {
  std::vector<std::uint8_t> of(scene.membrane.node_count(), 0);
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  if (sheets.empty()) return of;
  for (std::uint32_t row = sheets[0].first_row; row < sheets[0].first_row + sheets[0].rows; ++row) {
    const std::size_t first = std::size_t{row} * scene.membrane.cols;
    std::fill_n(of.begin() + static_cast<std::ptrdiff_t>(first), sheets[0].cols, std::uint8_t{1});
  }
  return of;
}

}  // namespace

ScopeMeter::ScopeMeter(const SceneView& scene)
    : scene_(scene),
      of_line_(NodesOfFirstSheet(scene)),
      scope_(FindTool(scene.tools, ToolKind::kScope)),
      acting_(FindTool(scene.tools, ToolKind::kHook)),
      line_(scene),
      lens_(scene) {
  for (std::size_t i = 0; i < kMaxTools && !acting_; ++i) {
    if (TouchesTissue(scene.tools[i].kind)) acting_ = i;
  }
}

std::optional<double> ScopeMeter::MeanOf(const Sum& sum) {
  if (!(sum.time_s > 0)) return std::nullopt;
  return sum.value / sum.time_s;
}

bool ScopeMeter::Add(double time_s, const ToolState& state) {
  if (!scope_ || state.tools[*scope_].kind != ToolKind::kScope || time_s - last_s_ < kPeriod_s) return false;
  const double dt_s = last_s_ >= 0 && time_s - last_s_ <= kGap_s ? time_s - last_s_ : 0;
  last_s_ = time_s;
  const ToolSample& scope = state.tools[*scope_];
  const Sight sight = SightOf(scope.q_WT, scene_.render.scope_angle_deg);
  horizon_.value += dt_s * static_cast<double>(std::abs(RollOf(sight, LevelUp(scene_.render))));
  horizon_.time_s += dt_s;
  lens_.Step(time_s, state, false);
  if (lens_.soil() > 0) smeared_s_ += dt_s;
  if (acting_ && state.tools[*acting_].kind != ToolKind::kNone) {
    const Vec3f way = state.tools[*acting_].p_WT - scope.p_WT;
    const float off = std::acos(std::clamp(way.normalized().dot(sight.forward), -1.0f, 1.0f));
    off_centre_.value += dt_s * static_cast<double>(off);
    off_centre_.time_s += dt_s;
  }
  if (scene_.assessment.tracing != LineTracing::kView) return false;
  return line_.Add(MiddleOf(time_s, scope.p_WT, sight.forward)).off_line;
}

HookSample ScopeMeter::MiddleOf(double time_s, const Vec3f& eye, const Vec3f& forward) const {
  HookSample middle;
  middle.time_s = time_s;
  float weights = 0;
  Vec2f sum = Vec2f::Zero();
  const auto nodes = scene_.rest_position.subspan(scene_.membrane.first, scene_.membrane.node_count());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (of_line_[i] == 0) continue;
    const Vec3f way = nodes[i] - eye;
    const float off = (way - way.dot(forward) * forward).norm();
    if (off >= kMeets_m || way.dot(forward) <= 0) continue;
    const float weight = (1 - off / kMeets_m) * (1 - off / kMeets_m);
    weights += weight;
    sum += weight * scene_.membrane_material[i];
  }
  middle.touching = weights > 0;
  if (middle.touching) middle.material = sum / weights;
  return middle;
}

}  // namespace fulcrum::assessment
