#include "physics_node/contact_model/compliance_probe.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// Weight of a new answer in the low-pass filter. Assumed.
constexpr float kShare = 0.3f;
/// Range of the local model [m/N]: 30 to 5000 N/m, as kMinBody and kMaxBody in contact_probe.cc.
constexpr float kMinCompliance = 1.0f / 5000.0f, kMaxCompliance = 1.0f / 30.0f;
/// Largest displacement in one frame as a share of that at rest: keeps the viscosity above zero.
constexpr float kMaxFrameShare = 0.98f;

}  // namespace

const Compliance& ComplianceProbe::Update(std::uint32_t tool, std::span<const Index> particles, const Vec3f& direction,
                                          ComplianceSolver* solver) {
  Memory& memory = tools_[tool];
  const std::size_t count = std::min(particles.size(), kMaxParticles);
  if (solver == nullptr || count == 0) {
    return memory.compliance;
  }
  float* known = memory.query_rest ? &memory.at_rest : &memory.after_frame;
  float stiffness = 0;
  if (!solver->Stiffness({particles.first(count), direction, tool},
                         memory.query_rest ? ComplianceSolver::kAtRest : frame_s_, &stiffness)) {
    return memory.compliance;
  }
  memory.query_rest = !memory.query_rest;
  if (!(stiffness > 0.0f) || !std::isfinite(stiffness)) {
    return memory.compliance;
  }
  const float answer = 1.0f / stiffness;
  *known += (*known > 0.0f ? kShare : 1.0f) * (answer - *known);
  if (memory.after_frame > 0.0f && memory.at_rest > 0.0f) {
    const float rest = std::clamp(memory.at_rest, kMinCompliance, kMaxCompliance);
    const float part = std::min(memory.after_frame / std::max(memory.at_rest, memory.after_frame), kMaxFrameShare);
    memory.compliance.known = true;
    memory.compliance.fast = 1.0f / memory.after_frame;
    memory.compliance.stiffness = 1.0f / rest;
    memory.compliance.viscosity = frame_s_ / (rest * -std::log1p(-part));
  }
  return memory.compliance;
}

}  // namespace fulcrum::physics
