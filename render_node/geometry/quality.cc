#include "render_node/geometry/quality.h"

#include <algorithm>
#include <string>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::render {
namespace {

constexpr double kBudget_ms = 28;  // Of the 33 ms at 30 pictures a second, with a reserve for load peaks.
constexpr double kStepCost = 1.5;  // A step finer costs up to this factor more.
constexpr double kSmoothBudget_ms = 12, kSmoothStepCost = 2;  // The same for scales above 1.
constexpr int kCalmWindows = 6;                               // About two seconds, to prevent oscillation.
constexpr float kMostSmoothLines = 3060;                      // The textures of more would take half a gigabyte.
constexpr float kFewestLines = 270;
constexpr float kHalf = 0.52f;            // A coarser step is for large pictures only …
constexpr float kFewestLinesLarge = 374;  // … which have at least as many lines then.

}  // namespace

Quality QualityFromName(std::string_view name) {
  if (name == "auto") {
    return Quality::kAuto;
  }
  if (name == "low") {
    return Quality::kLow;
  }
  if (name == "high") {
    return Quality::kHigh;
  }
  throw InputError("--quality: \"" + std::string(name) + "\"; valid: auto, low, high");
}

QualityControl::QualityControl(Quality quality, int height, bool smooth)
    : quality_(quality), smooth_(smooth), first_(quality == Quality::kAuto) {
  SetHeight(height);
}

double QualityControl::BudgetOf(std::size_t step) const { return step < kFull ? kSmoothBudget_ms : kBudget_ms; }
double QualityControl::CostOfFiner(std::size_t step) const { return step <= kFull ? kSmoothStepCost : kStepCost; }

void QualityControl::SetHeight(int height) {
  const float lines = kScales[step_] * static_cast<float>(height_);
  const auto enough = [height](float scale) {
    return scale * static_cast<float>(height) >= (scale < kHalf ? kFewestLinesLarge : kFewestLines);
  };
  first_step_ = smooth_ ? 0 : kFull;
  while (first_step_ < kFull && kScales[first_step_] * static_cast<float>(height) > kMostSmoothLines) ++first_step_;
  last_step_ = kFull;
  while (last_step_ + 1 < kScales.size() && enough(kScales[last_step_ + 1])) ++last_step_;
  if (quality_ == Quality::kHigh) {
    step_ = first_step_;
  } else if (quality_ == Quality::kLow) {
    step_ = last_step_;
  } else if (quality_ == Quality::kAuto && height_ > 0) {
    step_ = kFull;
    while (step_ < last_step_ && kScales[step_] * static_cast<float>(height) > lines) ++step_;
    first_ = true;
    count_ = 0;
    calm_ = 0;
  }
  height_ = height;
}

void QualityControl::Add(double draw_ms) {
  if (quality_ != Quality::kAuto) {
    return;
  }
  if (std::exchange(first_, false)) {
    return;  // Not representative: it was drawn at another scale.
  }
  cost_ms_[count_++] = draw_ms;
  if (count_ < kWindow) {
    return;
  }
  count_ = 0;
  std::nth_element(cost_ms_.begin(), cost_ms_.begin() + kWindow / 2, cost_ms_.end());
  double median_ms = cost_ms_[kWindow / 2];
  const auto finer_fits = [&] { return step_ > first_step_ && median_ms * CostOfFiner(step_) < BudgetOf(step_ - 1); };
  calm_ = finer_fits() ? calm_ + 1 : 0;
  if (median_ms > BudgetOf(step_) && step_ < last_step_) {
    ++step_;
  } else if (calm_ >= kCalmWindows) {
    for (; finer_fits(); --step_) median_ms *= CostOfFiner(step_);
    calm_ = 0;
  }
}

}  // namespace fulcrum::render
