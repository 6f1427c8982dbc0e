#include "render_node/scene_graph/smoke.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "render_node/scene_graph/program.h"
#include "services/base/core/suction.h"

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
constexpr double kCavity_m3 = 3e-3;  // Assumed: an insufflated abdomen.
constexpr double kDrawStep_s = 0.02;
constexpr float kArrives_m = 0.004f;   // So near to a sink a puff is gone.
constexpr float kFastest_m_s = 0.15f;  // Of a puff, whose squares must not jump.

}  // namespace

Smoke::Smoke() : mesh_("smoke", true) {
  mesh_.state()->setAttributeAndModes(MakeProgram("smoke.vert", "smoke.frag"));
  Update(0);
}

void Smoke::Add(const Vec3f& p_W, double session_time_s) {
  if (session_time_s - last_birth_s_ < kLeastInterval_s) {
    return;
  }
  puffs_in_gas_ = InGasAt(session_time_s) + 1;
  last_birth_s_ = in_gas_s_ = session_time_s;
  // Multiples of the golden angle distribute the drift directions evenly, without a random number.
  puffs_[next_] = {p_W, Vec3f::Zero(), session_time_s, 2.39996f * static_cast<float>(next_)};
  next_ = (next_ + 1) % puffs_.size();
}

double Smoke::InGasAt(double session_time_s) const {
  const double clears_1_s =
      1 / kClears_s + static_cast<double>(sinks_.size()) * static_cast<double>(kAspiratedGas_m3_s) / kCavity_m3;
  return puffs_in_gas_ * std::exp(std::min(0.0, in_gas_s_ - session_time_s) * clears_1_s);
}

void Smoke::SetSinks(std::span<const Vec3f> sinks_W, double session_time_s) {
  if (sinks_W.size() != sinks_.size()) {
    puffs_in_gas_ = InGasAt(session_time_s);
    in_gas_s_ = std::max(in_gas_s_, session_time_s);
  }
  if (sinks_.empty()) drawn_s_ = session_time_s;
  sinks_.assign(sinks_W.begin(), sinks_W.end());
}

Vec3f Smoke::PlaceOf(const Puff& puff, float age_s) {
  const Vec3f drifts(kDrift_m_s * std::cos(puff.drift), kDrift_m_s * std::sin(puff.drift), kRise_m_s);
  return puff.p_W + puff.drawn + age_s * drifts;
}

// A sink of the flow Q draws at the distance r with Q / (4 pi r^2).
void Smoke::Draw(double step_s, double session_time_s) {
  constexpr float kSphere = 12.566f;  // 4 pi
  for (Puff& puff : puffs_) {
    const double age_s = session_time_s - puff.born_s;
    if (age_s < 0 || age_s >= kLife_s) continue;
    for (const Vec3f& sink : sinks_) {
      const Vec3f to = sink - PlaceOf(puff, static_cast<float>(age_s));
      const float distance = to.norm();
      if (distance < kArrives_m) {
        puff.born_s = -1e9;
        break;
      }
      const float speed = std::min(kFastest_m_s, kAspiratedGas_m3_s / (kSphere * distance * distance));
      puff.drawn += std::min(1.0f, static_cast<float>(step_s) * speed / distance) * to;
    }
  }
}

float Smoke::HazeAt(double session_time_s) const {
  const double puffs = InGasAt(session_time_s);
  return static_cast<float>(kHazeStep * std::floor(kDensest * puffs / (puffs + kHalfHaze) / kHazeStep));
}

bool Smoke::Update(double session_time_s) {
  if (!sinks_.empty()) {
    drawn_s_ = std::max(drawn_s_, session_time_s - kLife_s);
    for (; drawn_s_ + kDrawStep_s <= session_time_s; drawn_s_ += kDrawStep_s) Draw(kDrawStep_s, drawn_s_);
  }
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
    const Vec3f centre = PlaceOf(puff, t);
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
