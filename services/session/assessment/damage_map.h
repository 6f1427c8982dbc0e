// Area of coagulated tissue farther from the planned line than the margin.
#pragma once

#include <vector>

#include "services/base/core/messages.h"
#include "services/session/assessment/line_meter.h"

namespace fulcrum::assessment {

/// Takes each TemperaturePatch. It stores which texels of the atlas are damaged, because patches overlap and repeat,
/// and counts those that lie farther from the line than the margin.
class DamageMap {
 public:
  /// `line` must outlive this.
  /// @param place of the sheet of the line, PlaceOfFirstSheet(): damage elsewhere in the atlas does not count.
  DamageMap(const SheetLine& line, double margin_m, double texel_m, const Eigen::AlignedBox2d& place = WholeAtlas());

  void Add(const TemperaturePatch& patch);
  [[nodiscard]] double beyond_margin_m2() const;

 private:
  const SheetLine& line_;
  double margin_m_, texel_m_;
  Eigen::AlignedBox2d place_;
  std::vector<std::uint8_t> damaged_;  ///< One bit per texel of the atlas; empty until the first patch.
  std::uint64_t beyond_ = 0;
};

}  // namespace fulcrum::assessment
