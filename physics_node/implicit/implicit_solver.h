// Linearised implicit small steps with a preconditioner of several levels (TLI). Each substep is one backward Euler
// step of ElasticModel, linearised once and solved by a few iterations of conjugate gradients. The preconditioner is
// the sum of three levels: 3 x 3 blocks of the diagonal, a middle level over the membrane, and a few dozen coarse
// nodes (coarse_space.h), which carry what a sweep over neighbours cannot. See DESIGN.md.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/coarse_space.h"
#include "physics_node/implicit/elements.h"
#include "physics_node/implicit/kernels.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/implicit/workers.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics::implicit {

/// A particle that a tool or a test holds; its inverse mass in the store is 0.
struct HeldPlace {
  ParticleRef at;
  Vec3f place = Vec3f::Zero();  ///< At the end of the substep [m].
};

struct SubstepReport {
  float largest_correction_m = 0;  ///< What the solve added to the inertial guess.
  float largest_speed_m_s = 0;
  std::uint32_t resets = 0;  ///< Particles put back because they were not finite.
  bool searched = false;     ///< The energy was looked at.
};

/// With what force the tissue resists when some particles are moved together by a little, beside what is going on.
struct Question {
  std::span<const ParticleRef> at;
  Vec3f direction = Vec3f::UnitZ();  ///< Unit.
  float horizon_s = 0;               ///< After so long; 0: when all is at rest again.
  /// Below kMemories: the last answer of the same memory is where the search for this one begins.
  std::size_t memory = 0;
};

/// Substeps and iterations of a preset.
struct Effort {
  int substeps = 2;
  int iterations = 2;
};
[[nodiscard]] Effort EffortOf(PhysicsPreset preset);

class ImplicitSolver {
 public:
  /// `threads` with the caller's; results do not depend on it.
  ImplicitSolver(const SceneView& scene, const ElasticModel& model, const TissueModel& tissue, ParticleStore* particles,
                 int threads = 1, const Kernels& kernels = KernelsFor());

  /// After each TissueModel::Apply that changed something: takes over what cutting and shrinking have done, and wakes
  /// it. Costs what the edit costs; nothing is factored again.
  void Follow(const TissueModel& tissue);

  /// Once a step, before its substeps: remembers the places. A place damaged since the last step (not finite, far off)
  /// comes from the last step; returns how many coordinates.
  std::uint32_t BeginStep();
  /// At least how far any particle of each block of the ParticleStore has moved in the step that the last BeginStep
  /// ended [m]; 0 where all slept.
  [[nodiscard]] std::span<const float> moved() const { return moved_; }
  SubstepReport Substep(float h, int iterations, std::span<const HeldPlace> held, std::span<ContactRow> contacts);

  /// What the tissue pulls with at a particle that the last substep held [N]. Of others it is not known.
  [[nodiscard]] Vec3f ForceOn(ParticleRef at) const;
  [[nodiscard]] Vec3f Velocity(ParticleRef at) const;
  void Stop();
  /// Velocities from two states a step apart, for a restart. Wakes.
  void SetVelocity(ParticleRef at, const Vec3f& v);

  static constexpr std::size_t kMemories = 4;
  /// Force over displacement [N/m], from the last substep's linearisation, without contacts. Costs two iterations and a
  /// product, so the first answer to a new question at rest is too large; it improves when the question is repeated.
  /// False: all is asleep, or no sound answer. The state stays as it is.
  bool Stiffness(const Question& question, float* newton_per_m);

  /// Its threads, between substeps. Nothing that is computed depends on them.
  [[nodiscard]] Workers& workers() const { return workers_; }
  /// What is computed at present, and what is awake.
  [[nodiscard]] const Regions& regions() const { return regions_; }

 private:
  [[nodiscard]] Sheet MakeSheet() const;
  [[nodiscard]] SheetMatrix MakeMatrix();
  [[nodiscard]] Organ MakeOrgan() const;
  [[nodiscard]] OrganMatrix MakeOrganMatrix();
  [[nodiscard]] SheetLinearise At(const FloatArray& place, FloatArray* residual);
  [[nodiscard]] OrganLinearisation OrganAt(const FloatArray& place);
  [[nodiscard]] Inertia MakeInertia(float h) const;
  void PackSheet(const ElasticModel& model);
  void PackOrgan(const ElasticModel& model, std::uint32_t tube_count);
  [[nodiscard]] Regions MakeRegions(const ElasticModel& model) const;
  void FindFrayed();
  void FollowEdge(const TissueModel& tissue, Index row, Index col, std::size_t direction);

  void Measure(const Task& task, std::vector<float>* moved) const;
  void WakeTouched(std::span<const HeldPlace> held, std::span<const ContactRow> contacts);
  void FollowRegions();
  /// place <- start + h velocity, at most `limit` away [m].
  GuessCount Guess(float h, float limit);
  [[nodiscard]] float GuessLimit(float h, std::span<const HeldPlace> held, std::span<const ContactRow> contacts) const;
  void ForgetDamagedVelocities();
  void PutUnguessed(std::span<const HeldPlace> held, std::span<const ContactRow> contacts);
  /// Of what is computed, for comparisons.
  [[nodiscard]] double EnergyAt(const FloatArray& place, const Inertia& inertia, std::span<const ContactRow> contacts);
  void Linearise(const Inertia& inertia, std::span<const ContactRow> contacts);
  void RefreshContactStiffness();
  void HoldFrayed();
  double Precondition();
  /// q <- A p less what bindings and hinges do to it: the next phase adds that. Returns p . A p.
  double Apply(const FloatArray& p, float inertia) { return Apply(p, inertia, regions_.part(), elements_.computed()); }
  double Apply(const FloatArray& p, float inertia, const Part& part, const Selection& elements);
  /// p . A p in one phase, for LastStep.
  double Curvature(const FloatArray& p, float inertia);
  /// The last of Solve: along z + beta p by alpha, and along p by of_before in all.
  struct Step {
    float alpha = 0, beta = 0, of_before = 0;
  };
  void LastStep(const Step& last, bool adds, float inertia);
  void WantResidual(std::span<const std::uint8_t> regions);
  void Solve(float inertia, int iterations);
  void FollowContacts();
  void SolveAtContacts(float inertia);
  void SwapBlock(ParticleRef at, std::array<float, 12>* block);
  [[nodiscard]] float LargestCorrection() const;
  void LimitCorrection(float largest);
  void SearchAlongCorrection(const Inertia& inertia, std::span<const ContactRow> contacts);
  SubstepReport Finish(float h);

