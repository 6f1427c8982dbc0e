// The potential of a band that is spanned between two bodies, far from the electrode: a strip conductor.
//
//   div grad V = -2 pi delta(p - p0),   V = 0 at both ends (t = 0, L),   dV/ds = 0 at both sides (s = 0, w)
//
// p0 middle of the metal, w width along s, L length along t. By images in both directions,
//
//   V = V1(t) + sum over n, +-a of psi(s -+ a, t - b - 2 n L) - psi(s -+ a, t + b - 2 n L)
//   psi(x, y) = -1/2 ln(1 - 2 e^-k cos(pi x / w) + e^-2k),   k = pi |y| / w,   p0 = (a, b)
//   V1 = 2 pi / w t (L - b) / L up to t = b, 2 pi / w b (L - t) / L beyond
//
// V1 is the even current along the strip, psi what is left near the metal and dies out within a width of it. So the
// current leaves along the band only, in inverse proportion to the distances of its ends.
#pragma once

#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

class BandField {
 public:
  /// @param middle of the metal, in material coordinates [m]; moved into the band where it lies beside it.
  BandField(const Band& band, const Vec2f& middle);

  /// -(dV/dn) / V at a place [m], along a unit normal [1/m]; 0 where the current does not leave along it.
  [[nodiscard]] float SlopeAt(const Vec2f& place, const Vec2f& normal) const;
  /// Joule heat by volume, in any unit: the square of the gradient; 0 beside the band.
  [[nodiscard]] float DensityAt(const Vec2f& place) const;

 private:
  /// V, which is complete only `with_v`, and its gradient.
  struct Value {
    double v = 0, ds = 0, dt = 0;
  };
  [[nodiscard]] Value At(const Vec2f& place, bool with_v) const;

  Vec2f low_;
  double width_, length_, a_, b_;
  int images_;  ///< Of the ends, to either side.
};

}  // namespace fulcrum::thermal
