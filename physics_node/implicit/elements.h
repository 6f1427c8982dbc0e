// What joins particles across the two layers or far apart in one: bindings, hinges, contacts, guarded tetrahedra. A few
// thousand against tens of thousands of edges, so plain loops over ParticleRefs.
//
//   binding   E = k/2 (l - d)^2,  s = x_m - sum_i b_i x_i,  l = |s|            (eq. 9 of the paper)
//             K = kt I + m m^T,   kt = k max(1 - d/l, 0),  m = sqrt(k - kt) s/l
//   contact   f = n (F(depth) - D n.u) - t u_t,   depth = offset - n . sum_i w_i x_i
//             K = t I + m m^T,    m = sqrt(max(F' + D - t, 0)) n
//   product   of both: f = kt p + m (m . p) with p = sum_i w_i p_i, and w_i f at particle i
//
//   x_m, x_i, b_i  node of the membrane, vertices of the organ and barycentric coordinates
//   k, d           stiffness [N/m] and rest length [m]
//   n, w_i         normal and weights of the contact row (collision/contact_row.h)
//   u, u_t         movement against the other body in this substep and its part along the surface [m]
//   F, F', D, t    elastic force [N], its derivative, damping and resistance against sliding [N/m]: see elements.cc
#pragma once

#include <span>
#include <vector>

#include "physics_node/clips/clips.h"
#include "physics_node/collision/contact_row.h"
#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/element.h"
#include "physics_node/implicit/hinge_matrix.h"
#include "physics_node/implicit/inversion_guard.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/implicit/slides.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics::implicit {

/// Elements that act in a part of the tissue.
struct Selection {
  std::vector<std::uint32_t> bindings, hinge_rows;
};

class Elements {
 public:
  /// Contacts stiffer than this are with a tool, or of a solid with another that it presses; softer ones are tissue on
  /// tissue, as the fat around [N/m].
  static constexpr float kStiffContact_N_per_m = 500.0f;
  /// Contacts that memory is reserved for, of tools and of tissue against tissue together; with more the lists grow.
  static constexpr std::size_t kReservedContacts = 4608;

  Elements(const TissueScene& scene, const ElasticModel& model, const ParticleStore& particles,
           const Partition& partition);

  /// Stiffness that bindings and hinges add to the diagonal, by pool offset of x [N/m].
  [[nodiscard]] static std::vector<std::pair<std::uint32_t, float>> Diagonal(const ElasticModel& model,
                                                                             const ParticleStore& particles);

  /// Switches off what a cut has severed.
  void UpdateTopology(const TissueModel& tissue);
  /// From now on only elements with a particle in a region that is computed.
  void SelectComputed(const Regions& regions);
  [[nodiscard]] const Selection& computed() const { return computed_; }
  /// An empty selection with memory for all elements.
  [[nodiscard]] Selection MakeSelection() const;
  /// Those that resist when particles in regions `moved` move and whose forces act in regions `affected`.
  void Select(const Partition& partition, std::span<const std::uint8_t> moved, std::span<const std::uint8_t> affected,
              Selection* selection) const;

  // Linearisation. Finding inversions and contacts are independent of each other and may run side by side.
  /// Finds the folds of the organ (InversionGuard), which act until the next call.
  void FindInversions(const float* place, const Regions& regions) {
    guard_.Linearise(place, regions.computed_bodies());
  }
  /// Finds which contacts push at `place`, sliding measured from `start`, a substep of h ago; they act until the next
  /// call.
  void FindContacts(float h, const float* place, const float* start, const Regions& regions,
                    std::span<const ContactRow> contacts);
  [[nodiscard]] std::span<const Element> contacts() const { return contacts_; }
  [[nodiscard]] const InversionGuard& guard() const { return guard_; }
  /// Finds where solids slide on each other; independent of both.
  void FindSlides(const float* place, const Regions& regions) { slides_.Linearise(place, regions); }
  [[nodiscard]] const Slides& slides() const { return slides_; }
  void RestartSlides() { slides_.Restart(); }
  /// Clips on the tissue, which another keeps and outlives this; until then none.
  void UseClips(Clips* clips) { clips_ = clips; }
  [[nodiscard]] bool has_clips() const { return clips_ != nullptr && !clips_->empty(); }
  [[nodiscard]] const Clips& clips() const { return *clips_; }
  /// Fits them; independent of all others.
  void FitClips(const float* place, const Regions& regions) {
    clips_->Linearise(place, [&](ParticleRef at) { return regions.computed(regions.partition().Of(at)); });
  }
  /// A contact with a tool, or of a solid with another; not with a sheet.
  [[nodiscard]] static bool IsStiff(const Element& contact) { return contact.m.squaredNorm() > kStiffContact_N_per_m; }

