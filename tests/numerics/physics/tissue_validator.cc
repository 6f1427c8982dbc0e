#include "tests/numerics/physics/tissue_validator.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "services/base/core/slit_sheet.h"

namespace fulcrum::physics {
namespace {

/// Error of a direction between two points a micrometre apart, in float.
constexpr float kUnitTolerance = 0.1f;

class Check {
 public:
  Check(TissueSimulation* simulation, const SceneView& scene)
      : simulation_(*simulation),
        scene_(scene),
        particles_(simulation->particles()),
        model_(simulation->model()),
        held_by_(particles_.particle_count(), -1) {}

  [[nodiscard]] std::string fault() const { return fault_.str(); }

  void Places(const TissueBounds& bounds, const StepReport& report) {
    for (Index p = 0; p < particles_.particle_count(); ++p) {
      const Vec3f x = At(p);
      if (!x.allFinite()) {
        fault_ << "particle " << p << " is not finite; ";
      } else if (Live(p) && (x - scene_.rest_position[p]).norm() > bounds.distance_m) {
        fault_ << "particle " << p << " is " << 1e3f * (x - scene_.rest_position[p]).norm() << " mm from rest; ";
      }
    }
    if (!(report.max_step_m <= bounds.speed_m_s * scene_.physics.dt_s)) {
      fault_ << "a step of " << 1e3f * report.max_step_m << " mm; ";
    }
    if (report.resets != 0) {
      fault_ << report.resets << " particles reset; ";
    }
    for (std::size_t i = 0; bounds.no_inverted && i < scene_.tets.size(); ++i) {
      const Tetrahedron& t = scene_.tets[i];
      if ((At(t[1]) - At(t[0])).cross(At(t[2]) - At(t[0])).dot(At(t[3]) - At(t[0])) <= 0.0f) {
        fault_ << "tetrahedron " << i << " is inverted; ";
      }
    }
  }

  void Grasps() {
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      const Grasp& grasp = simulation_.grasp(tool);
      if (grasp.holding() == grasp.held().empty()) {
        fault_ << "tool " << tool << " holds " << grasp.held().size() << " but its state is "
               << static_cast<int>(grasp.state()) << "; ";
      }
      for (const HeldParticle& held : grasp.held()) {
        if (held.particle >= particles_.particle_count()) {
          fault_ << "tool " << tool << " holds particle " << held.particle << ", which does not exist; ";
          continue;
        }
        if (!Live(held.particle) || scene_.inverse_mass[held.particle] == 0.0f) {
          fault_ << "tool " << tool << " holds particle " << held.particle << ", which is dead, loose or fixed; ";
        }
        if (held_by_[held.particle] >= 0) {
          fault_ << "particle " << held.particle << " is held twice; ";
        }
        if (!held.p_T.allFinite()) {
          fault_ << "particle " << held.particle << " is held at a position that is not finite; ";
        }
        held_by_[held.particle] = static_cast<int>(tool);
      }
    }
    for (Index p = 0; p < particles_.particle_count(); ++p) {
      const float expected = held_by_[p] >= 0 || !Live(p) ? 0.0f : scene_.inverse_mass[p];
      if (particles_.InverseMass(particles_.Ref(p)) != expected) {
        fault_ << "particle " << p << " has inverse mass " << particles_.InverseMass(particles_.Ref(p)) << " for "
               << expected << "; ";
      }
    }
  }