  /// field += what bindings and hinges do to a task's particles.
  void AddElements(const Task& task, FloatArray* field) const;
  /// body(task, index, worker) for all that is computed, shared by the threads.
  template <class Body>
  void ForTasks(const Body& body) {
    ForTasks(regions_.part(), body);
  }
  template <class Body>
  void ForTasks(const Part& part, const Body& body);
  /// And once, by whichever thread comes first, errand().
  template <class Body, class Errand>
  void ForTasks(const Body& body, const Errand& errand);
  /// body(index, worker) for so many tasks of one kind and of another, beside two jobs of about the same length.
  template <class Body, class First, class Second>
  void ForTasksBeside(int kind0, int kind1, const Body& body, const First& first, const Second& second);
  /// body(first float, count) for the parts of a field that belong to a task.
  template <class Body>
  void ForParts(const Task& task, const Body& body) const;
  /// body(region, first, end) for the rows or vertices of each region of a task.
  template <class Body>
  void ForRegions(const Task& task, const Body& body) const;
  [[nodiscard]] double SumOfPartials(std::size_t tasks) const;

  const Kernels& kernels_;
  ParticleStore* particles_;
  std::uint32_t tube_count_;
  int rows_, slots_;
  std::size_t plane_, tube_floats_;
  float damping_, stiffening_, rest_scale_;
  Vec3f gravity_;

  // The model, packed.
  std::array<FloatArray, 3> inverse_rest_, axial_, axial_uncut_;
  std::vector<int> missing_edges_;   ///< By place in a plane: how many edges a node has lost to cuts.
  std::vector<ParticleRef> frayed_;  ///< Nodes that have lost half of them or more.
  struct FrayedEdge {
    std::size_t direction;
    std::array<std::uint32_t, 2> at;  ///< Ends, by place in a plane.
    float stiffness;                  ///< At least, in the solve, whatever way the ends part [N/m].
  };
  std::vector<FrayedEdge> frayed_edges_;  ///< What is left of theirs.
  FloatArray sheet_mass_;
  std::vector<std::uint32_t> start_, vertex_, patch_start_, patch_;
  FloatArray gradient_, patch_gradient_, volume_, organ_mass_;
  FloatArray load_;  ///< A field.
  float mu_ = 0, lambda_ = 0;
  Elements elements_;
  CoarseSpace coarse_;
  FloatArray base_extra_, extra_;  ///< Membrane plane, then tube: stiffness of elements on the diagonal.
  std::vector<std::uint32_t> extra_changed_;

  // Who works on what.
  mutable Workers workers_;
  Regions regions_;
  std::vector<std::uint8_t> held_before_, touched_before_, held_now_, touched_now_, pressed_now_, wanted_now_,
      stiffened_;                  ///< By region.
  Part wanted_;                    ///< Where Solve leaves the residual.
  std::vector<float> speed_;       ///< By region [m/s].
  std::vector<float> largest_sq_;  ///< By region: correction [m^2].

  std::vector<float> moved_, moved_asleep_;  ///< By block [m]; since BeginStep of what has fallen asleep since.

  // The linearisation.
  std::array<FloatArray, 3> kt_, along_;
  std::array<FloatArray, 6> block_;
  FloatArray organ_c_, organ_f_, organ_stress_, organ_block_;

  // Fields: velocity, place of the linearisation, residual, z = M^-1 r, direction p, q = A p, correction d. Where
  // nothing is computed, velocity, z, p, q and d are 0 and the place is that of the particle.
  FloatArray velocity_, place_, residual_, z_, p_, q_, d_;
  std::array<FloatArray, kMemories> answer_;  ///< To questions: displacements.
  FloatArray aside_;                          ///< The residual, while a question is answered.
  struct Fixed {
    float inverse_mass = 0;
    std::array<float, 12> block{};
  };
  std::vector<Fixed> fixed_;       ///< Of the particles that a question is about, meanwhile.
  std::vector<FloatArray> carry_;  ///< By thread.
  FloatArray row_sums_;
  std::vector<double> partial_;      ///< By task.
  std::vector<GuessCount> guess_;    ///< By task.
  std::vector<FinishCount> finish_;  ///< By task.
  float blocks_inertia_ = 0;         ///< Inertia for which the organ's blocks of the diagonal were made; 0: make all.
  std::uint32_t steps_ = 0;
  bool organ_blocks_due_ = true, refresh_due_ = false, stiff_contacts_ = false;
  bool forces_due_ = false;  ///< The residual lacks those of bindings and hinges.

  // Around the stiff contacts.
  Part pressed_, around_;
  Selection around_elements_;
  bool around_due_ = true;  ///< What is computed, or what elements there are, has changed.
  FloatArray local_;        ///< A direction of the solve, 0 where not pressed.
};

}  // namespace fulcrum::physics::implicit
