#include "tests/fuzz/checkpoint/checkpoint_check.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "physics_node/node/physics_checkpoint.h"
#include "services/scene/builder/build.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/transport/bus/gate.h"
#include "tests/numerics/physics/script_player.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::testing {
namespace {

constexpr int kStepsAfter = 4;

class PhysicsCheck final : public CheckpointCheck {
 public:
  PhysicsCheck() {
    constexpr int kSteps = 160;  // It holds the membrane and pulls.
    physics::TissueSimulation worker(scene_);
    for (int step = 0; step < kSteps; ++step) (void)worker.Step(physics::ScriptedTools(scene_, 0.01 * step));
    good_.resize(physics::CheckpointCapacity(static_cast<Index>(scene_.rest_position.size())));
    good_.resize(physics::WriteCheckpoint(worker, {0.01f, 1.0}, good_));
  }
  Outcome Offer(std::span<const std::byte> payload) override {
    physics::TissueSimulation simulation(scene_);
    const std::uint64_t before = simulation.StateHash();
    if (!physics::ReadCheckpoint(payload, &simulation)) {
      return simulation.StateHash() == before ? Outcome::kRefused : Outcome::kBroken;
    }
    TissueFrame frame;
    ContactModel model;
    for (int step = 0; step < kStepsAfter; ++step) {
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
  scene::SceneData data_ = scene::BuildProcedural(scene::Small());
  SceneView scene_ = data_.View();
};

class ThermalCheck final : public CheckpointCheck {
 public:
  ThermalCheck() {
    thermal::ThermalSolver worker(scene_);
    thermal::RunDrag(drag_, kDt, &worker);
    while (!worker.at_commit_frame()) worker.Step(thermal::TipInput{}, kDt);
    good_.resize(thermal::ThermalSolver::CheckpointCapacity(scene_));
    good_.resize(worker.Save(good_));
  }
  Outcome Offer(std::span<const std::byte> payload) override {
    thermal::ThermalSolver solver(scene_);
    const std::uint64_t before = solver.FullHash();
    if (!solver.Restore(payload)) return solver.FullHash() == before ? Outcome::kRefused : Outcome::kBroken;
    for (int step = 0; step < kStepsAfter; ++step) {
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
  scene::SceneData data_ = [] {
    scene::SceneData data = thermal::FlatScene(16, 21, 1e-3f);
    data.fixed.thermal.volume = 1;
    return data;
  }();
  SceneView scene_ = data_.View();
  thermal::Drag drag_ = [] {
    thermal::Drag drag;
    drag.from = {0.006f, 0.006f};
    drag.to = {0.012f, 0.008f};
    drag.speed_m_s = 0.006f;
    return drag;
  }();
};

}  // namespace

void Patch(std::span<const std::uint8_t> input, std::vector<std::byte>* payload) {
  while (input.size() >= 5 && !payload->empty()) {
    std::uint32_t place = 0;
    std::memcpy(&place, input.data(), 4);
    const std::size_t at = place % payload->size();
    const bool cut = input[4] == 255;
    const std::size_t length = cut ? 0 : std::min<std::size_t>(input[4], input.size() - 5);
    if (cut) payload->resize(at);
    for (std::size_t i = 0; i < length && at + i < payload->size(); ++i) (*payload)[at + i] = std::byte{input[5 + i]};
    input = input.subspan(5 + length);
  }
}

std::unique_ptr<CheckpointCheck> MakePhysicsCheck() { return std::make_unique<PhysicsCheck>(); }
std::unique_ptr<CheckpointCheck> MakeThermalCheck() { return std::make_unique<ThermalCheck>(); }

}  // namespace fulcrum::testing
