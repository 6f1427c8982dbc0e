// What the solver needs of a scene, packed for the kernels: built once from ElasticModel, constant afterwards.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/field_layout.h"
#include "physics_node/implicit/kernels.h"
#include "physics_node/implicit/regions.h"

namespace fulcrum::physics::implicit {

/// The whole membrane; arrays are planes of it. What cuts and heat leave of its edges: SheetEdges.
struct SheetModel {
  SheetModel(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles);

  std::array<FloatArray, 3> axial;         ///< By direction: tension per strain [N]; 0 where the grid has no edge.
  bool continuum;                          ///< Cells have triangles.
  std::vector<float> Et;                   ///< Modulus times thickness, by row [N/m].
  std::array<FloatArray, 3> inverse_rest;  ///< By direction: 1 / L [1/m].
  FloatArray mass;                         ///< [kg]
  float stiffening;                        ///< c of tension = axial (e + c e^3).
  float triangle_stiffening;               ///< b of the triangles.
  float rest_scale;                        ///< Length without tension over length in the rest shape.
};

/// The organ's patches as compressed rows, once by patch and once by vertex; fields as in Organ.
struct OrganModel {
  OrganModel(const ElasticModel& model, std::uint32_t vertices);
  [[nodiscard]] Organ View() const;

  std::vector<std::uint32_t> start, vertex, patch_start, patch;
  FloatArray gradient, patch_gradient, volume, shear, mass;
  float mu, lambda;  ///< [Pa]
};

struct ImplicitModel {
  ImplicitModel(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles);
  /// Constants of a substep of h seconds.
  [[nodiscard]] Inertia InertiaOf(float h) const;

  FieldLayout layout;
  GridLayout grid;
  Partition partition;
  SheetModel sheet;
  OrganModel organ;
  FloatArray load;              ///< A field [N].
  FloatArray element_diagonal;  ///< By FieldLayout::ScalarIndex: of bindings and hinges [N/m].
  float damping_per_s;
  Vec3f gravity;  ///< [m/s^2]
};

}  // namespace fulcrum::physics::implicit
