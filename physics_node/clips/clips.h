// Clips of clip appliers. A clip keeps the particles that its jaws held when they closed in their arrangement: an
// elastic rigid frame that moves freely with the tissue.
//
//   E = sum_i k/2 |d_i|^2,    d_i = x_i - c - R p_i,    dE/dx_i = k d_i
//   K = k (I - T - B^T J B),  B dx = sum_i q_i x dx_i,  q_i = R p_i
//   J = (H_q + |D| I)^-1,     H_q = sum_i |q_i|^2 I - q_i q_i^T,   D = sum_i (q_i . d_i) I - sym(q_i d_i^T)
//
//   c, R  the rigid motion that fits best (rigid_fit.h)      p_i  places at rest about their centre [m]
//   k     stiffness [N/m]                                    T    takes the mean;  |D| Frobenius
//
// E depends on c and R only through their optimum, so its gradient is k d_i (envelope theorem): the forces add up to
// nothing and have no moment. The second derivative is K with J = H^-1 and H = H_q + D where H > 0. J is not above
// H^-1, so K is never below it; nor is J above H_q^-1, with which K is k times the projector that removes rigid
// motions, so K is positive semi-definite. Without strain K is exact.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics_node/collision/tool_shape.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/clips.h"
#include "services/base/core/hash.h"
#include "services/base/core/messages.h"

namespace fulcrum::physics {

/// Particles in a clip: those nearest to the middle line of its jaws.
inline constexpr std::size_t kMostClipped = 48;
/// A clip on fewer would have no frame of its own.
inline constexpr std::size_t kLeastClipped = 3;

struct ClippedParticle {
  Index particle = 0;
  Vec3f p_C = Vec3f::Zero();  ///< At rest, in the clip's frame [m].
};

/// A clip as in a checkpoint.
struct AppliedClip {
  Clip placed;                          ///< As in ClipState.
  Quatf q_WC = Quatf::Identity();       ///< As it was fitted last.
  std::vector<ClippedParticle> tissue;  ///< 3 to kMostClipped that are alive.
};

struct ClipMemory {
  std::vector<AppliedClip> clips;  ///< In the order in which they were applied.
  std::uint32_t lost = 0, refused = 0;
};

class Clips {
 public:
  /// Per particle [N/m]: two layers of 12 particles each part by 0.17 mm per newton. With 2000 slack tissue beside a
  /// clip trembles in two iterations (deploy/docs/measurements/physics, Clips).
  static constexpr float kStiffness_N_per_m = 1000.0f;

  explicit Clips(const TissueScene& scene);

  /// A tool of the scene applies clips.
  [[nodiscard]] bool possible() const { return possible_; }
  [[nodiscard]] bool empty() const { return clips_.empty(); }
  [[nodiscard]] std::size_t count() const { return clips_.size(); }
  /// That fell off, and closings on tissue that left no clip: kMaxClips were there, or the tissue in the jaws was less
  /// than three particles, in one line, or in other clips.
  [[nodiscard]] std::uint32_t lost() const { return lost_; }
  [[nodiscard]] std::uint32_t refused() const { return refused_; }
  /// Changes with what Fill writes.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }

  /// A tool has closed on `held`. Leaves a clip there; false: refused.
  bool Apply(std::uint8_t tool, const ToolDescription& description, const ToolPose& pose, std::span<const Index> held,
             const ParticleStore& particles);
  /// Takes out particles that have been cut off; a clip of fewer than three falls off.
  void DropDead(const TissueModel& model, const ParticleStore& particles);

  // Mode accurate. Fields are laid out as the pool of the ParticleStore.
  /// Fits all clips at `place`; those act, until the next call, of which `is_computed(ParticleRef)` is true for a
  /// particle.
  template <class Computed>
  void Linearise(const float* place, const Computed& is_computed) {
    for (Element& e : elements_) {
      e.acts = std::any_of(e.at.begin(), e.at.end(), is_computed) && Fit(place, &e);
    }
  }
  /// residual += forces of the last Linearise.
  void AddForce(float* residual) const;
  /// K p, for AddProduct; returns p . K p.
  double Multiply(const float* p);
  /// out += scale * the last product.
  void AddProduct(float scale, float* out) const;
  /// Of the clips that act, at `place` [J].
  [[nodiscard]] double Energy(const float* place) const;
  /// body(particles of a clip), for each clip.
  template <class Body>
  void ForEach(const Body& body) const {
    for (const Element& e : elements_) body(std::span<const ParticleRef>(e.at));
  }

  /// Modes xpbd and paper: moves what is free to the places that fit best.
  void Project(ParticleStore* particles);

  void Fill(ClipState* state) const;
  void AddTo(Hash64* hash) const;
  [[nodiscard]] ClipMemory Save() const;
  /// A memory of this scene that Restore can take.
  [[nodiscard]] bool Fits(const ClipMemory& memory, Index particle_count) const;
  void Restore(const ClipMemory& memory, const ParticleStore& particles);

 private:
  /// A clip for the solvers.
  struct Element {
    std::vector<ParticleRef> at;
    std::vector<Vec3f> p;                                      ///< p_i [m]
    Vec3f middle = Vec3f::Zero();                              ///< Of the places at rest in the clip's frame [m].
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< R
    bool acts = false;
    std::vector<Vec3f> q, force, product;
    Eigen::Matrix3f inverse = Eigen::Matrix3f::Zero();  ///< J [1/m^2]
  };
  /// Centre and A at places.
  struct Moments {
    Vec3d centre;
    Mat3d A;
  };
  [[nodiscard]] static Moments MomentsOf(const Element& e, const float* place);
  /// False, with nothing changed, at places that are not finite.
  static bool Fit(const float* place, Element* e);
  [[nodiscard]] static Element MakeElement(const AppliedClip& clip, const ParticleStore& particles);
  /// Places the clip relative to three of its particles far from each other, if possible all of the sheet that it holds
  /// most nodes of; false: they are in one line.
  [[nodiscard]] bool Anchor(const ClipPose& pose, const ParticleStore& particles, AppliedClip* clip) const;
  /// The same, at where its particles are now.
  [[nodiscard]] bool AnchorAnew(const ParticleStore& particles, Element* e, AppliedClip* clip) const;
  [[nodiscard]] bool IsClipped(Index particle) const;

  bool possible_;
  Index columns_;                           ///< Of the sheets' grid.
  std::vector<std::size_t> sheet_of_rows_;  ///< Of that grid.
  std::vector<AppliedClip> clips_;
  std::vector<Element> elements_;  ///< By clip.
  std::uint32_t lost_ = 0, refused_ = 0;
  std::uint64_t revision_ = 1;
};

}  // namespace fulcrum::physics
