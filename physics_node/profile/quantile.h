// A quantile of step times.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace fulcrum::physics {

/// 0 of no values.
inline double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace fulcrum::physics
