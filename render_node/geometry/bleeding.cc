#include "render_node/geometry/bleeding.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr double kStep_s = 0.02;
constexpr int kMostSteps = 50;  // Maximum number of steps per update; the rest of a longer pause is skipped.
constexpr int kDropEvery = 14;  // Steps between two drops.
constexpr double kClots_s = 8;  // Assumed: after this time a small vessel has closed by itself.
constexpr int kRim = 16;        // Number of points around a cut that are checked for vessels.
constexpr float kRimRadii[] = {0.0005f, 0.0008f};  // [m]
constexpr float kVessel = 0.75f;                   // Of the pattern: from 0.5 on, a slit of 30 mm bled in six places.
constexpr std::uint8_t kSealed = 128;
constexpr float kRun_m = 0.020f;
constexpr float kSpeed_m_s = 0.009f;  // On a vertical wall.
constexpr float kLeastSlope = 0.15f;  // Lower limit of the slope: a film also creeps on a horizontal surface.
constexpr float kSameVessel_m = 0.006f;
constexpr float kPool_m = 0.0018f;  // Radius at the source and where a drop stops.
constexpr float kDrop_m = 0.0012f;  // Radius of a full drop.
constexpr float kStray = 0.4f;      // [rad]
constexpr float kThick = 1.0f, kMiddle = 0.6f, kThin = 0.35f;

}  // namespace

Bleeding::Bleeding(const SceneView& scene, std::span<const std::uint8_t> vessels, int texels, float per_m)
    : scene_(scene), vessels_(vessels), texels_(texels), per_m_(per_m) {}

float Bleeding::VesselAt(const Vec2f& material) const {
  const auto wrapped = [this](float metres) {
    const float place = metres * per_m_;
    return std::min(texels_ - 1, static_cast<int>((place - std::floor(place)) * static_cast<float>(texels_)));
  };
  return static_cast<float>(vessels_[4 * TexelIndex(wrapped(material.x()), wrapped(material.y()), texels_) + 3]) / 255;
}

void Bleeding::Cut(const Vec2f& material, const Atlas& atlas, double session_time_s) {
  Vec2f best = material;
  float strongest = kVessel;
  for (const float radius : kRimRadii) {
    for (int k = 0; k < kRim; ++k) {
      const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kRim;
      const Vec2f place = material + radius * Vec2f(std::cos(angle), std::sin(angle));
      const auto texel = atlas.At(place);
      if (texel && (*texel)[3] >= 128 && (*texel)[1] < kSealed && VesselAt(place) > strongest) {
        strongest = VesselAt(place);
        best = place;
      }
    }
  }
  const bool known = std::any_of(sources_.begin(), sources_.end(), [&](const Source& source) {
    return source.open && (source.material - best).norm() < kSameVessel_m;
  });
  if (strongest <= kVessel || known || scene_.membrane_material.empty()) {
    return;
  }
  if (sources() == 0 && drops() == 0) {
    time_s_ = session_time_s;
  }
  Index nearest = 0;
  for (Index node = 1; node < scene_.membrane.node_count(); ++node) {
    if ((scene_.membrane_material[node] - best).squaredNorm() <
        (scene_.membrane_material[nearest] - best).squaredNorm()) {
      nearest = node;
    }
  }
  sources_[next_source_] = {true, best, nearest, 0};
  next_source_ = (next_source_ + 1) % sources_.size();
}

int Bleeding::sources() const {
  return static_cast<int>(std::count_if(sources_.begin(), sources_.end(), [](const Source& s) { return s.open; }));
}

int Bleeding::drops() const {
  return static_cast<int>(std::count_if(drops_.begin(), drops_.end(), [](const Drop& d) { return d.left_m > 0; }));
}

bool Bleeding::Update(double session_time_s, const MembraneMesh& membrane, Atlas* atlas) {
  bool changed = false;
  if (sources() == 0 && drops() == 0) {
    return changed;
  }
  time_s_ = std::max(time_s_, session_time_s - kMostSteps * kStep_s);
  for (; time_s_ + kStep_s <= session_time_s; time_s_ += kStep_s) {
    for (Source& source : sources_) {
      if (source.open) {
        changed |= Bleed(&source, atlas);
      }
    }
    for (Drop& drop : drops_) {
      if (drop.left_m > 0) {
        changed |= Run(&drop, membrane.positions(), atlas);
      }
    }
  }
  return changed;
}

