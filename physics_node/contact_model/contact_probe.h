// The local contact model that the servo evaluates between two steps of physics: where the surface is, how hard it
// pushes now, and how that changes with the tool's place.
//
//   f_ref   from a solver that knows it: of a grasp as it is, of a surface the median of the last kMedian steps, dated
//           back to the middle one by x_ref; else the elastic force of the edges around what the tool touches or holds,
//           with SI stiffness (elastic_force.h), low-passed over kSmoothing
//   u_c     how far the tissue at the contact has been moved against its surroundings (a ring some 7 mm away), so that
//           a tent raised by the other tool is not taken for a dent made by this one
//   k1, kt  of the skin: E t of the membrane is what a small disc of it resists with, whatever its size
//   k_body  twice the secant f / u (a sheet in tension stiffens with depth: its tangent lies above the secant; too
//           soft a model would be active, too stiff only dissipates), within [kMinBody, kMaxBody]
//   b_body  k_body * kRelaxation
//   kappa   of the surface as it would be without this tool, as u_c and p_s mean it: before touch the present shape,
//           from touch on the shape at rest (the present one is the dent), seen by the middle of a tip that rolls on it
// Both are asked of the solver instead where it offers a ComplianceSolver.
#pragma once

#include <array>
#include <vector>

#include "physics_node/collision/tool_collision.h"
#include "physics_node/contact_model/compliance_probe.h"
#include "physics_node/contact_model/elastic_force.h"
#include "physics_node/contact_model/surface_curvature.h"
#include "physics_node/grasp/grasp.h"

namespace fulcrum::physics {

class ContactProbe {
 public:
  /// Published forces on a tool are limited to this: rectal tissue is damaged by more [N].
  static constexpr float kForceCap_N = 15.0f;

  ContactProbe(const SceneView& scene, const TissueModel* model, const ParticleStore* particles);

  /// Contacts of one tool after a step: a grasp, or the nearest surface within reach, or none. `solver_force`: of the
  /// tissue on the tool [N], from a solver that knows; null: estimated from the edges.
  DeviceContacts Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision, const Grasp& grasp,
                        const Vec3f* solver_force);
  /// Before an Update that does not follow the last one: what it measured then is of another time.
  void Forget(std::uint32_t tool, const ToolPose& pose);
  /// Stiffness and viscosity come from `solver` from now on; nullptr: estimated from force and dent again.
  void AskSolver(ComplianceSolver* solver) { solver_ = solver; }
  [[nodiscard]] const Compliance& compliance(std::uint32_t tool) const { return compliance_.compliance(tool); }
  /// Force on the tool as last computed, low-passed [N].
  [[nodiscard]] Vec3f force(std::uint32_t tool) const { return tools_[tool].force; }

 private:
  static constexpr int kMedian = 5;
  struct ToolMemory {
    ContactKind kind = ContactKind::kNone;
    std::uint32_t id = 0;
    Vec3f force = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();
    Vec3f u = Vec3f::Zero(), du = Vec3f::Zero(), v_s = Vec3f::Zero();
    float stiffness = 0;
    std::vector<Index> touched;
    Vec3f tip = Vec3f::Zero();                ///< Of the tool in the last step.
    Vec3f x_ref = Vec3f::Zero();              ///< Where the tip was when `force` acted.
    std::array<Vec3f, kMedian> forces, tips;  ///< Of the last steps, the newest last.
    int steps = 0;                            ///< 0: nothing in these yet.
  };
  /// Displacement from rest and velocity, averaged.
  struct Motion {
    Vec3f displacement = Vec3f::Zero(), velocity = Vec3f::Zero();
  };

  void Enter(ToolMemory* memory, ContactKind kind) const;
  void Follow(ToolMemory* memory, const Vec3f& force, const Vec3f& u) const;
  void FollowSolver(ToolMemory* memory, const Vec3f& force) const;
  [[nodiscard]] Motion MeanMotion(std::span<const Index> particles) const;
  [[nodiscard]] Motion RingMotion(Index node) const;
  [[nodiscard]] Contact MakeContact(std::uint32_t tool);

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  ElasticForce elastic_;
  SurfaceCurvature curvature_;
  std::array<ToolMemory, kMaxTools> tools_;
  ComplianceProbe compliance_;
  ComplianceSolver* solver_ = nullptr;
};

}  // namespace fulcrum::physics
