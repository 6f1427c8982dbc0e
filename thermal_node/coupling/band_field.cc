#include "thermal_node/coupling/band_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fulcrum::thermal {
namespace {

constexpr double kPi = std::numbers::pi;
/// Images of the ends up to this many lengths away: enough for e^-k below 0.01 in a band three times as wide as long.
constexpr int kMostImages = 3;
/// Images with a greater k are left out: e^-k is below 1e-4 there.
constexpr double kFarImage = 9.2;
/// The metal is at least this share of the length from an end, so that V is not 0 everywhere.
constexpr double kLeastShare = 0.01;
/// Of 1 - 2 e^-k cos + e^-2k, which is 0 at the metal's middle.
constexpr double kLeastInside = 1e-12;

}  // namespace

BandField::BandField(const Band& band, const Vec2f& middle)
    : low_(band.low),
      width_(static_cast<double>(band.size.x())),
      length_(static_cast<double>(band.size.y())),
      a_(std::clamp(static_cast<double>(middle.x() - band.low.x()), 0.0, width_)),
      b_(std::clamp(static_cast<double>(middle.y() - band.low.y()), kLeastShare * length_,
                    (1 - kLeastShare) * length_)),
      images_(std::clamp(static_cast<int>(std::ceil(width_ / length_)), 1, kMostImages)) {}

BandField::Value BandField::At(const Vec2f& place, bool with_v) const {
  const double s = std::clamp(static_cast<double>(place.x() - low_.x()), 0.0, width_);
  const double t = std::clamp(static_cast<double>(place.y() - low_.y()), 0.0, length_);
  const double per_width = kPi / width_;
  const double slope = 2 * per_width / length_;
  Value at = t < b_ ? Value{slope * t * (length_ - b_), 0, slope * (length_ - b_)}
                    : Value{slope * b_ * (length_ - t), 0, -slope * b_};
  const double cosines[] = {std::cos(per_width * (s - a_)), std::cos(per_width * (s + a_))};
  const double sines[] = {std::sin(per_width * (s - a_)), std::sin(per_width * (s + a_))};
  double product = 1;  // of what is under the logarithms, of negative images inverted
  for (int n = -images_; n <= images_; ++n) {
    for (const double sign : {1.0, -1.0}) {
      const double y = t - sign * b_ - 2 * n * length_, k = per_width * std::abs(y);
      if (k > kFarImage) continue;
      const double e = std::exp(-k), of_ds = sign * per_width * e, of_dt = y < 0 ? -of_ds : of_ds;
      for (int a = 0; a < 2; ++a) {
        const double inside = std::max(1 - 2 * e * cosines[a] + e * e, kLeastInside), inverse = 1 / inside;
        product *= sign > 0 ? inside : inverse;
        at.ds -= of_ds * sines[a] * inverse;
        at.dt -= of_dt * (cosines[a] - e) * inverse;
      }
    }
  }
  if (with_v) at.v -= 0.5 * std::log(product);
  return at;
}

float BandField::SlopeAt(const Vec2f& place, const Vec2f& normal) const {
  const Value at = At(place, true);
  const double out = -(at.ds * static_cast<double>(normal.x()) + at.dt * static_cast<double>(normal.y()));
  // Near an end V falls to 0; there the end itself takes the current.
  return at.v > 0 && out > 0 ? static_cast<float>(out / at.v) : 0.0f;
}

float BandField::DensityAt(const Vec2f& place) const {
  const Vec2f from = place - low_;
  if (from.x() < 0.0f || from.y() < 0.0f || static_cast<double>(from.x()) > width_ ||
      static_cast<double>(from.y()) > length_) {
    return 0;
  }
  const Value at = At(place, false);
  return static_cast<float>(at.ds * at.ds + at.dt * at.dt);
}

}  // namespace fulcrum::thermal