  void Contacts(float force_N) {
    const ToolCollision& collision = simulation_.collision();
    for (const ContactPair& pair : collision.pairs()) {
      const bool on_membrane = pair.triangle < collision.membrane_triangle_count();
      if (pair.triangle >= collision.membrane_triangle_count() + scene_.tube_surface.size()) {
        fault_ << "a contact on triangle " << pair.triangle << ", which does not exist; ";
      } else if (on_membrane && !model_.TriangleAlive(pair.triangle)) {
        fault_ << "a contact on triangle " << pair.triangle << ", which is cut; ";
      }
      for (const Index p : pair.particle) {
        if (p >= particles_.particle_count() || !Live(p)) {
          fault_ << "a contact with particle " << p << ", which is dead or does not exist; ";
        }
      }
    }
    std::vector<Index> by_base;
    for (Index p = 0; p < particles_.particle_count(); ++p) {
      const ParticleRef at = particles_.Ref(p);
      by_base.resize(std::max<std::size_t>(by_base.size(), at.base + std::size_t{1}), kNoIndex);
      by_base[at.base] = p;
    }
    for (const ContactRow& row : simulation_.rows()) {
      if (std::abs(row.normal.norm() - 1.0f) > kUnitTolerance || !std::isfinite(row.offset) ||
          !std::isfinite(row.force_N) || row.force_N < 0.0f) {
        fault_ << "a row of source " << row.source << " with normal " << row.normal.transpose() << ", offset "
               << row.offset << " and force " << row.force_N << "; ";
      }
      for (int k = 0; k < row.count; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const Index p = row.at[i].base < by_base.size() ? by_base[row.at[i].base] : kNoIndex;
        if (p == kNoIndex || !Live(p) || !std::isfinite(row.weight[i])) {
          fault_ << "a row on particle " << p << ", which is dead or does not exist; ";
        }
      }
    }
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      const DeviceContacts device = simulation_.Contacts(tool);
      for (std::uint32_t c = 0; c < device.count; ++c) {
        if (!(device.contacts[c].f_ref.norm() <= force_N)) {
          fault_ << "tool " << tool << " has a contact force of " << device.contacts[c].f_ref.norm() << " N; ";
        }
      }
    }
  }

  /// Pieces of the sheet by an independent search.
  void Debris() {
    const Index nodes = scene_.membrane.node_count(), cols = scene_.membrane.cols;
    std::vector<bool> bound(nodes, false), seen(nodes, false);
    for (const Binding& binding : scene_.bindings) {
      bound[binding.membrane - scene_.membrane.first] = true;
    }
    std::vector<std::vector<Index>> next(nodes);
    for (Index node = 0; node < nodes; ++node) {
      const Index ends[3] = {node + 1, node + cols, node + cols + 1};
      for (int d = 0; d < 3; ++d) {
        if (model_.EdgeAlive(node, d)) {
          next[node].push_back(ends[d]);
          next[ends[d]].push_back(node);
        }
      }
    }
    for (Index start = 0; start < nodes; ++start) {
      if (seen[start] || !model_.NodeAlive(start)) {
        continue;
      }
      std::vector<Index> piece{start};
      seen[start] = true;
      bool anchored = false;
      for (std::size_t i = 0; i < piece.size(); ++i) {
        anchored = anchored || bound[piece[i]] || scene_.inverse_mass[scene_.membrane.first + piece[i]] == 0.0f;
        for (const Index end : next[piece[i]]) {
          if (!seen[end]) {
            seen[end] = true;
            piece.push_back(end);
          }
        }
      }
      const bool debris = !anchored && piece.size() < kCrumbNodes;
      for (const Index node : piece) {
        if (!model_.IsAbsent(node) && model_.IsDebris(node) != debris) {
          fault_ << "node " << node << " of a piece of " << piece.size() << (anchored ? " that hangs on" : " that is")
                 << (anchored ? " something" : " loose") << " is " << (debris ? "no " : "") << "debris; ";
        }
      }
    }
  }

 private:
  [[nodiscard]] Vec3f At(Index p) const { return particles_.At(particles_.Ref(p)); }
  [[nodiscard]] bool Live(Index p) const {
    const Index first = scene_.membrane.first;
    return p < first || (model_.NodeAlive(p - first) && !model_.IsDebris(p - first));
  }

  TissueSimulation& simulation_;
  const SceneView& scene_;
  const ParticleStore& particles_;
  const TissueModel& model_;
  std::vector<int> held_by_;
  std::ostringstream fault_;
};

}  // namespace

std::string FaultOf(TissueSimulation* simulation, const SceneView& scene, const StepReport& report,
                    const TissueBounds& bounds) {
  Check check(simulation, scene);
  check.Places(bounds, report);
  check.Grasps();
  check.Contacts(bounds.force_N);
  check.Debris();
  return check.fault();
}

}  // namespace fulcrum::physics
