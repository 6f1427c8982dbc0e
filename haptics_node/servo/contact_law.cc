#include "haptics_node/servo/contact_law.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::haptics {
namespace {

// Each term alone gives an upper bound of the root. Newton's method started above the root of a convex increasing
// function converges without overshoot; from the smaller bound five iterations reach double precision for any ratio of
// the terms.
constexpr int kNewtonIterations = 5;

double Smoothstep(double u) noexcept {
  const double c = std::clamp(u, 0.0, 1.0);
  return c * c * (3.0 - 2.0 * c);
}

double SkinForce(const ContactLaw& law, double stretch) noexcept {
  return (law.k1 + law.k3 * stretch * stretch) * stretch;
}

double SkinEnergy(const ContactLaw& law, double stretch) noexcept {
  const double square = stretch * stretch;
  return 0.5 * law.k1 * square + 0.25 * law.k3 * square * square;
}

/// One implicit step of Kb (q - q0) + Bb dq/dt = f: q becomes q_free + compliance f.
struct BodyStep {
  double compliance;
  double keep;  ///< q_free = keep q + (1 - keep) q0.
  BodyStep(const ContactLaw& law, double dt) noexcept {
    const double damping = law.b_body / dt;
    compliance = 1.0 / (damping + law.k_body);
    keep = damping * compliance;
  }
};

ContactForce StepGrasp(const ContactLaw& law, const Vec3d& x, const BodyStep& body, ContactState* state) noexcept {
  const Vec3d q_free = body.keep * state->q_t + (1.0 - body.keep) * law.q0_t;
  const Vec3d pull = x - state->anchor - q_free;
  const double depth = pull.norm();
  const Vec3d direction = depth > 0.0 ? Vec3d(pull / depth) : Vec3d::UnitZ();
  const double compliance = body.compliance + law.coupling;
  double stretch = SolveSkin(law.k1, law.k3, compliance, depth);
  double force = SkinForce(law, stretch);
  if (law.slip_force > 0.0 && force > law.slip_force) {
    // The tissue slips in the jaws: the anchor moves until the force equals the slip force.
    force = law.slip_force;
    stretch = SkinStretch(law.k1, law.k3, force);
    state->anchor = x - q_free - (stretch + compliance * force) * direction;
  }
  state->q_t = q_free + body.compliance * force * direction;
  ContactForce result;
  result.f_W = -force * direction;
  result.stored_J = SkinEnergy(law, stretch) + 0.5 * law.coupling * force * force +
                    0.5 * law.k_body * (state->q_t - law.q0_t).squaredNorm();
  return result;
}

ContactForce StepSurface(const ContactLaw& law, const Vec3d& x, const BodyStep& body, ContactState* state) noexcept {
  // Depth below the curved, undisturbed surface, and its normal there.
  const Vec3d d = x - law.p_s;
  const double d1 = law.e1.dot(d);
  const double d2 = law.e2.dot(d);
  const Vec3d n = (law.n + law.kappa1 * d1 * law.e1 + law.kappa2 * d2 * law.e2).normalized();
  const double depth = law.depth_offset - (law.n.dot(d) + 0.5 * (law.kappa1 * d1 * d1 + law.kappa2 * d2 * d2));
  const double compliance = body.compliance + law.coupling;

  const double q_free = body.keep * state->q + (1.0 - body.keep) * law.q0;
  const double stretch = SolveSkin(law.k1, law.k3, compliance, std::max(0.0, depth - q_free));
  const double normal_force = SkinForce(law, stretch);
  state->q = q_free + body.compliance * normal_force;

  const Vec3d qt_free = body.keep * state->q_t + (1.0 - body.keep) * law.q0_t;
  Vec3d drag = Vec3d::Zero();  // Tangential force of the tool on the tissue.
  if (law.kt > 0.0 && normal_force > 0.0) {
    const Vec3d lag = x - state->anchor - qt_free;
    const Vec3d stick = lag - n.dot(lag) * n;
    drag = law.kt / (1.0 + compliance * law.kt) * stick;
    const double limit = law.friction * normal_force;
    const double size = drag.norm();
    if (size > limit) drag *= limit / size;
  }
  state->q_t = qt_free + body.compliance * drag;
  // In sticking friction the anchor stays; in sliding friction and out of contact it follows the tool.
  const double along = law.kt > 0.0 ? 1.0 / law.kt + law.coupling : 0.0;
  state->anchor = x - state->q_t - along * drag;

  // Beyond the radius of validity that physics states, the force fades, so that the tangent plane does not act as an
  // infinite wall.
  const Vec3d away = x - law.x_ref;
  const double distance = (away - law.n.dot(away) * law.n).norm();
  const double trust = law.radius > 0.0 ? 1.0 - Smoothstep(distance / law.radius - 1.0) : 1.0;

  ContactForce result;
  result.f_W = trust * (normal_force * n - drag);
  result.stored_J =
      trust * (SkinEnergy(law, stretch) + 0.5 * law.coupling * normal_force * normal_force +
               0.5 * law.k_body * (state->q - law.q0) * (state->q - law.q0) + 0.5 * along * drag.squaredNorm() +
               0.5 * law.k_body * (state->q_t - law.q0_t).squaredNorm());
  return result;
}

}  // namespace