bool Bleeding::Bleed(Source* source, Atlas* atlas) {
  const auto texel = atlas->At(source->material);
  if (!texel || (*texel)[3] < 128 || (*texel)[1] >= kSealed || source->steps >= kClots_s / kStep_s) {
    source->open = false;
    return false;
  }
  if (source->steps++ % kDropEvery != 0) {
    return false;
  }
  drops_[next_drop_] = {kRun_m, source->material, source->node, 2.39996f * static_cast<float>(next_drop_)};
  next_drop_ = (next_drop_ + 1) % drops_.size();
  const float grown = std::min(1.0f, 0.5f + 0.004f * static_cast<float>(source->steps));
  return atlas->Stain(source->material, grown * kPool_m, kThick);
}

bool Bleeding::Run(Drop* drop, std::span<const Vec3f> positions, Atlas* atlas) {
  const Vec2f downhill = Downhill(drop->node, positions);
  const float slope = downhill.norm();
  const float travel = static_cast<float>(kStep_s) * kSpeed_m_s * std::max(slope, kLeastSlope);
  if (slope > 0) {
    // Tissue is uneven: drops from one source take slightly different paths.
    const float stray = kStray * std::sin(1400 * drop->material.x() + 900 * drop->material.y() + drop->phase);
    drop->material += travel / slope * (Eigen::Rotation2Df(stray) * downhill);
  }
  drop->left_m -= travel;
  drop->node = NearestNode(drop->material, drop->node);
  // It leaves a thin film, and what is left of it gathers where it stops.
  if (drop->left_m <= 0) return atlas->Stain(drop->material, 1.2f * kPool_m, kThick);
  const float uneven = 0.8f + 0.2f * std::sin(2100 * drop->material.y() + drop->phase);
  return atlas->Stain(drop->material, uneven * kDrop_m, kThin + (kMiddle - kThin) * drop->left_m / kRun_m);
}

// Walks to the neighbour nearest to the target until none is nearer; this works because s and t increase monotonically
// with row and column.
Index Bleeding::NearestNode(const Vec2f& material, Index start) const {
  const std::uint32_t rows = scene_.membrane.rows, cols = scene_.membrane.cols;
  Index best = start;
  for (;;) {
    const Index here = best;
    const std::uint32_t row = here / cols, col = here % cols;
    for (std::uint32_t r = row > 0 ? row - 1 : 0; r <= std::min(row + 1, rows - 1); ++r) {
      for (std::uint32_t c = col > 0 ? col - 1 : 0; c <= std::min(col + 1, cols - 1); ++c) {
        const Index other = r * cols + c;
        if ((scene_.membrane_material[other] - material).squaredNorm() <
            (scene_.membrane_material[best] - material).squaredNorm()) {
          best = other;
        }
      }
    }
    if (best == here) {
      return best;
    }
  }
}

/// Direction of steepest descent in (s, t), with the sine of the slope as its length, from the differences to the
/// neighbours.
Vec2f Bleeding::Downhill(Index node, std::span<const Vec3f> positions) const {
  const std::uint32_t rows = scene_.membrane.rows, cols = scene_.membrane.cols;
  const std::uint32_t row = node / cols, col = node % cols;
  const auto is_edge = [&](Index at, Index direction) { return scene_.membrane_rest_length[3 * at + direction] > 0; };
  const Index up = row > 0 && is_edge(node - cols, 1) ? node - cols : node;
  const Index down = row + 1 < rows && is_edge(node, 1) ? node + cols : node;
  const Index left = col > 0 && is_edge(node - 1, 0) ? node - 1 : node;
  const Index right = col + 1 < cols && is_edge(node, 0) ? node + 1 : node;
  Eigen::Matrix2f step;
  step << (scene_.membrane_material[right] - scene_.membrane_material[left]).transpose(),
      (scene_.membrane_material[down] - scene_.membrane_material[up]).transpose();
  if (std::abs(step.determinant()) < 1e-12f) {  // [m^2]: a grid of less than a micrometre.
    return Vec2f::Zero();
  }
  const Vec2f rise(positions[right].z() - positions[left].z(), positions[down].z() - positions[up].z());
  const Vec2f gradient = step.inverse() * rise;
  return -gradient / std::sqrt(1 + gradient.squaredNorm());
}

}  // namespace fulcrum::render
