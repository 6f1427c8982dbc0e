#include "tests/benchmark/servo/motions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/haptics/rig.h"

namespace fulcrum::haptics {
namespace {

using testing::LatePhysics;
using testing::TestTissue;
using testing::TickAt;

constexpr double kPi = std::numbers::pi;
constexpr double kReady_s = 0.6;   ///< Start: three reports and the rise to full force.
constexpr double kSettle_s = 1.0;  ///< Whole cycles up to this time are not measured.
constexpr double kMeasured_s = 4.0;

void Misjudge(const Physics& physics, std::mt19937_64* random, Contact* contact) {
  for (float* value : {&contact->k1, &contact->k3, &contact->kt, &contact->k_body}) {
    *value *= static_cast<float>(physics.mismatch.stiffness);
  }
  contact->b_body *= static_cast<float>(physics.mismatch.viscosity);
  std::normal_distribution<float> normal;
  contact->f_ref *= 1.0f + static_cast<float>(physics.noise) * normal(*random);
}

struct Sum {
  double error2 = 0, force2 = 0;
  void Add(const Vec3d& error, const Vec3d& force) {
    error2 += error.squaredNorm();
    force2 += force.squaredNorm();
  }
  [[nodiscard]] double percent() const { return 100 * std::sqrt(error2 / force2); }
};

}  // namespace

std::vector<Motion> Motions() {
  testing::TissueParameters grasp;
  grasp.grasp = true;
  const auto press = [](double t) {
    const double u = std::fmod(t, 1.0);  // Down in 150 ms, hold, up, hold.
    const double ramp = std::clamp(std::min(u, 0.65 - u) / 0.15, 0.0, 1.0);
    return Vec3d(0, 0, 0.001 - 0.007 * ramp * ramp * (3 - 2 * ramp));
  };
  const auto palpate = [](double t) { return Vec3d(0, 0, -0.004 + 0.003 * std::cos(2 * kPi * 2 * t)); };
  const auto tap = [](double t) { return Vec3d(0, 0, 0.003 * std::cos(2 * kPi * 5 * t)); };
  const auto slide = [](double t) {
    const double u = std::fmod(t, 2.0);
    return Vec3d(0.06 * (u < 1 ? u : 2 - u), 0, -0.004);
  };
  const auto pull = [](double t) {
    const double way = 0.004 * (1 - std::cos(2 * kPi * 0.7 * t));
    return Vec3d(0.3 * way, 0.2 * way, 0.6 * way);
  };
  return {{"press", 1.0, press, {}},
          {"palpate", 0.5, palpate, {}},
          {"tap", 0.2, tap, {}},
          {"slide", 2.0, slide, {}},
          {"grasp", 1 / 0.7, pull, grasp}};
}

ForceError Follow(const Motion& motion, const Physics& physics, ForceStrategy* strategy) {
  TestTissue tissue(motion.tissue);
  tissue.Place(motion.tip(0));
  LatePhysics late;
  late.period_ns = std::llround(1e9 * physics.period_s);
  late.latency_ns = std::llround(1e9 * physics.latency_s);
  std::mt19937_64 random(1);
  Sum first;
  Sum all;
  ForceError result;
  Vec3d last_error = Vec3d::Zero();
  for (std::uint64_t i = 0;; ++i) {
    const Tick tick = TickAt(i);
    const double t = tick.session_time_s - kReady_s;
    if (t > kSettle_s + kMeasured_s) break;
    ContactModel model;
    if (late.Step(tissue, tick.stamp_ns - 1'000'000, &model)) {
      Misjudge(physics, &random, &model.devices[0].contacts[0]);
      strategy->Offer(model, tick);
    }
    const Vec3d tip = motion.tip(std::max(0.0, t));
    Vec3d proxy = tip;
    const Vec3d force = strategy->Step(tick, tip, &proxy);
    const Vec3d truth = tissue.Step(proxy, tick.dt_s);
    const Vec3d error = force - truth;
    if (t > 0.0 && t <= motion.cycle_s) first.Add(error, truth);
    if (t > kSettle_s) {
      all.Add(error, truth);
      result.excess_step_N = std::max(result.excess_step_N, (error - last_error).norm());
    }
    last_error = error;
  }
  result.percent = all.percent();
  result.first_percent = first.percent();
  return result;
}

}  // namespace fulcrum::haptics
