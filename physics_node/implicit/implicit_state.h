// What the solver carries from step to step (SolverState), what it reuses within a substep (SolverScratch), and the
// views of both that kernels get. Memory is allocated at construction.
//
// Positions and previous positions are in the ParticleStore: they are what a checkpoint holds and the state hash
// covers. After a restart the velocities follow from them; edges, regions and levels from the topology and from
// movement.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "physics_node/implicit/coarse_space.h"
#include "physics_node/implicit/elements.h"
#include "physics_node/implicit/implicit_model.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/implicit/sheet_edges.h"
#include "physics_node/implicit/workers.h"

namespace fulcrum::physics::implicit {

/// Stiffness queries whose last answers are kept, as first guesses of the next ones: two of each tool.
inline constexpr std::size_t kQueryCount = 2 * kMaxTools;

/// What all stages work with. Of the particles, stages change positions and, during a stiffness query, inverse masses.
struct SolverContext {
  const Kernels& kernels;
  const ImplicitModel& model;
  ParticleStore& particles;
  Workers& workers;
};

/// The tissue at its linearisation point x*, and the derivatives there.
struct Linearisation {
  explicit Linearisation(const ImplicitModel& model);

  FloatArray point;                                   ///< x* [m]; where nothing is computed, the position.
  FloatArray residual;                                ///< r(x*) [N]; after a solve, where it is wanted, that of x* + d.
  std::array<FloatArray, 3> kt, along;                ///< Of the membrane's edges, as in SheetMatrix.
  std::array<std::array<FloatArray, 3>, 2> coupling;  ///< Of the membrane's triangles; empty without.
  std::array<FloatArray, 6> sheet_blocks;             ///< Inverse diagonal blocks, as in SheetMatrix.
  FloatArray organ_c, organ_f, organ_blocks;          ///< As in OrganMatrix.
  FloatArray element_diagonal;        ///< By FieldLayout::ScalarIndex, contacts and folds included [N/m].
  std::vector<std::size_t> raised;    ///< Entries of element_diagonal that differ from the model's.
  bool lacks_element_forces = false;  ///< Bindings and hinges are yet to be added to the residual.
};

/// Which diagonal blocks of the organ are renewed.
struct OrganBlockSchedule {
  float inertia = 0;                 ///< For which the blocks were made; 0: all are due.
  bool step_due = true;              ///< Those of the regions whose turn it is in this step are due.
  std::vector<std::uint8_t> urgent;  ///< By region: renewed in this substep and, from 2 on, in the next one.
};

/// Regions around stiff contacts.
struct ContactZone {
  explicit ContactZone(const ImplicitModel& model, const Elements& elements);

  bool active = false;                ///< This substep has stiff contacts.
  bool outdated = true;               ///< Computed regions or elements have changed since the sets were found.
  std::vector<std::uint8_t> pressed;  ///< By region, in this substep.
  RegionSet inner, outer;             ///< Pressed regions, and with their neighbours.
  Selection elements;                 ///< That act in `outer` when `inner` moves.
  FloatArray direction;               ///< A field: direction of the descent, 0 outside of `inner` [m].
};

/// By region: particles are held; touched by contacts at rest (1) or moving ones (2).
struct TouchedRegions {
  explicit TouchedRegions(const ImplicitModel& model);
  std::vector<std::uint8_t> held, touched;
};

/// By block of the ParticleStore: at least how far any particle has moved [m].
struct Movement {
  explicit Movement(const ParticleStore& particles);
  std::vector<float> of_step;       ///< In the step that the last BeginStep ended.
  std::vector<float> before_sleep;  ///< In the present step, of regions that have fallen asleep in it.
};

struct SolverState {
  SolverState(const TissueScene& scene, const ElasticModel& elastic, const TissueModel& tissue,
              const SolverContext& context);

  FloatArray velocity;  ///< A field [m/s]; 0 where nothing is computed.
  SheetEdges edges;
  Elements elements;
  Regions regions;
  CoarseSpace coarse;
  Linearisation linearisation;
  OrganBlockSchedule organ_blocks;
  ContactZone contact_zone;
  TouchedRegions touched;  ///< In the last substep.
  Movement movement;
  std::array<FloatArray, kQueryCount> query_displacement;  ///< Fields: last answers to stiffness queries [m].
  float largest_correction_m = 0;                          ///< In the last substep [m].
  std::uint32_t steps = 0;
  bool coarse_due = false;  ///< The next part of the coarse matrix is due in this step.
};

/// Vectors of conjugate gradients, fields. 0 where nothing is computed.
struct KrylovVectors {
  explicit KrylovVectors(const FieldLayout& layout);
  FloatArray z;  ///< Preconditioned residual [m].
  FloatArray p;  ///< Direction [m].
  FloatArray q;  ///< A p [N]; in a line search, a trial point [m].
  FloatArray d;  ///< Correction [m].
};

/// A particle before a stiffness query holds it.
struct QueriedParticle {
  float inverse_mass = 0;                    ///< [1/kg]
  std::array<float, kMatrixFloats> block{};  ///< Of the preconditioner [m/N].
};

struct SolverScratch {
  explicit SolverScratch(const SolverContext& context, std::size_t hat_row_floats);

  KrylovVectors krylov;
  FloatArray kept_residual;                ///< The residual of the substep, during a stiffness query [N].
  FloatArray organ_stress;                 ///< As in OrganMatrix.
  FloatArray row_sums;                     ///< Residual of the membrane's rows for the hats [N].
  std::vector<FloatArray> carry;           ///< By worker: carry rows.
  std::vector<double> partial_sums;        ///< By task.
  std::vector<PredictionCount> predicted;  ///< By task.
  std::vector<FinishCount> finished;       ///< By task.
  std::vector<float> speed;                ///< By region: largest of a particle [m/s].
  std::vector<float> correction_sq;        ///< By region: largest |d|^2 [m^2].
  TouchedRegions touched;                  ///< In this substep.
  std::vector<std::uint8_t> wanted;        ///< By region: the residual after the solve is wanted.
  RegionSet residual_regions;              ///< Where a solve leaves the residual of x* + d.
  std::vector<QueriedParticle> queried;
};

/// The equation of a substep, A d = r with A = K + inertia M, as the kernels read it.
struct LinearSystem {
  LinearSystem(const SolverContext& context, float inertia, SolverState* state, SolverScratch* scratch);

  Sheet sheet;
  SheetMatrix sheet_matrix;
  Organ organ;
  OrganMatrix organ_matrix;
  HatLevel hats;
  float inertia;  ///< (1 + damping h) / h^2 [1/s^2]; 0: statics.
};

/// Fields of the state at `point`; `residual` may be null where a kernel does not write it.
[[nodiscard]] SheetFields SheetFieldsAt(const SolverContext& context, const SolverState& state, const FloatArray& point,
                                        FloatArray* residual);
[[nodiscard]] OrganFields OrganFieldsAt(const SolverContext& context, const SolverState& state, const FloatArray& point,
                                        FloatArray* residual);

}  // namespace fulcrum::physics::implicit
