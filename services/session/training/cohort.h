// How others did an exercise, without their names: the spread of their first, second, … attempts.
#pragma once

#include <span>
#include <vector>

namespace fulcrum::training {

/// With fewer people the figures would tell what one of them scored.
inline constexpr int kLeastCohort = 3;

/// Scores of the k-th attempts of several people.
struct Spread {
  int people = 0;
  double low = 0, median = 0, high = 0;  ///< Lower quartile, median, upper quartile [%].
};

/// Of `scores`, one list per person in the order of the attempts [%]: the spread of the first attempts, the second, and
/// so on, while at least kLeastCohort people have one.
[[nodiscard]] std::vector<Spread> CohortOf(std::span<const std::vector<double>> scores);

/// Quantile by linear interpolation between the sorted values (type 7 of Hyndman and Fan, Am. Stat. 50:361, 1996).
/// @pre `sorted` ascending and not empty, 0 <= share <= 1.
[[nodiscard]] double Quantile(std::span<const double> sorted, double share);

}  // namespace fulcrum::training