double SolveSkin(double k1, double k3, double compliance, double depth) noexcept {
  if (depth <= 0.0) return 0.0;
  const double linear = 1.0 + compliance * k1;
  const double cubic = compliance * k3;
  double stretch = depth / linear;
  if (cubic <= 0.0) return stretch;
  stretch = std::min(stretch, std::cbrt(depth / cubic));
  for (int i = 0; i < kNewtonIterations; ++i) {
    const double square = stretch * stretch;
    stretch -= (linear * stretch + cubic * square * stretch - depth) / (linear + 3.0 * cubic * square);
  }
  return stretch;
}

double SkinStretch(double k1, double k3, double force) noexcept {
  if (force <= 0.0) return 0.0;
  double stretch = force / k1;
  if (k3 <= 0.0) return stretch;
  stretch = std::min(stretch, std::cbrt(force / k3));
  for (int i = 0; i < kNewtonIterations; ++i) {
    const double square = stretch * stretch;
    stretch -= (k1 * stretch + k3 * square * stretch - force) / (k1 + 3.0 * k3 * square);
  }
  return stretch;
}

ContactLaw MakeContactLaw(const Contact& contact, double coupling, ContactState* state) noexcept {
  ContactLaw law;
  law.kind = contact.kind;
  law.id = contact.id;
  law.x_ref = contact.x_ref.cast<double>();
  law.n = contact.n.cast<double>().normalized();
  const Vec3d e1 = contact.e1.cast<double>();
  const Vec3d across = e1 - law.n.dot(e1) * law.n;
  law.e1 = across.squaredNorm() > 0.25 ? Vec3d(across.normalized()) : law.n.unitOrthogonal();
  law.e2 = law.n.cross(law.e1);
  law.p_s = contact.p_s.cast<double>();
  law.v_s = contact.v_s.cast<double>();
  law.k1 = contact.k1;
  law.k3 = contact.k3;
  law.kt = contact.kt;
  law.k_body = contact.k_body;
  law.b_body = contact.b_body;
  law.friction = contact.friction;
  law.kappa1 = contact.kappa1;
  law.kappa2 = contact.kappa2;
  law.slip_force = contact.slip_force;
  law.radius = contact.radius;
  law.coupling = coupling;

  // The body spring's rest displacement q0 follows from the known force, displacement and rate: Kb (q - q0) + Bb dq/dt
  // = f.
  const Vec3d f = contact.f_ref.cast<double>();
  const Vec3d u = contact.u_c.cast<double>();
  const Vec3d du = contact.du_c.cast<double>();
  *state = {};
  if (law.kind == ContactKind::kGrasp) {
    state->q_t = u;
    law.q0_t = u + (law.b_body * du + f) / law.k_body;
    const double force = f.norm();
    const double stretch = SkinStretch(law.k1, law.k3, force);
    state->anchor = law.x_ref - u;
    if (force > 0.0) state->anchor += stretch * (f / force);
    return law;
  }
  const double normal_force = std::max(0.0, law.n.dot(f));
  state->q = -law.n.dot(u);
  law.q0 = state->q + (law.b_body * -law.n.dot(du) - normal_force) / law.k_body;
  // Depth at x_ref: from the reference force in contact, from the gap before contact.
  const double stretch = normal_force > 0.0 ? SkinStretch(law.k1, law.k3, normal_force) : -contact.gap;
  const Vec3d d = law.x_ref - law.p_s;
  const double d1 = law.e1.dot(d);
  const double d2 = law.e2.dot(d);
  law.depth_offset = state->q + stretch + (law.n.dot(d) + 0.5 * (law.kappa1 * d1 * d1 + law.kappa2 * d2 * d2));

  const Vec3d drag = -(f - law.n.dot(f) * law.n);
  state->q_t = u - law.n.dot(u) * law.n;
  law.q0_t = state->q_t + (law.b_body * (du - law.n.dot(du) * law.n) - drag) / law.k_body;
  state->anchor = law.x_ref - state->q_t;
  if (law.kt > 0.0) state->anchor -= drag / law.kt;
  return law;
}

ContactForce StepContact(const ContactLaw& law, const Vec3d& x, double t, double dt, ContactState* state) noexcept {
  if (law.kind == ContactKind::kNone) return {};
  const BodyStep body(law, dt);
  const Vec3d x_still = x - t * law.v_s;  // Tip relative to the moving surface.
  return law.kind == ContactKind::kGrasp ? StepGrasp(law, x_still, body, state)
                                         : StepSurface(law, x_still, body, state);
}

}  // namespace fulcrum::haptics
