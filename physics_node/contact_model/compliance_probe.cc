#include "physics_node/contact_model/compliance_probe.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// Share of a new answer in the low-passed one.
constexpr float kShare = 0.3f;
/// What the local model may carry [m/N]: 30 to 5000 N/m.
constexpr float kLeast = 1.0f / 5000.0f, kMost = 1.0f / 30.0f;
/// Of the displacement at rest, at most this is reached in one frame: the viscosity stays above zero.
constexpr float kMostInFrame = 0.98f;

}  // namespace

const Compliance& ComplianceProbe::Update(std::uint32_t tool, std::span<const Index> particles, const Vec3f& direction,
                                          ComplianceSolver* solver) {
  Memory& memory = tools_[tool];
  const std::size_t count = std::min(particles.size(), kMaxParticles);
  if (solver == nullptr || count == 0) {
    return memory.compliance;
  }
  float* known = memory.ask_rest ? &memory.at_rest : &memory.after_frame;
  float stiffness = 0;
  if (!solver->Stiffness({particles.first(count), direction, tool},
                         memory.ask_rest ? ComplianceSolver::kAtRest : frame_s_, &stiffness)) {
    return memory.compliance;
  }
  memory.ask_rest = !memory.ask_rest;
  if (!(stiffness > 0.0f) || !std::isfinite(stiffness)) {
    return memory.compliance;
  }
  const float answer = 1.0f / stiffness;
  *known += (*known > 0.0f ? kShare : 1.0f) * (answer - *known);
  if (memory.after_frame > 0.0f && memory.at_rest > 0.0f) {
    const float rest = std::clamp(memory.at_rest, kLeast, kMost);
    const float part = std::min(memory.after_frame / std::max(memory.at_rest, memory.after_frame), kMostInFrame);
    memory.compliance.known = true;
    memory.compliance.fast = 1.0f / memory.after_frame;
    memory.compliance.stiffness = 1.0f / rest;
    memory.compliance.viscosity = frame_s_ / (rest * -std::log1p(-part));
  }
  return memory.compliance;
}

}  // namespace fulcrum::physics
