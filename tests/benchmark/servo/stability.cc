#include "tests/benchmark/servo/stability.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "haptics_node/device/simulated_device.h"
#include "haptics_node/servo/servo.h"
#include "tests/unit/haptics/loop.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

using testing::BenchScene;
using testing::BenchTrocar;
using testing::GuidedDevice;
using testing::kNothing;
using testing::Loop;
using testing::TissueParameters;

// Body of a wall: as stiff as the gate admits, so that the skin determines the force.
constexpr double kWallBody_N_m = 2e5;
constexpr double kCycle_s = 0.5;

TissueParameters Wall(double stiffness_N_m) {
  // Viscosity that relaxes within two substeps of the tissue: the explicit integration needs some viscosity.
  const double relaxation_s = 1e-4;
  return {.k1 = stiffness_N_m,
          .k3 = 0,
          .kt = 0,
          .k_body = kWallBody_N_m,
          .b_body = relaxation_s * kWallBody_N_m,
          .friction = 0,
          .grasp = false};
}

CycleEnergy Cycle(const TissueParameters& parameters, double depth, double wall_N_m) {
  constexpr int kCycles = 6;
  const auto place = [=](double t) {
    return 0.001 - 0.5 * (depth + 0.001) * (1 - std::cos(2 * std::numbers::pi * t / kCycle_s));
  };
  // The force has risen before the first cycle.
  constexpr double kUp_s = 0.6;
  GuidedDevice device(BenchTrocar(), [&](double t) { return Vec3d(0, 0, place(std::max(0.0, t - kUp_s))); });
  Loop loop(BenchScene(1.0), &device, parameters);
  loop.Run(static_cast<int>(1e3 * (kUp_s + kCycle_s)), kNothing);
  CycleEnergy result;
  Vec3d force = device.force;
  Vec3d last(0, 0, place(0));
  loop.Run(static_cast<int>(1e3 * kCycles * kCycle_s), [&](const Tick& tick) {
    const Vec3d now(0, 0, place(tick.session_time_s - kUp_s));
    // The force sent at the last tick acted over the motion since then; the lever of the bench is 1.
    result.lost_mJ -= 1e3 / kCycles * force.dot(now - last);
    result.stored_mJ = std::max(result.stored_mJ, 1e3 * 0.5 * device.force.squaredNorm() / wall_N_m);
    force = device.force;
    last = now;
  });
  return result;
}

}  // namespace

WallResult HitWall(const HandModel& hand, double wall_N_per_mm) {
  SceneView scene = BenchScene(1.0);
  scene.script = testing::kIntoTheWall;
  SimulatedDevice device(hand, BenchTrocar(), scene.script, 0);
  Loop loop(scene, &device, Wall(1e3 * wall_N_per_mm));
  double z = 0;
  WallResult result;
  result.stable = testing::UnrestAtTheWall(&loop, [&](const Tick& tick) {
                    return z = PoseFromAttachPoint(BenchTrocar(), device.ReadPosition(tick)).p_WT.z();
                  }) < 1e-4;
  result.rendered_N_per_mm = -1e-3 * testing::SentForce(loop.servo).z() / z;
  return result;
}

CycleEnergy CycleOnTissue() { return Cycle({}, 0.005, 1 / (1.0 / 600 + 1.0 / 400)); }

CycleEnergy CycleOnElasticWall() {
  constexpr double kWall_N_m = 600;
  return Cycle(Wall(kWall_N_m), 0.003, kWall_N_m);
}

StallResult StallForASecond() {
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.008); });
  Loop loop(BenchScene(1.0), &device, {});
  loop.Run(1500, kNothing);
  StallResult result;
  result.pressed_N = device.force.norm();
  loop.physics.stalled = true;
  loop.Run(1000, [&](const Tick&) {
    // 0.401 s: the first tick at which 400 ms have passed since the tool sample of the model.
    if (loop.servo.figures().model_age_s < 0.4015) result.force_at_400ms_N = device.force.norm();
  });
  loop.physics.stalled = false;
  std::vector<double> forces;
  loop.Run(1000, [&](const Tick&) { forces.push_back(device.force.norm()); });
  for (std::size_t i = 5; i < forces.size(); ++i) {
    result.return_step_N_per_5ms = std::max(result.return_step_N_per_5ms, forces[i] - forces[i - 5]);
  }
  result.returned_N = forces.back();
  return result;
}

}  // namespace fulcrum::haptics
