// Shapes with an analytic deformation, as ElasticModels on regular meshes, solved by the reference solver: they show
// the error of the discretisation alone. Loads are small, so that linear elasticity holds.
#pragma once

namespace fulcrum::physics {

/// Errors are relative; where they are signed, negative is too stiff. `n` is the number of elements across; each halves
/// the size of the elements in all directions.

struct BarErrors {
  double stretch = 0;      ///< RMS along the bar over all nodes, over the RMS displacement.
  double contraction = 0;  ///< The same across.
};
/// A prismatic bar under its own weight, hung by a uniform stress: Timoshenko and Goodier, Theory of Elasticity (3rd
/// ed.), article 94, eq. (f): w = q/2E (z^2 - l^2 + nu (x^2 + y^2)), u = -nu q x z / E, with the weight q per volume.
[[nodiscard]] BarErrors HangingBar(int n, double poisson);

/// A membrane of springs hung by its upper edge under its own weight: the drop at distance s is m g (s l - s^2 / 2) /
/// (E t). RMS error over the sheet, also between the nodes, over the RMS drop.
[[nodiscard]] double HangingSheet(int n);

/// A thick-walled tube under inner pressure p in plane strain (Lame 1852; Timoshenko and Goodier, article 28):
/// u_r = (1 + nu) / E p a^2 / (b^2 - a^2) ((1 - 2 nu) r + b^2 / r). The organ's wall: 15 to 18 mm, n layers with
/// 24 n segments. Error of the bore's widening.
[[nodiscard]] double LameTube(int n, double poisson);

/// A square cantilever eight times as long as thick, clamped, with a load at its end: deflection by Timoshenko's beam,
/// P l^3 / 3 E I + P l / (k G A), k = 10 (1 + nu) / (12 + 11 nu) (Cowper 1966). The full clamp makes the solid about
/// 1.5 % stiffer than the beam.
[[nodiscard]] double Cantilever(int n, double poisson);

/// The same bar bent by a moment, for which the beam's answer is exact (Timoshenko and Goodier, article 102): error of
/// the deflection M l^2 / 2 E I.
[[nodiscard]] double PureBending(int n, double poisson);

}  // namespace fulcrum::physics
