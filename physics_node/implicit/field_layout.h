// Where the particles stand in a field: any array of the particle pool's size and layout (tissue/particle_store.h),
//
//   [ organ: x y z _ per vertex, padding | membrane: plane x | plane y | plane z | plane w, unused ]
#pragma once

#include <array>

#include "physics_node/implicit/kernels.h"
#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

struct FieldLayout {
  explicit FieldLayout(const ParticleStore& particles)
      : tube_count(particles.tube_count()),
        rows(static_cast<int>(particles.layout().rows)),
        slots(static_cast<int>(particles.layout().slots)),
        tube_floats(particles.tube_floats()),
        stride(particles.layout().stride),
        plane(particles.layout().plane()),
        floats(particles.raw().size()) {}

  [[nodiscard]] bool InTube(ParticleRef at) const { return at.base < tube_floats; }
  /// Of a node of the membrane in a plane.
  [[nodiscard]] std::size_t InPlane(ParticleRef at) const { return at.base - tube_floats; }
  /// The membrane's planes x, y, z of a field.
  [[nodiscard]] std::array<float*, 3> Planes(FloatArray* field) const {
    float* const x = field->data() + tube_floats;
    return {x, x + plane, x + 2 * plane};
  }
  [[nodiscard]] std::array<const float*, 3> Planes(const FloatArray& field) const {
    const float* const x = field.data() + tube_floats;
    return {x, x + plane, x + 2 * plane};
  }
  /// In arrays of one float per particle: a plane of the membrane, then the organ's vertices.
  [[nodiscard]] std::size_t ScalarIndex(ParticleRef at) const {
    return InTube(at) ? plane + at.base / kVertexFloats : InPlane(at);
  }
  [[nodiscard]] std::size_t scalar_count() const { return plane + tube_count + 1; }

  std::uint32_t tube_count;   ///< Vertices of the organ.
  int rows, slots;            ///< Of the membrane; columns per lane.
  std::size_t tube_floats;    ///< Floats of the organ with its padding.
  std::size_t stride, plane;  ///< Floats of a row and of a plane of the membrane.
  std::size_t floats;         ///< Of a field.
};

}  // namespace fulcrum::physics::implicit
