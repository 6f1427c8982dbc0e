// Tissue that was coagulated where it should have been spared.
#pragma once

#include <vector>

#include "services/base/core/messages.h"
#include "services/session/assessment/line_meter.h"

namespace fulcrum::assessment {

/// Fed with each TemperaturePatch: remembers which texels of the atlas have been damaged, since patches overlap and
/// come again, and counts those that lie farther from the line than the margin.
class DamageMap {
 public:
  /// `line` must live as long as this.
  DamageMap(const SheetLine& line, double margin_m, double texel_m);

  void Add(const TemperaturePatch& patch);
  [[nodiscard]] double beyond_margin_m2() const;

 private:
  const SheetLine& line_;
  double margin_m_, texel_m_;
  std::vector<std::uint8_t> damaged_;  ///< Bit per texel of the atlas; empty until the first patch.
  std::uint64_t beyond_ = 0;
};

}  // namespace fulcrum::assessment
