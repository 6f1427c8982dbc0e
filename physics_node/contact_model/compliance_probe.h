// How the tissue at a contact gives way, asked of the solver itself: with what force it resists when what is touched
// moves with the tool by a little, after one frame and at rest. From the two follow the stiffness and viscosity of a
// Kelvin-Voigt element under a constant force,
//
//   u(t) = F / k (1 - exp(-k t / b)):   k = k(rest),   b = k h / -ln(1 - k(rest) / k(h)).
//
// Costs at most one question to the solver a tool and step: the two horizons take turns.
#pragma once

#include <array>
#include <span>

#include "physics_node/tissue/particle_store.h"
#include "services/base/core/messages.h"

namespace fulcrum::physics {

/// Particles that move together.
struct Probe {
  std::span<const Index> particles;
  Vec3f direction = Vec3f::UnitZ();  ///< Unit, frame W.
  std::uint32_t tool = 0;            ///< Who asks: its questions resemble one another.
};

/// What a solver offers to the probe.
class ComplianceSolver {
 public:
  static constexpr float kAtRest = 0;

  virtual ~ComplianceSolver() = default;
  /// Force over displacement when the particles are moved, from now on, and after `horizon_s` or, for kAtRest, at rest
  /// [N/m]. The state stays as it is. False: no answer this time. The solver bounds its own cost and may answer
  /// approximately.
  virtual bool Stiffness(const Probe& probe, float horizon_s, float* newton_per_m) = 0;
};

struct Compliance {
  bool known = false;
  float fast = 0;       ///< Force over displacement after one frame [N/m].
  float stiffness = 0;  ///< At rest [N/m].
  float viscosity = 0;  ///< [N s/m]
};

class ComplianceProbe {
 public:
  static constexpr std::size_t kMaxParticles = 256;

  explicit ComplianceProbe(float frame_s) : frame_s_(frame_s) {}

  /// Once a step for a tool in contact: `particles` (at most kMaxParticles are used) are what it touches or holds,
  /// `direction` the unit direction in which the hand would push. Low-passed; known once both horizons have answered.
  const Compliance& Update(std::uint32_t tool, std::span<const Index> particles, const Vec3f& direction,
                           ComplianceSolver* solver);
  /// The contact is over.
  void Forget(std::uint32_t tool) { tools_[tool] = {}; }
  [[nodiscard]] const Compliance& compliance(std::uint32_t tool) const { return tools_[tool].compliance; }

 private:
  struct Memory {
    float after_frame = 0, at_rest = 0;  ///< Displacement over force, low-passed [m/N].
    bool ask_rest = true;
    Compliance compliance;
  };
  float frame_s_;
  std::array<Memory, kMaxTools> tools_;
};

}  // namespace fulcrum::physics
