#include "tests/fuzz/checkpoint/checkpoint_check.h"

#include <algorithm>
#include <cmath>

#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "services/transport/bus/gate.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/coupling/solid_surface.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::testing {
namespace {

class PhysicsCheck final : public CheckpointCheck {
 public:
  explicit PhysicsCheck(const scene::SceneSettings& settings) : data_(scene::BuildProcedural(settings)) {
    constexpr int kSteps = 160;  // The grasper then holds the membrane and pulls.
    physics::TissueSimulation worker(scene_);
    for (int step = 0; step < kSteps; ++step) (void)worker.Step(physics::ScriptedTools(scene_, 0.01 * step));
    good_.resize(physics::CheckpointCapacity(static_cast<Index>(scene_.rest_position.size())));
    good_.resize(physics::WriteCheckpoint(worker, {0.01f, 1.0}, good_));
  }
  Outcome Offer(std::span<const std::byte> payload, int steps) override {
    // One simulation serves all inputs: its construction takes longer than all the rest.
    physics::TissueSimulation& simulation = *simulation_;
    if (!physics::ReadCheckpoint(good_, &simulation)) return Outcome::kBroken;
    const std::uint64_t before = simulation.StateHash();
    if (!physics::ReadCheckpoint(payload, &simulation)) {
      return simulation.StateHash() == before ? Outcome::kRefused : Outcome::kBroken;
    }
    TissueFrame frame;
    ContactModel model;
    for (int step = 0; step < steps; ++step) {
      (void)simulation.Step(physics::ScriptedTools(scene_, 1.6 + 0.01 * step));
      frame.header.simulated_time_s = simulation.simulated_time_s();
      frame.header.vertex_count = simulation.particles().particle_count();
      frame.xyz.resize(3 * std::size_t{frame.header.vertex_count});
      simulation.particles().CopyPositions(frame.xyz);
      for (std::uint32_t i = 0; i < kMaxTools; ++i) model.devices[i] = simulation.Contacts(i);
      if (!bus::PassesGate(frame) || !bus::PassesGate(model)) return Outcome::kBroken;
    }
    return Outcome::kTaken;
  }

 private:
  const scene::SceneData data_;
  SceneView scene_ = data_.View();
  const std::unique_ptr<physics::TissueSimulation> simulation_ = std::make_unique<physics::TissueSimulation>(scene_);
};

class ThermalCheck final : public CheckpointCheck {
 public:
  explicit ThermalCheck(float cell_m) : data_(Scene(cell_m)) {
    thermal::ThermalSolver worker(scene_);
    thermal::RunDrag(drag_, kDt, &worker);
    while (!worker.at_commit_frame()) worker.Step(thermal::TipInput{}, kDt);
    good_.resize(thermal::ThermalSolver::CheckpointCapacity(scene_));
    good_.resize(worker.Save(good_));
  }
  Outcome Offer(std::span<const std::byte> payload, int steps) override {
    // A solver that has refused a payload is unchanged and is used again.
    if (!fresh_) fresh_ = std::make_unique<thermal::ThermalSolver>(scene_);
    const std::uint64_t before = fresh_->FullHash();
    if (!fresh_->Restore(payload)) return fresh_->FullHash() == before ? Outcome::kRefused : Outcome::kBroken;
    const std::unique_ptr<thermal::ThermalSolver> taken = std::move(fresh_);
    thermal::ThermalSolver& solver = *taken;
    for (int step = 0; step < steps; ++step) {
      solver.Step(drag_.At(step, kDt), kDt);
      const auto& figures = solver.figures();
      const double numbers[] = {solver.ledger().joule, solver.ledger().generator, solver.ledger().Out(),
                                figures.highest_C,     figures.present_C,         figures.power_W,
                                figures.voltage_V,     figures.burn_depth_m,      solver.cut_length_m()};
      if (!std::all_of(std::begin(numbers), std::end(numbers), [](double x) { return std::isfinite(x); }) ||
          !(solver.cut_length_m() >= 0 && solver.cut_length_m() <= 1e3)) {
        return Outcome::kBroken;
      }
    }
    return Outcome::kTaken;
  }

 private:
  static constexpr float kDt = 0.01f;
  static scene::SceneData Scene(float cell_m) {
    scene::SceneData data = thermal::FlatScene(16, 21, 1e-3f);
    data.fixed.thermal.volume = 1;
    data.fixed.thermal.cell_m = cell_m;
    return data;
  }
  const scene::SceneData data_;
  SceneView scene_ = data_.View();
  std::unique_ptr<thermal::ThermalSolver> fresh_;
  thermal::Drag drag_ = [] {
    thermal::Drag drag;
    drag.from = {0.006f, 0.006f};
    drag.to = {0.012f, 0.008f};
    drag.speed_m_s = 0.006f;
    return drag;
  }();
};

class SolidCheck final : public CheckpointCheck {
 public:
  SolidCheck() {
    scene_.rest_position = vertices_;
    scene_.tube_surface = triangles_;
    const SolidChart chart = MakeSolidCharts(scene_).charts.at(0);
    tip_.active = tip_.touching = true;
    tip_.path.from = tip_.path.to = chart.Material({0.006f, 0.006f, 0});
    tip_.path.radius_m = 5e-4f;
    tip_.mode = CauteryMode::kBlend;
    tip_.power_W = 35;
    thermal::SolidSurface worker(scene_);
    thermal::Interface hook;
    for (int step = 0; step < 40; ++step) (void)worker.Step(std::span(&tip_, 1), kDt, &hook);
    good_.resize(thermal::SolidSurface::CheckpointCapacity());
    good_.resize(worker.Save(good_));
  }
  Outcome Offer(std::span<const std::byte> payload, int steps) override {
    thermal::SolidSurface solids(scene_);
    if (!solids.Restore(payload)) {
      const bool fresh = solids.TickHash() == 0 && solids.field().Existing().empty();
      return fresh ? Outcome::kRefused : Outcome::kBroken;
    }
    thermal::Interface hook;
    for (int step = 0; step < steps; ++step) {
      (void)solids.Step(std::span(&tip_, 1), kDt, &hook);
      const double numbers[] = {
          solids.ledger().joule, solids.ledger().generator, solids.ledger().Out(), solids.highest_C(),
          solids.power_W(),      solids.voltage_V(),        solids.dead_m2(),      hook.hook_theta};
      if (!std::all_of(std::begin(numbers), std::end(numbers), [](double x) { return std::isfinite(x); })) {
        return Outcome::kBroken;
      }
    }
    return Outcome::kTaken;
  }

 private:
  static constexpr float kDt = 0.01f;
  const std::vector<Vec3f> vertices_{{0, 0, 0}, {0.012f, 0, 0}, {0.012f, 0.012f, 0}, {0, 0.012f, 0}};
  const std::vector<Triangle> triangles_{{0, 1, 2}, {0, 2, 3}};
  TissueScene scene_;
  thermal::TipInput tip_;
};

}  // namespace

std::unique_ptr<CheckpointCheck> MakePhysicsCheck(const scene::SceneSettings& scene) {
  return std::make_unique<PhysicsCheck>(scene);
}
std::unique_ptr<CheckpointCheck> MakeThermalCheck(float cell_m) { return std::make_unique<ThermalCheck>(cell_m); }

std::unique_ptr<CheckpointCheck> MakeSolidCheck() { return std::make_unique<SolidCheck>(); }

}  // namespace fulcrum::testing
