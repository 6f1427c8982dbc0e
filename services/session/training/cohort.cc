#include "services/session/training/cohort.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::training {

double Quantile(std::span<const double> sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], at - static_cast<double>(below));
}

std::vector<Spread> CohortOf(std::span<const std::vector<double>> scores) {
  std::vector<Spread> spreads;
  for (std::size_t k = 0;; ++k) {
    std::vector<double> at;
    for (const std::vector<double>& one : scores) {
      if (k < one.size()) at.push_back(one[k]);
    }
    if (at.size() < kLeastCohort) return spreads;
    std::ranges::sort(at);
    spreads.push_back({static_cast<int>(at.size()), Quantile(at, 0.25), Quantile(at, 0.5), Quantile(at, 0.75)});
  }
}

}  // namespace fulcrum::training
