#include "physics_node/contact_model/gap_box.h"

namespace fulcrum::physics {

bool GapBox::FindMiddle(float limit_m, Vec2f* middle) const {
  float sum = 0, least = limit_m;
  Vec2f mean = Vec2f::Zero(), nearest = Vec2f::Zero();
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const float nearer = limit_m - At(i, j);
      if (!(nearer > 0.0f)) continue;
      const Vec2f cell(static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f);
      sum += nearer * nearer;
      mean += nearer * nearer * cell;
      if (At(i, j) < least) {
        least = At(i, j);
        nearest = cell;
      }
    }
  }
  if (!(sum > 0.0f)) return false;
  mean /= sum;
  const bool tissue = At(static_cast<int>(mean.x()), static_cast<int>(mean.y())) < kFootprintReach;
  *middle = cell_m_ * (Vec2f(static_cast<float>(x_), static_cast<float>(y_)) + (tissue ? mean : nearest));
  return true;
}

void GapBox::Encode(Footprint* print) const {
  int left = kCells, right = -1, top = kCells, bottom = -1;
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      if (At(i, j) >= kFootprintReach) continue;
      left = std::min(left, i);
      right = std::max(right, i);
      top = std::min(top, j);
      bottom = j;
    }
  }
  if (right < 0) return;
  print->x = x_ + left;
  print->y = y_ + top;
  print->width = static_cast<std::uint32_t>(right - left + 1);
  for (int j = top; j <= bottom; ++j) {
    for (int i = left; i <= right; ++i) print->gap.push_back(Footprint::Encode(At(i, j)));
  }
}

}  // namespace fulcrum::physics
