// Quantiles of a latency as metrics of Health.
#pragma once

#include <string>
#include <utility>

#include "services/base/core/messages.h"
#include "services/base/runtime/histogram.h"

namespace fulcrum::runtime {

/// Adds NAME_p50_ms, NAME_p95_ms and NAME_p99_ms; nothing while there is no value.
inline void AddQuantiles(const std::string& name, const HistogramSnapshot& values, Health* health) {
  if (values.count == 0) return;
  for (const auto& [label, share] : {std::pair{"_p50_ms", 0.5}, {"_p95_ms", 0.95}, {"_p99_ms", 0.99}}) {
    health->metrics.push_back({name + label, 1e-6 * static_cast<double>(values.Quantile(share))});
  }
}

}  // namespace fulcrum::runtime
