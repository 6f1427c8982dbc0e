// What joins particles across the two layers or far apart in one: bindings, hinges, contacts. A few thousand against
// tens of thousands of edges, so plain loops over ParticleRefs.
#pragma once

#include <span>
#include <vector>

#include "physics_node/collision/contact_row.h"
#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/hinge_matrix.h"
#include "physics_node/implicit/inversion_guard.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics::implicit {

/// A sum over up to four particles, weight_k x_k, and what resists its change: kt I + m m^T.
struct Element {
  int count = 4;
  std::array<ParticleRef, 4> at;
  std::array<float, 4> weight{0, 0, 0, 0};
  float kt = 0;
  Vec3f m = Vec3f::Zero();
  bool active = true;
};

/// Elements with a say in a part of the tissue.
struct Selection {
  std::vector<std::uint32_t> bindings, hinge_rows;
};

class Elements {
 public:
  Elements(const SceneView& scene, const ElasticModel& model, const ParticleStore& particles);

  /// Once, before the first Linearise: which region each of their particles is in.
  void Divide(const Regions& regions);
  /// Switches off what a cut has severed.
  void Follow(const TissueModel& tissue);
  /// From now on only elements with a particle in a region that is computed.
  void FollowRegions(const Regions& regions);
  [[nodiscard]] const Selection& computed() const { return computed_; }
  /// Those that resist when particles in regions `moved` move, which is felt in regions `felt`.
  void Select(const Regions& regions, std::span<const std::uint8_t> moved, std::span<const std::uint8_t> felt,
              Selection* selection) const;

  /// Stiffness that bindings and hinges add to the diagonal, by pool offset of x.
  [[nodiscard]] std::vector<std::pair<std::uint32_t, float>> Diagonal() const;
  /// Finds what folds the organ has (see InversionGuard), which act until the next call. Knows nothing of Touch.
  void LookForFolds(const float* place);
  /// Finds which contacts push at `place`, sliding measured from `start`, a substep of h ago; they act until the next
  /// call.
  void Touch(float h, const float* place, const float* start, const Regions& regions,
             std::span<const ContactRow> contacts);
  [[nodiscard]] std::span<const Element> touching() const { return contacts_; }
  [[nodiscard]] const InversionGuard& guard() const { return guard_; }
  // What reads fields and what writes them are apart: the first runs beside kernels that write other fields. What
  // bindings and hinges have made is then added by region, each by whoever works there next; the guard and the
  // contacts, which are few, at once. The first comes in two halves that take about as long and know nothing of one
  // another: hinges, and the others.
  /// Linearises at `place`, for AddInRegion.
  void LineariseHinges(const float* place) { hinges_.MakeForce(place, computed_.hinge_rows); }
  void LineariseOthers(const float* place);
  /// residual += forces of the guard and of the touching contacts.
  void AddContactForces(float* residual) const;
  /// While set, contacts take no part in products.
  void LeaveContactsOut(bool out) { contacts_out_ = out; }
  /// K p, for AddContactProduct and then AddInRegion or Add; returns p . K p. p is 0 wherever elements act that are not
  /// selected. All contacts are.
  double MultiplyHinges(const float* p, const Selection& selection) {
    return hinges_.Multiply(p, selection.hinge_rows);
  }
  double MultiplyOthers(const float* p, const Selection& selection);
  /// out += scale * what the product has made of the contacts. The guard, which seldom has anything to do, is
  /// multiplied here; returns its share of p . K p.
  double AddContactProduct(const float* p, float scale, float* out);
  /// field += what the last linearisation, or the last product of all that is computed, has made of bindings and hinges
  /// in a region that is computed.
  void AddInRegion(int region, float* field) const;
  /// field += what the last product has made of bindings and hinges, in all its regions.
  void Add(const Selection& selection, float* field) const;
  [[nodiscard]] double EnergyOfHinges(const float* place) { return hinges_.Energy(place, computed_.hinge_rows); }
  [[nodiscard]] double EnergyOfOthers(const float* place, std::span<const ContactRow> contacts) const;
  /// Contacts stiffer than this are with a tool; softer ones are tissue on tissue, as the fat around [N/m].
  static constexpr float kStiffContact = 500.0f;
  /// Normal and friction forces of contacts with tools at `place` + `d`, sliding measured from `start`, h ago.
  static void WriteForces(float h, const float* place, const float* d, const float* start,
                          std::span<ContactRow> contacts);

  /// Stiffness of a contact in its normal direction: of tissue against a tool, and of soft tissue against tissue; an
  /// edge of the membrane has some 200 N/m [N/m].
  [[nodiscard]] static float ContactStiffness(const ContactRow& row);
  /// Of tissue with tissue, not with a tool.
  [[nodiscard]] static bool IsTissue(const ContactRow& row);

 private:
  struct BindingRest {
    float length, stiffness;
    Index node;
  };
  [[nodiscard]] std::span<const Element> contacts_in_product() const {
    return contacts_out_ ? std::span<const Element>() : std::span<const Element>(contacts_);
  }

  std::vector<Element> bindings_, contacts_;
  std::vector<BindingRest> binding_rest_;
  /// What a binding does to one of its particles.
  struct Share {
    std::uint32_t binding = 0;
    float weight = 0;
    ParticleRef at;
  };
  std::vector<std::vector<Share>> shares_;  ///< By region, in order of the bindings.
  Selection computed_;
  FloatArray binding_force_;  ///< xyz_ by binding: at the linearisation, or of the last product; 0 where severed.
  std::vector<Vec3f> contact_force_, contact_product_;
  bool contacts_out_ = false;
  HingeMatrix hinges_;
  InversionGuard guard_;
};

}  // namespace fulcrum::physics::implicit