  // What reads fields and what writes them are apart: the first runs beside kernels that write other fields. Forces and
  // products of bindings and hinges are then added by region, by the thread that works there next; those of the guard
  // and the contacts, which are few, at once. The first comes in two halves of about the same length that are
  // independent of each other: hinges, and bindings with contacts.
  /// Linearises at `place`, for AddInRegion.
  void LineariseHinges(const float* place) { hinges_.MakeForce(place, computed_.hinge_rows); }
  void LineariseBindings(const float* place);
  /// residual += forces of the guard, the slides, the clips and the contacts.
  void AddContactForces(float* residual) const;
  /// While set, contacts take no part in products.
  void ExcludeContacts(bool exclude) { contacts_excluded_ = exclude; }
  /// K p, for AddContactProduct and then AddInRegion or Add; returns p . K p. p is 0 wherever elements act that are not
  /// selected. All contacts are.
  double MultiplyHinges(const float* p, const Selection& selection) {
    return hinges_.Multiply(p, selection.hinge_rows);
  }
  double MultiplyBindingsAndContacts(const float* p, const Selection& selection);
  /// out += scale * the part of contacts, slides and clips in the last product. The guard, which is mostly empty, is
  /// multiplied here; returns its share of p . K p.
  double AddContactProduct(const float* p, float scale, float* out);
  /// field += the last force, or the last product of all that is computed, of bindings and hinges in a region that is
  /// computed.
  void AddInRegion(int region, float* field) const;
  /// field += the last product of bindings and hinges, in all its regions.
  void Add(const Selection& selection, float* field) const;

  [[nodiscard]] double EnergyOfHinges(const float* place) { return hinges_.Energy(place, computed_.hinge_rows); }
  /// Of bindings, contacts, slides, clips and guarded tetrahedra [J].
  [[nodiscard]] double EnergyOfBindingsAndContacts(const float* place, std::span<const ContactRow> contacts) const;

  /// Normal and friction forces of contacts with tools at `place` + `d`, sliding measured from `start`, h ago.
  static void WriteForces(float h, const float* place, const float* d, const float* start,
                          std::span<ContactRow> contacts);
  /// Afterwards, for the tools' contacts of the linearisation: the part of these forces that the truncated solve has
  /// left unbalanced, from its `residual` at `d`. A particle of several rows counts by weight; one that is not computed
  /// has no residual: it was in balance when it fell asleep.
  void WriteUnbalanced(const float* d, const float* residual, const Regions& regions, std::span<ContactRow> contacts);
  /// Stiffness of a contact in its normal direction [N/m].
  [[nodiscard]] static float ContactStiffness(const ContactRow& row);
  /// Of tissue with tissue, not with a tool.
  [[nodiscard]] static bool IsTissue(const ContactRow& row);
  /// Of a sheet with another, or with itself (SheetPairs::kAll).
  [[nodiscard]] static bool IsOfSheets(const ContactRow& row);

 private:
  struct BindingRest {
    float length, stiffness;                    ///< [m], [N/m]
    Index node;                                 ///< Of the membrane; kNoIndex: none.
    alignas(16) std::array<float, 4> offset{};  ///< Part of s that is no stretch [m].
  };
  /// What a binding does to one of its particles.
  struct Share {
    std::uint32_t binding = 0;
    float weight = 0;
    ParticleRef at;
  };
  [[nodiscard]] std::span<const Element> contacts_in_product() const {
    return contacts_excluded_ ? std::span<const Element>() : std::span<const Element>(contacts_);
  }

  std::vector<Element> bindings_, contacts_;
  std::vector<BindingRest> binding_rest_;
  std::vector<std::vector<Share>> shares_;  ///< By region, in order of the bindings.
  Selection computed_;
  FloatArray binding_force_;  ///< xyz_ by binding: at the linearisation, or of the last product; 0 where severed.
  std::vector<Vec3f> contact_force_, contact_product_;
  std::vector<std::uint32_t> contact_row_;  ///< Rows that the contacts were made of.
  FloatArray row_weights_;                  ///< By pool offset: sum of the weights of a particle in the rows.
  bool contacts_excluded_ = false;
  HingeMatrix hinges_;
  InversionGuard guard_;
  Slides slides_;
  Clips* clips_ = nullptr;
};

}  // namespace fulcrum::physics::implicit
