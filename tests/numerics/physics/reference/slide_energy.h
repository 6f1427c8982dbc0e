// The energy of solids that slide on each other (physics_node/energy/elastic_model.h): the nearest point of all of a
// surface, in double.
#pragma once

#include "tests/numerics/physics/reference/elastic_energy.h"

namespace fulcrum::physics::reference {

/// The nearest point of a surface to a vertex.
struct SlideFoot {
  std::array<Index, 4> v{};      ///< The vertex, and the corners of the nearest triangle.
  std::array<double, 4> c{};     ///< 1, and minus the barycentric coordinates of the nearest point.
  Vec3d normal = Vec3d::Zero();  ///< From the nearest point to the vertex, unit; reversed where that is inside.
  double gap_m = 0;              ///< Distance, negative inside [m].
};
[[nodiscard]] SlideFoot FootOf(const ElasticModel& model, const ElasticSlide& slide, const Points& x);

[[nodiscard]] double SlideEnergy(const ElasticModel& model, const Points& x);
/// gradient += dE/dx.
void AddSlideGradient(const ElasticModel& model, const Points& x, Points* gradient);

}  // namespace fulcrum::physics::reference
