#include "render_node/scene_graph/smoke.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "render_node/scene_graph/program.h"

namespace fulcrum::render {
namespace {

constexpr double kLeastInterval_s = 0.08;
constexpr double kLife_s = 2.2;
constexpr float kRise_m_s = 0.016f;
constexpr float kDrift_m_s = 0.005f;
constexpr float kFirstRadius_m = 0.0015f;
constexpr float kGrowth_m_s = 0.0060f;
constexpr float kOpacity = 0.50f;
// Assumed: the gas is exchanged in 6 s. Cutting without a pause then keeps 75 puffs in it: a haze of 0.25.
constexpr double kClears_s = 6;
constexpr double kHalfHaze = 45;  // [puffs]
constexpr double kDensest = 0.40;
constexpr double kHazeStep = 1.0 / 64;

}  // namespace

Smoke::Smoke() : mesh_("smoke", true) {
  mesh_.state()->setAttributeAndModes(MakeProgram("smoke.vert", "smoke.frag"));
  Update(0);
}

void Smoke::Add(const Vec3f& p_W, double session_time_s) {
  if (session_time_s - last_birth_s_ < kLeastInterval_s) {
    return;
  }
  puffs_in_gas_ = puffs_in_gas_ * std::exp((last_birth_s_ - session_time_s) / kClears_s) + 1;
  last_birth_s_ = session_time_s;
  // Multiples of the golden angle distribute the drift directions evenly, without a random number.
  puffs_[next_] = {p_W, session_time_s, 2.39996f * static_cast<float>(next_)};
  next_ = (next_ + 1) % puffs_.size();
}

float Smoke::HazeAt(double session_time_s) const {
  const double puffs = puffs_in_gas_ * std::exp(std::min(0.0, last_birth_s_ - session_time_s) / kClears_s);
  return static_cast<float>(kHazeStep * std::floor(kDensest * puffs / (puffs + kHalfHaze) / kHazeStep));
}

bool Smoke::Update(double session_time_s) {
  const bool shown = shown_;
  shown_ = std::any_of(puffs_.begin(), puffs_.end(), [&](const Puff& puff) {
    return session_time_s >= puff.born_s && session_time_s - puff.born_s < kLife_s;
  });
  if (!shown && !shown_) {
    return false;
  }
  std::vector<Vec3f> positions;
  std::vector<std::array<float, 4>> coordinates;
  std::vector<Triangle> triangles;
  for (const Puff& puff : puffs_) {
    const double age = session_time_s - puff.born_s;
    if (age < 0 || age >= kLife_s) {
      continue;
    }
    const auto t = static_cast<float>(age);
    const auto left = static_cast<float>(1 - age / kLife_s);
    const Vec3f centre =
        puff.p_W + t * Vec3f(kDrift_m_s * std::cos(puff.drift), kDrift_m_s * std::sin(puff.drift), kRise_m_s);
    const float opacity = kOpacity * left * std::min(1.0f, 8 * t + 0.2f);
    const auto first = static_cast<Index>(positions.size());
    for (const auto& [u, v] : {std::array{-1.0f, -1.0f}, {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}}) {
      positions.push_back(centre);
      coordinates.push_back({u, v, kFirstRadius_m + kGrowth_m_s * t, opacity});
    }
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
  }
  mesh_.SetPositions(positions);
  mesh_.SetCoordinates(coordinates);
  mesh_.SetTriangles(triangles);
  return true;
}

}  // namespace fulcrum::render
