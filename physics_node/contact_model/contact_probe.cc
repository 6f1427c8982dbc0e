#include "physics_node/contact_model/contact_probe.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/base/core/sheets.h"

namespace fulcrum::physics {
namespace {

/// Distance before touch from which on a contact is published [m].
constexpr float kContactRange = 0.010f;
/// Time constant of the low-pass filters of measured quantities [s].
constexpr float kFilterTime = 0.03f;
/// b_body / k_body [s], without a ComplianceSolver. Assumed.
constexpr float kRelaxation = 0.02f;
/// Range of k_body in the local model [N/m]. Assumed.
constexpr float kMinBody = 30.0f, kMaxBody = 5000.0f;
/// k_body of a new contact over E t, until a secant is measured. Assumed.
constexpr float kFirstBodyOverEt = 0.3f;
/// k1 / (E t), range of k1 [N/m], and kt / k1. Assumed.
constexpr float kSkinOverEt = 2.0f, kMinSkin = 50.0f, kMaxSkin = 1e4f, kTangentialOverSkin = 0.5f;
/// k_body over the secant f / u: the tangent of a sheet in tension lies above it.
constexpr float kBodyOverSecant = 2.0f;
/// k1 of a grasp [N/m]: between the jaws no skin yields.
constexpr float kJaws = 1e4f;
/// Largest p_ext, the power that breathing or the other tool may bring into a contact [W].
constexpr float kMaxExternal = 0.05f;
/// Radius of validity of the model around a surface contact and a grasp [m].
constexpr float kSurfaceRadius = 0.012f, kGraspRadius = 0.03f;
/// Least dent for which a secant is above the noise [m].
constexpr float kMinDent = 0.0005f;
/// Bounds of what is measured, beyond any use: displacement [m], its rate [m/s], velocity of the surroundings [m/s].
constexpr float kMaxDisplacement = 0.2f, kMaxRate = 2.0f, kMaxSurroundings = 1.0f;
/// Farthest from the median that the force of a step counts as it is: relative to the median, and at zero force [N].
constexpr float kNearMedian = 0.1f, kNearMedian_N = 0.01f;
/// Largest coefficient of friction in a Contact.
constexpr float kMaxFriction = 2.0f;
/// Least length of the averaged normal for it to have a direction.
constexpr float kMinNormal = 0.1f;
/// Radius of the ring of nodes that represents the surroundings of a contact [m], and the share of it in rows and
/// columns for its diagonal nodes, about 1 / sqrt 2, as a fraction of integers.
constexpr float kRingRadius = 0.007f;
constexpr int kDiagonalShare = 7, kDiagonalWhole = 10;

Vec3f Limited(const Vec3f& v, float limit) {
  const float norm = v.norm();
  return norm > limit ? Vec3f(v * (limit / norm)) : v;
}

/// The part of a tool that touches tissue.
ToolPart TipPart(const TissueScene& scene, std::uint32_t tool) {
  return scene.tools[tool].kind == ToolKind::kHook ? ToolPart::kTip : ToolPart::kJaw;
}

}  // namespace

ContactProbe::ContactProbe(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene),
      model_(model),
      particles_(particles),
      sheet_of_(SheetOfRows(scene)),
      curvature_(scene, model, particles),
      compliance_(scene.physics.dt_s),
      step_s_(scene.physics.dt_s) {
  for (const SheetProperties& of_row : PropertiesOfRows(scene)) Et_of_.push_back(of_row.Et_N_per_m);
  if (scene.physics.mode != PhysicsMode::kAccurate) elastic_.emplace(scene, model, particles);
}

float ContactProbe::FilterShare() const { return step_s_ / (step_s_ + kFilterTime); }

ContactProbe::Motion ContactProbe::MeanMotion(std::span<const Index> particles) const {
  Motion mean;
  for (const Index p : particles) {
    const ParticleRef at = particles_->Ref(p);
    mean.displacement += particles_->At(at) - scene_.rest_position[p];
    mean.velocity += particles_->At(at) - particles_->Previous(at);
  }
  const float scale = particles.empty() ? 0.0f : 1.0f / static_cast<float>(particles.size());
  mean.displacement *= scale;
  // In mode xpbd the previous positions are those of the last substep.
  const auto substeps = static_cast<float>(scene_.physics.mode == PhysicsMode::kXpbd ? scene_.physics.substeps : 1);
  mean.velocity *= scale * substeps / step_s_;
  return mean;
}

ContactProbe::Motion ContactProbe::RingMotion(Index node) const {
  const auto cols = static_cast<int>(model_->cols()), rows = static_cast<int>(model_->rows());
  const int row = static_cast<int>(node) / cols, col = static_cast<int>(node) % cols;
  const auto steps = [&](int direction) {
    const float length = scene_.membrane_rest_length[3 * node + static_cast<Index>(direction)];
    return length > 0.0f ? std::max(1, static_cast<int>(std::lround(kRingRadius / length))) : 1;
  };
  const int dc = steps(0), dr = steps(1);
  std::array<Index, 8> ring{};
  std::size_t count = 0;
  const int diagonal_dr = dr * kDiagonalShare / kDiagonalWhole, diagonal_dc = dc * kDiagonalShare / kDiagonalWhole;
  for (const auto& [r, c] : {std::pair{-dr, 0},
                             {dr, 0},
                             {0, -dc},
                             {0, dc},
                             {-diagonal_dr, -diagonal_dc},
                             {-diagonal_dr, diagonal_dc},
                             {diagonal_dr, -diagonal_dc},
                             {diagonal_dr, diagonal_dc}}) {
    if (row + r >= 0 && row + r < rows && col + c >= 0 && col + c < cols) {
      const auto at = static_cast<Index>((row + r) * cols + col + c);
      const bool is_same = sheet_of_[static_cast<std::size_t>(row + r)] == sheet_of_[static_cast<std::size_t>(row)];
      if (is_same && model_->NodeAlive(at) && !model_->IsAbsent(at)) {
        ring[count++] = scene_.membrane.first + at;
      }
    }
  }
  return MeanMotion({ring.data(), count});
}

void ContactProbe::Enter(ToolMemory* memory, ContactKind kind) const {
  if (memory->kind == kind) {
    return;
  }
  std::vector<Index> buffer = std::move(memory->touched);
  const float Et = memory->Et;
  const Vec3f tip = memory->tip;
  const Vec3f force =
      memory->kind == ContactKind::kNone || kind == ContactKind::kNone ? Vec3f::Zero().eval() : memory->force;
  *memory = {};
  memory->touched = std::move(buffer);
  memory->Et = Et;
  memory->kind = kind;
  memory->tip = memory->x_ref = tip;
  memory->force = force;  // When jaws close on tissue that they press, the force continues.
  memory->stiffness = std::clamp(kFirstBodyOverEt * Et, kMinBody, kMaxBody);
}

void ContactProbe::LowPass(ToolMemory* memory, const Vec3f& force, const Vec3f& u) const {
  const float share = FilterShare();
  memory->force += share * (Limited(force, ContactProbe::kForceCap_N) - memory->force);
  const Vec3f before = memory->u;
  memory->u += share * (Limited(u, kMaxDisplacement) - memory->u);
  memory->du += share * (Limited((memory->u - before) / step_s_, kMaxRate) - memory->du);
  const float dent = memory->u.norm();
  if (dent > kMinDent && memory->force.norm() > 0.0f) {
    const float secant = std::clamp(kBodyOverSecant * memory->force.norm() / dent, kMinBody, kMaxBody);
    memory->stiffness += share * (secant - memory->stiffness);
  }
}

float ContactProbe::EtAt(Index particle) const {
  const bool is_node = particle >= scene_.membrane.first && particle < scene_.rest_position.size();
  return is_node ? Et_of_[(particle - scene_.membrane.first) / scene_.membrane.cols]
                 : scene_.physics.membrane_Et_N_per_m;
}

float ContactProbe::Skin(const ToolMemory& memory) { return std::clamp(kSkinOverEt * memory.Et, kMinSkin, kMaxSkin); }

float ContactProbe::InSeries(std::uint32_t tool) const {
  const Compliance& measured = compliance_.compliance(tool);
  return 1.0f / (1.0f / Skin(tools_[tool]) + 1.0f / (measured.known ? measured.stiffness : tools_[tool].stiffness));
}

void ContactProbe::MedianFilter(std::uint32_t tool, const ToolForce& force) {
  ToolMemory& memory = tools_[tool];
  const ToolForce newest{Limited(force.force, ContactProbe::kForceCap_N), force.tip};
  memory.x_ref = newest.tip;
  if (memory.kind == ContactKind::kGrasp) {
    memory.force = newest.force;
    return;
  }
  if (std::exchange(memory.steps, 1) == 0) {
    memory.forces.fill(newest);
  }
  std::rotate(memory.forces.begin(), memory.forces.begin() + 1, memory.forces.end());
  memory.forces.back() = newest;
  const float stiffness = InSeries(tool);
  std::array<Vec3f, kMedian> now;
  std::transform(memory.forces.begin(), memory.forces.end(), now.begin(), [&](const ToolForce& then) {
    // Without pull: a surface only pushes.
    const float push = memory.normal.dot(then.force);
    const float change = stiffness * memory.normal.dot(then.tip - newest.tip);
    return Vec3f(then.force + std::max(change, -std::max(push, 0.0f)) * memory.normal);
  });
  for (int axis = 0; axis < 3; ++axis) {
    std::nth_element(now.begin(), now.begin() + kMedian / 2, now.end(),
                     [axis](const Vec3f& a, const Vec3f& b) { return a[axis] < b[axis]; });
    memory.force[axis] = now[kMedian / 2][axis];
  }
  const float near = kNearMedian * memory.force.norm() + kNearMedian_N;
  memory.force = Limited(memory.force + Limited(newest.force - memory.force, near), ContactProbe::kForceCap_N);
}

Contact ContactProbe::MakeContact(std::uint32_t tool) {
  const ToolMemory& memory = tools_[tool];
  const PhysicsParams& params = scene_.physics;
  Contact contact;
  contact.kind = memory.kind;
  contact.id = memory.id;
  contact.x_ref = memory.x_ref;
  contact.f_ref = memory.force;
  contact.n = memory.normal;
  contact.e1 = memory.normal.unitOrthogonal();
  contact.u_c = memory.u;
  contact.du_c = memory.du;
  contact.v_s = memory.v_s;
  contact.k1 = Skin(memory);
  contact.kt = kTangentialOverSkin * contact.k1;
  contact.k_body = memory.stiffness;
  contact.b_body = kRelaxation * memory.stiffness;
  const Compliance& measured = compliance_.Update(tool, memory.touched, memory.normal, solver_);
  if (measured.known) {
    contact.k_body = measured.stiffness;
    contact.b_body = measured.viscosity;
  }
  contact.friction = std::min(params.friction, kMaxFriction);
  return contact;
}

void ContactProbe::Reset(std::uint32_t tool, const ToolPose& pose) {
  ToolMemory& memory = tools_[tool];
  memory.tip = pose.p_WT;
  if (memory.kind != ContactKind::kNone) {
    const std::uint32_t id = memory.id;
    Enter(&memory, ContactKind::kNone);
    memory.id = id;
  }
  compliance_.Reset(tool);
}

DeviceContacts ContactProbe::Update(std::uint32_t tool, const ToolPose& pose, const ToolCollision& collision,
                                    const Grasp& grasp, float step_s, const ToolForce* solver_force) {
  step_s_ = step_s;
  ToolMemory& memory = tools_[tool];
  memory.x_ref = pose.p_WT;
  const Vec3f tool_velocity = (pose.p_WT - std::exchange(memory.tip, pose.p_WT)) / step_s;
  DeviceContacts device;
  device.force_cap_N = ContactProbe::kForceCap_N;
  const auto force = [&] {
    if (memory.touched.empty()) return Vec3f(Vec3f::Zero());
    return solver_force != nullptr ? solver_force->force : elastic_->OnSet(memory.touched);
  };
  const auto enter = [&](ContactKind kind) {
    if (memory.kind != kind) {
      const std::uint32_t id = memory.id;
      Enter(&memory, kind);
      compliance_.Reset(tool);
      memory.id = kind == ContactKind::kNone ? id : id + 1;
    }
  };
  if (grasp.holding()) {
    // Nodes of the membrane come after the vertices of solids.
    memory.Et =
        EtAt(grasp.held().empty() ? kNoIndex : std::ranges::max(grasp.held(), {}, &HeldParticle::particle).particle);
    enter(ContactKind::kGrasp);
    memory.touched.clear();
    for (const HeldParticle& held : grasp.held()) {
      memory.touched.push_back(held.particle);
    }
    std::sort(memory.touched.begin(), memory.touched.end());
    LowPass(&memory, force(), MeanMotion(memory.touched).displacement);
    if (solver_force != nullptr) {
      MedianFilter(tool, *solver_force);
      memory.u = MeanMotion(memory.touched).displacement;
      memory.du = Limited(tool_velocity, kMaxRate);  // Held tissue moves with the tool.
    }
    memory.normal = pose.q_WT * -Vec3f::UnitZ();
    Contact contact = MakeContact(tool);
    contact.p_s = pose.p_WT - memory.u;
    contact.k1 = kJaws;
    contact.slip_force = Grasp::GripForce(scene_.physics, pose.jaw_rad);
    contact.radius = kGraspRadius;
    device.contacts[device.count++] = contact;
    return device;
  }
  const Capsule working = WorkingLine(scene_.tools[tool], pose);
  const SurfacePoint nearest = collision.Nearest(working, kContactRange);
  collision.TouchedParticles(tool, &memory.touched);
  const bool touching = !memory.touched.empty();
  if (!nearest.found && !touching) {
    enter(ContactKind::kNone);
    return device;
  }
  const bool at_sheet = nearest.found && nearest.on_membrane;
  memory.Et = EtAt(at_sheet ? scene_.membrane.first + model_->TriangleNodes(nearest.triangle)[0] : kNoIndex);
  enter(ContactKind::kSurface);
  Vec3f normal = Vec3f::Zero();
  for (const ContactPair& pair : collision.pairs()) {
    if (pair.touching && pair.capsule / kMaxCapsules == tool) {
      normal -= pair.push;
    }
  }
  if (!touching) {
    normal = nearest.closest.on_segment - nearest.closest.on_triangle;
  }
  if (normal.norm() > 0.0f) {
    memory.normal = memory.normal.isZero()
                        ? normal.normalized()
                        : Vec3f(memory.normal + FilterShare() * (normal.normalized() - memory.normal));
  }
  // The average of opposite normals can vanish; any unit vector will do for that step.
  memory.normal = memory.normal.norm() > kMinNormal ? memory.normal.normalized() : Vec3f::UnitZ();

  Motion around;
  if (at_sheet) {
    around = RingMotion(model_->TriangleNodes(nearest.triangle)[0]);
  }
  if (solver_ != nullptr && touching) {
    // At rest the ring follows a dent with this share; where something else moves both, it is only a bound.
    const float of_ring = memory.normal.dot(around.displacement),
                of_dent = memory.normal.dot(MeanMotion(memory.touched).displacement);
    const float follows = of_dent < -kMinDent ? std::clamp(of_ring / of_dent, 0.0f, 1.0f) : 0.0f;
    around.velocity -= follows * memory.normal.dot(tool_velocity) * memory.normal;
  }
  memory.v_s += FilterShare() * (Limited(around.velocity, kMaxSurroundings) - memory.v_s);
  LowPass(&memory, force(),
          touching ? Vec3f(MeanMotion(memory.touched).displacement - around.displacement) : Vec3f(Vec3f::Zero()));

  memory.steps = touching ? memory.steps : 0;
  if (solver_force != nullptr && touching) {
    MedianFilter(tool, *solver_force);
    memory.du = Limited(memory.normal.dot(tool_velocity) * memory.normal, kMaxRate);
  }
  Contact contact = MakeContact(tool);
  const float push = std::max(0.0f, memory.normal.dot(memory.force));
  const float dent = -memory.normal.dot(memory.u);
  const float margin = collision.MarginAt(at_sheet ? nearest.triangle : kNoIndex, TipPart(scene_, tool));
  contact.gap = touching ? 0.0f : std::max(0.0f, nearest.gap - margin);
  // What is left in the filter after contact is no force: the servo would take it for the depth instead of the gap.
  if (contact.gap > 0.0f) contact.f_ref.setZero();
  contact.p_s = pose.p_WT + (touching ? push / contact.k1 + dent : -contact.gap) * memory.normal;
  const PrincipalCurvatures surface =
      RolledOver(curvature_.At(nearest, touching, memory.normal), scene_.tools[tool].tip_radius_m + margin);
  contact.e1 = surface.e1;
  contact.kappa1 = surface.kappa1;
  contact.kappa2 = surface.kappa2;
  contact.radius = kSurfaceRadius;
  device.p_ext_W = std::clamp(contact.f_ref.dot(memory.v_s), 0.0f, kMaxExternal);
  device.contacts[device.count++] = contact;
  return device;
}

}  // namespace fulcrum::physics
