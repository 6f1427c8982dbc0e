// Compliance of the tissue at a contact, computed by the solver: the reaction to a small common displacement of the
// touched particles, after one frame and at rest. From both follow stiffness k and viscosity b of a Kelvin-Voigt
// element under a constant force F,
//
//   u(t) = F / k (1 - exp(-k t / b)):   k = k(rest),   b = k h / -ln(1 - k(rest) / k(h))
//
//   u  displacement [m]    k  [N/m]    b  [N s/m]    h  frame [s]    k(t)  force over displacement after t [N/m]
//
// At most one query of the solver per tool and step; the two horizons alternate.
#pragma once

#include <array>
#include <span>

#include "physics_node/tissue/particle_store.h"
#include "services/base/core/messages.h"

namespace fulcrum::physics {

/// Particles that are displaced together.
struct Probe {
  std::span<const Index> particles;
  Vec3f direction = Vec3f::UnitZ();  ///< Unit, frame W.
  std::uint32_t tool = 0;            ///< Successive queries of a tool are similar: the last answer starts the next.
};

/// Interface of a solver to the probe.
class ComplianceSolver {
 public:
  static constexpr float kAtRest = 0;

  virtual ~ComplianceSolver() = default;
  /// Force over displacement of the particles, `horizon_s` after a sudden displacement or, for kAtRest, at rest [N/m].
  /// Does not change the state. False: no answer in this step. The solver bounds the cost; answers may be approximate.
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
  /// Most particles of a query; bounds its cost. Assumed.
  static constexpr std::size_t kMaxParticles = 256;

  explicit ComplianceProbe(float frame_s) : frame_s_(frame_s) {}

  /// Once a step for a tool in contact: `particles`, of which at most kMaxParticles are used, are touched or held;
  /// `direction`: unit direction of the hand's push. Low-passed; known after one answer for each horizon.
  const Compliance& Update(std::uint32_t tool, std::span<const Index> particles, const Vec3f& direction,
                           ComplianceSolver* solver);
  /// At the end of a contact.
  void Reset(std::uint32_t tool) { tools_[tool] = {}; }
  [[nodiscard]] const Compliance& compliance(std::uint32_t tool) const { return tools_[tool].compliance; }

 private:
  struct Memory {
    float after_frame = 0, at_rest = 0;  ///< Displacement over force, low-passed [m/N].
    bool query_rest = true;              ///< Horizon of the next query: at rest, else after a frame.
    Compliance compliance;
  };
  float frame_s_;
  std::array<Memory, kMaxTools> tools_;
};

}  // namespace fulcrum::physics
