#include "handle_bridge/estimator/jaw_calibrator.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace fulcrum::handle_bridge {
namespace {

constexpr double kStep = 0.02;  ///< Grid spacing of the position of a hold [counts].
constexpr double kReach = 1.0;  ///< The grid extends this far beyond the received codes [counts].
/// Smallest standard deviation [counts]: below it a hold has a single code in any position.
constexpr double kMinSigma = 0.05;
constexpr double kMaxSigma = 1.0;     ///< Largest standard deviation [counts]; above JawCalibrator::kMaxSpread.
constexpr double kSigmaFactor = 1.1;  ///< Ratio of consecutive standard deviations of the grid.
/// Share of outliers among the readings, uniformly distributed; keeps the likelihood above 0.
constexpr double kGlitchShare = 1e-5;
constexpr double kExtremeCodes = 1022;  ///< Codes 0 and 1023 mean a converter at its limit, not an angle.

std::string Text(const char* format, double a, double b) {
  char text[160];
  std::snprintf(text, sizeof(text), format, a, b);
  return text;
}

double NormalCdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

/// Posterior of one hold's position for a given standard deviation: its mean, and the logarithm of its mass.
struct Posterior {
  double mean = 0;
  double log_mass = 0;
};

Posterior PlaceOf(int first_code, const std::vector<int>& counts, double sigma) {
  const double low = first_code - 0.5 - kReach;
  const auto places =
      static_cast<std::size_t>(std::lround((static_cast<double>(counts.size()) + 2 * kReach) / kStep)) + 1;
  std::vector<double> log_likelihood(places);
  for (std::size_t i = 0; i < places; ++i) {
    const double place = low + kStep * static_cast<double>(i);
    for (std::size_t k = 0; k < counts.size(); ++k) {
      const double edge = first_code + static_cast<double>(k) - 0.5 - place;
      const double share = NormalCdf((edge + 1) / sigma) - NormalCdf(edge / sigma);
      log_likelihood[i] += counts[k] * std::log(share + kGlitchShare);
    }
  }
  const double best = *std::max_element(log_likelihood.begin(), log_likelihood.end());
  double mass = 0, moment = 0;
  for (std::size_t i = 0; i < places; ++i) {
    const double weight = std::exp(log_likelihood[i] - best);
    mass += weight;
    moment += weight * (low + kStep * static_cast<double>(i));
  }
  return {moment / mass, best + std::log(mass)};
}

}  // namespace

std::string JawCalibrator::Add(double angle_deg, std::span<const int> codes) {
  if (codes.size() < kMinCodes) {
    return Text("only %.0f readings came; %.0f are needed: check the link", static_cast<double>(codes.size()),
                static_cast<double>(kMinCodes));
  }
  Hold hold;
  hold.angle_deg = angle_deg;
  const auto [least, most] = std::minmax_element(codes.begin(), codes.end());
  if (*least < 1 || *most > kExtremeCodes) {
    return Text("the converter is at its stop (codes %.0f to %.0f): check the potentiometer's wires", *least, *most);
  }
  double sum = 0, squares = 0;
  for (const int code : codes) {
    sum += code - *least;
    squares += static_cast<double>(code - *least) * (code - *least);
  }
  const auto n = static_cast<double>(codes.size());
  hold.mean_code = *least + sum / n;
  const double spread = std::sqrt(std::max(squares / n - sum / n * (sum / n), 0.0));
  if (spread > kMaxSpread) {
    return Text("too noisy: the codes spread by %.2f counts (at most %.2f): hold the jaw still", spread, kMaxSpread);
  }
  for (const Hold& other : holds_) {
    if (other.angle_deg == angle_deg) {
      return Text("%.1f deg is another point's angle, with code %.1f: give another angle", angle_deg, other.mean_code);
    }
    if (std::abs(hold.mean_code - other.mean_code) < kMinGap) {
      return Text("too few counts apart: %.1f from another point (at least %.0f): check the angle",
                  std::abs(hold.mean_code - other.mean_code), kMinGap);
    }
  }
  if (holds_.size() >= 2) {
    // The angle must increase with the code for all pairs, or decrease for all.
    const auto rises = [](const Hold& a, const Hold& b) {
      return (a.angle_deg < b.angle_deg) == (a.mean_code < b.mean_code);
    };
    const bool rising = rises(holds_[0], holds_[1]);
    if (std::any_of(holds_.begin(), holds_.end(), [&](const Hold& other) { return rises(other, hold) != rising; })) {
      return Text("not monotone: at %.1f deg the code %.1f lies on the wrong side of another point's: check the angle",
                  angle_deg, hold.mean_code);
    }
  }
  hold.first_code = *least;
  hold.counts.resize(static_cast<std::size_t>(*most - *least) + 1);
  for (const int code : codes) {
    ++hold.counts[static_cast<std::size_t>(code - *least)];
  }
  const auto place =
      std::find_if(holds_.begin(), holds_.end(), [&](const Hold& other) { return other.mean_code > hold.mean_code; });
  holds_.insert(place, std::move(hold));
  return {};
}

CalibrationPoints JawCalibrator::Solve() const {
  std::vector<double> log_weight;
  std::vector<std::vector<double>> places;  // By spread and hold.
  for (double sigma = kMinSigma; sigma < kMaxSigma; sigma *= kSigmaFactor) {
    double log_mass = 0;
    std::vector<double> means;
    for (const Hold& hold : holds_) {
      const Posterior posterior = PlaceOf(hold.first_code, hold.counts, sigma);
      log_mass += posterior.log_mass;
      means.push_back(posterior.mean);
    }
    log_weight.push_back(log_mass);
    places.push_back(std::move(means));
  }
  const double best = *std::max_element(log_weight.begin(), log_weight.end());
  CalibrationPoints points;
  points.codes.assign(holds_.size(), 0.0);
  double total = 0;
  for (std::size_t s = 0; s < places.size(); ++s) {
    const double weight = std::exp(log_weight[s] - best);
    total += weight;
    for (std::size_t i = 0; i < holds_.size(); ++i) {
      points.codes[i] += weight * places[s][i];
    }
  }
  for (std::size_t i = 0; i < holds_.size(); ++i) {
    points.codes[i] /= total;
    points.angles_deg.push_back(holds_[i].angle_deg);
  }
  return points;
}

}  // namespace fulcrum::handle_bridge
