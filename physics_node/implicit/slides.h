// Two solids that lie against each other and slide: a vertex of one keeps its distance from the surface of the other as
// that surface is now, and nothing holds it along the surface.
//
//   E = k/2 (g - g0)^2,    g = distance of x_v from the surface, negative inside; g0: at rest
//   dE = k (g - g0) n . (dx_v - sum_i b_i dx_i),    n = (x_v - sum_i b_i x_i) / g
//   K = kt I + m m^T,    m = sqrt(k - kt) n,    kt = k (g - g0) / g from 0 to k at an edge or a corner, else 0
//
//   b_i  barycentric coordinates of the nearest point in its triangle; k stiffness [N/m]
//
// The nearest point makes the derivative of g by b_i zero, so the force is the exact gradient, also while the surface
// turns and the point moves on to other triangles: E depends on the positions only, and the force passes through x_v
// and the point, without a moment. The nearest point is followed from triangle to triangle, as in TissueCollision.
// K is not below the second derivative but for terms of (g - g0) / (height of the triangle).
#pragma once

#include <span>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/element.h"
#include "physics_node/implicit/regions.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics::implicit {

class Slides {
 public:
  Slides(const ElasticModel& model, const ParticleStore& particles);

  [[nodiscard]] bool empty() const { return slides_.empty(); }
  /// The nearest points are looked for from where they are at rest, over the whole surface: positions have been set.
  void Restart();
  /// Finds the nearest points at `place`, and which slides join particles that are computed.
  void Linearise(const float* place, const Regions& regions);
  /// Of all, at the last Linearise; those of particles that are not computed at an earlier one.
  [[nodiscard]] std::span<const Element> elements() const { return elements_; }
  /// Of each: how far the surface has turned since rest, from 0 to 1 (sin^2 of the angle).
  [[nodiscard]] std::span<const float> turned() const { return turned_; }
  /// residual += forces of the last Linearise.
  void AddForce(float* residual) const;
  /// K p, for AddProduct; returns p . K p.
  double Multiply(const float* p);
  /// out += scale * the last product.
  void AddProduct(float scale, float* out) const;
  /// Of what is computed, at `place` [J].
  [[nodiscard]] double Energy(const float* place) const;

 private:
  struct Slide {
    ParticleRef vertex;
    float gap_m = 0, stiffness = 0;  ///< At rest [m]; [N/m]
    Index rest = 0, triangle = 0;    ///< Of triangles_: the nearest one at rest, and now; kNoIndex: not known.
    Vec3f rest_normal = Vec3f::UnitZ();
  };
  struct Foot {
    Index triangle = 0;
    std::array<float, 3> barycentric{};
    Vec3f normal = Vec3f::Zero();  ///< n, unit.
    float gap_m = 0;               ///< g
    bool is_inside = false;        ///< Of the triangle, not on its rim.
  };
  [[nodiscard]] std::array<Vec3f, 3> Corners(const float* place, Index triangle) const;
  /// Walks over the surface from the slide's triangle.
  [[nodiscard]] Foot FootOf(const float* place, const Slide& slide) const;

  std::vector<Slide> slides_;
  std::vector<Element> elements_;    ///< By slide.
  std::vector<float> force_;         ///< Along the normal, by slide [N].
  std::vector<Vec3f> normal_;        ///< By slide.
  std::vector<float> turned_;        ///< By slide.
  std::vector<std::uint32_t> acts_;  ///< Slides of particles that are computed.
  std::vector<Vec3f> product_;       ///< By entry of acts_.
  /// Of the surfaces that something slides on. By triangle: itself, then those that share a corner; compressed rows.
  std::vector<Triangle> triangles_;
  std::vector<Index> ring_start_, ring_;
};

}  // namespace fulcrum::physics::implicit
