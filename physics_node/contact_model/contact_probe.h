// Local contact model that the servo evaluates between two steps of physics: position of the surface, its present
// force, and the dependence of the force on the position of the tool.
//
//   f_ref   force of the tissue on the tool [N]. With the force of the solver: of a grasp unfiltered; of a surface the
//           last step, kept near the median of kMedian, older ones changed by the stiffness for the way of the tip,
//           with x_ref the mean place of the tip meanwhile, as f_ref is a mean over the last period of a step. Else the
//           elastic force of the edges of the touched or held particles (elastic_force.h), low-passed over kFilterTime.
//           0 where there is a gap
//   u_c     displacement of the tissue at the contact relative to its surroundings, a ring at kRingRadius [m]: a tent
//           raised by the other tool is no dent of this one
//   k1, kt  skin [N/m]: a small disc of the membrane resists with E t independent of its size
//   k_body  kBodyOverSecant times the secant |f| / |u| [N/m], within [kMinBody, kMaxBody]. A sheet in tension stiffens
//           with depth, so its tangent lies above the secant; too low a stiffness makes the model active, too high a
//           stiffness only dissipates
//   b_body  kRelaxation k_body [N s/m]
//   kappa   curvatures [1/m] of the surface without this tool, as for u_c and p_s: before touch of the present shape,
//           in contact of the shape at rest (the present one has the dent), for the middle of a tip that rolls on it
//
// v_s     velocity of the surroundings, the ring of u_c [m/s]. Where k_body is that of the solver, which includes all
//         that yields, without the share of this tool's velocity with which the ring follows it at rest
//
// k_body and b_body come from a ComplianceSolver where the solver has one. Low-pass filters: y += h / (h + T) (x - y)
// with the step h and the time constant T = kFilterTime [s].
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "physics_node/collision/tool_collision.h"
#include "physics_node/contact_model/compliance_probe.h"
#include "physics_node/contact_model/elastic_force.h"
#include "physics_node/contact_model/surface_curvature.h"
#include "physics_node/grasp/grasp.h"

namespace fulcrum::physics {

/// Mean force of the tissue on a tool over a time, and the mean place of its tip meanwhile.
struct ToolForce {
  Vec3f force = Vec3f::Zero();  ///< [N]
  Vec3f tip = Vec3f::Zero();    ///< Frame W [m].
};

class ContactProbe {
 public:
  /// Largest published force on a tool [N]; a larger one damages rectal tissue.
  static constexpr float kForceCap_N = 15.0f;

  ContactProbe(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles);

  /// Contacts of one tool after a step of `step_s`: a grasp, or the nearest surface within range, or none.
  /// `solver_force`: from the solver, over that step (mode accurate, always); null: estimated from the edges.
  DeviceContacts Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision, const Grasp& grasp,
                        float step_s, const ToolForce* solver_force);
  /// Before an Update that does not directly follow the last one: discards the history of the filters.
  void Reset(std::uint32_t tool, const ToolPose& pose);
  /// Source of stiffness and viscosity; nullptr: estimated from force and dent.
  void SetComplianceSolver(ComplianceSolver* solver) { solver_ = solver; }
  [[nodiscard]] const Compliance& compliance(std::uint32_t tool) const { return compliance_.compliance(tool); }
  /// Force on the tool as last computed, low-passed [N].
  [[nodiscard]] Vec3f force(std::uint32_t tool) const { return tools_[tool].force; }

 private:
  static constexpr int kMedian = 3;  ///< Steps of the median filter of a surface's force.
  struct ToolMemory {
    ContactKind kind = ContactKind::kNone;
    std::uint32_t id = 0;
    Vec3f force = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();
    Vec3f u = Vec3f::Zero(), du = Vec3f::Zero(), v_s = Vec3f::Zero();
    float stiffness = 0;
    float Et = 0;  ///< Of the sheet that is nearest or held [N/m].
    std::vector<Index> touched;
    Vec3f tip = Vec3f::Zero();              ///< Of the tool in the last step.
    Vec3f x_ref = Vec3f::Zero();            ///< Tip position at which `force` acted.
    std::array<ToolForce, kMedian> forces;  ///< Of the last steps, the newest last.
    int steps = 0;                          ///< 0: it is empty.
  };
  /// Displacement from rest and velocity, averaged.
  struct Motion {
    Vec3f displacement = Vec3f::Zero(), velocity = Vec3f::Zero();
  };

  void Enter(ToolMemory* memory, ContactKind kind) const;
  void LowPass(ToolMemory* memory, const Vec3f& force, const Vec3f& u) const;
  void MedianFilter(std::uint32_t tool, const ToolForce& force);
  [[nodiscard]] Motion MeanMotion(std::span<const Index> particles) const;
  [[nodiscard]] Motion RingMotion(Index node) const;
  /// Of the sheet of a node of the membrane; of another particle that of `physics`.
  [[nodiscard]] float EtAt(Index particle) const;
  [[nodiscard]] Contact MakeContact(std::uint32_t tool);
  /// k1 of a surface, and of skin and body in series [N/m].
  [[nodiscard]] static float Skin(const ToolMemory& memory);
  [[nodiscard]] float InSeries(std::uint32_t tool) const;
  /// Weight of a new value in the low-pass filters.
  [[nodiscard]] float FilterShare() const;

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  std::optional<ElasticForce> elastic_;  ///< In modes without forces of the solver.
  std::vector<std::size_t> sheet_of_;    ///< By row of the membrane.
  std::vector<float> Et_of_;             ///< Likewise [N/m].
  SurfaceCurvature curvature_;
  std::array<ToolMemory, kMaxTools> tools_;
  ComplianceProbe compliance_;
  ComplianceSolver* solver_ = nullptr;
  float step_s_;  ///< Length of the last step.
};

}  // namespace fulcrum::physics
