#include "services/session/assessment/line_meter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/base/core/messages.h"
#include "services/session/assessment/gap.h"

namespace fulcrum::assessment {
namespace {

constexpr double kBin_m = 1e-4;
/// Longest step of the place of contact between two messages while the hook stays on the membrane [m].
constexpr double kJump_m = 0.005;
/// Longest distance along the trace between two evaluations of the deviation [m].
constexpr double kTraceStep_m = 2e-4;
/// Delay of the prompt "pedal without contact" [s], so that a short lift of the hook causes none.
constexpr double kDryPrompt_s = 0.3;

}  // namespace

SheetLine::SheetLine(std::span<const Vec2f> points) {
  for (const Vec2f& p : points) {
    const Eigen::Vector2d at = p.cast<double>();
    along_.push_back(points_.empty() ? 0 : along_.back() + (at - points_.back()).norm());
    points_.push_back(at);
  }
}

LinePlace SheetLine::Nearest(const Eigen::Vector2d& p) const {
  LinePlace best{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    const Eigen::Vector2d piece = points_[i + 1] - points_[i];
    const double square = piece.squaredNorm();
    const double u = square > 0 ? std::clamp((p - points_[i]).dot(piece) / square, 0.0, 1.0) : 0;
    const double distance = (points_[i] + u * piece - p).norm();
    if (distance < best.distance_m) best = {distance, along_[i] + u * (along_[i + 1] - along_[i])};
  }
  return best;
}

Eigen::AlignedBox2d PlaceOfFirstSheet(const SheetScene& scene) {
  if (scene.sheets.size() < 2) return WholeAtlas();
  const SheetPart& sheet = scene.sheets.front();
  const double patch_m = kPatchTexels * static_cast<double>(scene.membrane.texel_m);
  Eigen::AlignedBox2d place;
  for (std::uint32_t row = sheet.first_row; row < sheet.first_row + sheet.rows; ++row) {
    for (std::uint32_t col = 0; col < sheet.cols; ++col) {
      const Vec2f& at = scene.membrane_material[std::size_t{row} * scene.membrane.cols + col];
      place.extend((at.cast<double>() / patch_m).array().floor().matrix());
    }
  }
  return {patch_m * place.min(), patch_m * (place.max() + Eigen::Vector2d::Ones())};
}

LineMeter::LineMeter(const SceneView& scene)
    : params_(scene.assessment), line_(scene.planned_line), place_(PlaceOfFirstSheet(scene)) {
  for (const ProtectedStructure& structure : scene.protected_structures) {
    std::vector<Vec2f> course;
    for (const ProtectedPoint& point : scene.protected_points.subspan(structure.first_point, structure.point_count)) {
      course.push_back(point.material);
    }
    spared_.push_back({structure.kind, static_cast<double>(structure.radius_m + params_.near_m), SheetLine(course)});
  }
  done_.resize(static_cast<std::size_t>(std::ceil(line_.length_m() / kBin_m)), 0);
}

LineMeter::Finding LineMeter::Add(const HookSample& contact) {
  Finding finding;
  const double time_s = contact.time_s;
  if (time_s <= last_s_) return finding;
  const bool continues = time_s - last_s_ <= kGap_s;
  const double dt_s = continues ? time_s - last_s_ : 0;
  last_s_ = time_s;
  const bool energised = contact.energised;
  if (energised && !contact.touching && !contact.on_solid) {
    pedal_without_contact_s_ += dt_s;
    dry_s_ += dt_s;
    finding.pedal_without_contact = dry_s_ > kDryPrompt_s;
  } else {
    dry_s_ = 0;
  }
  const Eigen::Vector2d at = contact.material.cast<double>();
  if (!contact.touching || !place_.contains(at)) {
    last_.reset();
    return finding;
  }
  if (energised) {
    for (const Spared& spared : spared_) {
      const bool near = spared.line.Nearest(at).distance_m < spared.reach_m;
      (spared.kind == ProtectedKind::kUreter ? finding.ureter_near : finding.nerve_near) |= near;
    }
  }
  if (!line_.empty() && (energised || params_.tracing != LineTracing::kCut)) {
    finding.off_line = Trace(at, continues);
  } else {
    last_.reset();
  }
  return finding;
}

bool LineMeter::Trace(const Eigen::Vector2d& at, bool continues) {
  const LinePlace place = line_.Nearest(at);
  const double step_m = last_ && continues ? (at - *last_).norm() : 0;
  const bool follows = last_ && continues && step_m <= kJump_m;
  if (follows && step_m > 0) {
    const int parts = std::max(1, static_cast<int>(std::ceil(step_m / kTraceStep_m)));
    double before_m = last_place_.distance_m;
    for (int k = 1; k <= parts; ++k) {
      const double distance_m =
          k == parts ? place.distance_m : line_.Nearest(*last_ + (at - *last_) * k / parts).distance_m;
      deviation_m2_ += 0.5 * (before_m + distance_m) * step_m / parts;
      before_m = distance_m;
    }
    traced_m_ += step_m;
    const auto reach = static_cast<double>(params_.line_reach_m);
    if (place.distance_m <= reach && last_place_.distance_m <= reach) {
      const auto [low, high] = std::minmax(place.along_m, last_place_.along_m);
      const auto first = static_cast<std::size_t>(low / kBin_m);
      const auto end = std::min(done_.size(), static_cast<std::size_t>(std::ceil(high / kBin_m)));
      for (std::size_t bin = first; bin < end; ++bin) done_[bin] = 1;
    }
  }
  deviation_max_m_ = std::max(deviation_max_m_, place.distance_m);
  last_ = at;
  last_place_ = place;
  return 1e3 * place.distance_m > static_cast<double>(params_.limit[static_cast<std::size_t>(Measure::kDeviationMax)]);
}

std::optional<double> LineMeter::deviation_mean_m() const {
  if (!(traced_m_ > 0)) return std::nullopt;
  return deviation_m2_ / traced_m_;
}

std::optional<double> LineMeter::deviation_max_m() const {
  if (!(traced_m_ > 0)) return std::nullopt;
  return deviation_max_m_;
}

double LineMeter::done() const {
  if (done_.empty()) return 0;
  return static_cast<double>(std::count(done_.begin(), done_.end(), 1)) / static_cast<double>(done_.size());
}

}  // namespace fulcrum::assessment
