#include "physics_node/simulation/tissue_simulation.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "physics_node/collision/row_projection.h"
#include "services/base/core/hash.h"

namespace fulcrum::physics {
namespace {

/// Path of a pressing tool in a substep of mode accurate [m], kept with up to kMostSubsteps; beyond, contacts soften
/// with the path (implicit/elements.cc). Six gain less than steps lose that come late.
constexpr float kPathPerSubstep = 2e-5f;
constexpr int kMostSubsteps = 4;
/// Least substeps while a tool presses: with one per step the error of the force is half of it at any speed of the
/// tool.
constexpr int kLeastSubsteps = 2;
/// Iterations where tools require more substeps than the preset: these are shorter, and two iterations suffice.
constexpr int kIterationsOfShort = 2;

/// Bounds of a state that a step can have left [m]: coordinates, and the movement in a step, which never exceeds 160
/// mm.
constexpr float kMostCoordinate_m = 10.0f, kMostTravel_m = 0.2f;

bool Printed(const TissueScene& scene) {
  return scene.physics.mode == PhysicsMode::kPaper && scene.physics.as == PaperForm::kPrinted;
}

}  // namespace

TissueSimulation::TissueSimulation(const TissueScene& scene, int threads, InstructionSet set)
    : scene_(scene),
      particles_(scene),
      model_(scene, &particles_),
      solver_(Printed(scene) ? AsPrinted(scene.physics) : scene.physics, &model_, &particles_, pbd::KernelsFor(set),
              tissue::KernelsFor(set)),
      collision_(scene, &model_, &particles_, collision::KernelsFor(set)),
      tissue_collision_(scene, &model_, &particles_, collision::KernelsFor(set)),
      sheet_collision_(scene, &model_, &particles_),
      grasps_{Grasp(scene), Grasp(scene), Grasp(scene), Grasp(scene)},
      clips_(scene),
      contacts_(scene, &model_, &particles_),
      cautery_(scene, &model_, &particles_),
      tears_(scene, &model_, &particles_) {
  if (SolidsBurn(scene)) {
    solid_probe_.emplace(scene, &particles_);
  }
  if (Printed(scene)) {
    printed_.emplace(scene, &model_, &particles_);
  }
  if (scene.physics.mode != PhysicsMode::kPaper) {
    const ElasticModel elastic = BuildElasticModel(scene);
    if (scene.physics.mode == PhysicsMode::kXpbd) {
      xpbd_.emplace(elastic, &model_, &particles_, xpbd::KernelsFor(set), tissue::KernelsFor(set));
    } else {
      implicit_.emplace(scene, elastic, model_, &particles_, threads, implicit::KernelsFor(set));
      implicit_->UseClips(&clips_);
      effort_ = implicit::EffortOf(scene.physics.preset);
      // Without gravity a scene begins in equilibrium: its bodies need not be computed until something moves them.
      if (scene.physics.gravity.isZero(0.0f)) implicit_->Stop();
      contacts_.SetComplianceSolver(&implicit_compliance_);
    }
    held_places_.reserve(particles_.particle_count());
    rows_.reserve(kMaxTools * ToolCollision::kMaxRows + TissueCollision::kMaxRows + SheetCollision::kMaxRows);
  }
}

bool TissueSimulation::ImplicitCompliance::Stiffness(const Probe& probe, float horizon_s, float* newton_per_m) {
  // Tools take turns: half, then a quarter of the period apart.
  const std::uint64_t turn = probe.tool % 2 * (kQueryEvery / 2) + probe.tool / 2 * (kQueryEvery / 4);
  if ((simulation_->counters_.steps + turn) % kQueryEvery != 0) {
    return false;
  }
  at_.clear();
  for (const Index particle : probe.particles) {
    at_.push_back(simulation_->particles_.Ref(particle));
  }
  const std::size_t number = 2 * probe.tool + (horizon_s > 0.0f ? 1 : 0);
  return simulation_->implicit_->Stiffness({at_, probe.direction, horizon_s, number}, newton_per_m);
}

/// Contacts of tissue with tissue and its surroundings, for the step that ends at the present time.
void TissueSimulation::FindTissueContacts() { tissue_collision_.FindPairs(moved_, step_begin_s(), simulated_time_s()); }

StepReport TissueSimulation::StepPaper() {
  StepReport report;
  report.resets = solver_.Predict();
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    grasps_[i].Move(tracks_[i].now, &particles_);
  }
  FindContacts(true);
  collision_.Sweep();
  for (std::uint32_t iteration = 0; iteration < solver_.iterations(); ++iteration) {
    printed_ ? printed_->Iterate() : solver_.Iterate();
    collision_.Project();
    clips_.Project(&particles_);
  }
  const FinishResult finish = solver_.Finish();
  collision_.Settle();
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    grasps_[i].Slip(contacts_.force(static_cast<std::uint32_t>(i)), step_s(), scene_.tools[i], tracks_[i].now, model_,
                    &particles_);
  }
  report.resets += finish.resets;
  report.max_step_m = std::sqrt(finish.max_step_sq);
  return report;
}

/// Positions of the held particles at part u of the step.
void TissueSimulation::PlaceHeld(float u) {
  held_places_.clear();
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    if (grasps_[i].holding()) {
      const ToolPose pose = Interpolate(tracks_[i].last, tracks_[i].now, u);
      for (const HeldParticle& held : grasps_[i].held()) {
        held_places_.push_back({particles_.Ref(held.particle), pose.ToWorld(held.p_T)});
      }
    }
  }
}

/// Contacts of tools with tissue and of tissue with tissue, for substeps of h.
void TissueSimulation::FindAllContacts(float h) {
  if (!implicit_) {
    FindContacts(true, largest_speed_ * h);
    FindTissueContacts();
    return;
  }
  tissue_collision_.BeginPairs(moved_, step_begin_s(), simulated_time_s());
  // The tasks are independent: one for the tools, one for the sheets and one for each part of a surface.
  const int tasks = tissue_collision_.tasks();
  implicit_->workers().Run(tasks + 2, 0, 2, [&](int task, int) {
    if (task < tasks) {
      tissue_collision_.FindPairsOf(task, moved_);
    } else if (task == tasks) {
      FindContacts(true, largest_speed_ * h);
    } else {
      sheet_collision_.FindPairs(moved_);
    }
  });
}

StepReport TissueSimulation::StepXpbd(std::uint32_t last_periods) {
  StepReport report;
  const auto substeps = static_cast<float>(scene_.physics.substeps);
  const float h = step_s() / substeps;
  // Previous positions are those of the last substep, so the movement in a step is bounded by the largest speed.
  moved_.assign(particles_.block_count(), largest_speed_ * scene_.physics.dt_s * static_cast<float>(last_periods));
  if (last_periods != step_periods_) {
    xpbd_->ScaleLastMove(static_cast<float>(step_periods_) / static_cast<float>(last_periods));
  }
  FindAllContacts(h);
  float largest_sq = 0;
  for (std::uint32_t i = 0; i < scene_.physics.substeps; ++i) {
    const float u0 = static_cast<float>(i) / substeps, u1 = static_cast<float>(i + 1) / substeps;
    collision_.Rows(u0, u1, &rows_);
    tissue_collision_.Rows(u0, u1, &rows_);
    report.resets += xpbd_->Predict(h);
    PlaceHeld(u1);
    for (const implicit::HeldPlace& held : held_places_) {
      particles_.Set(held.at, held.place);
    }
    xpbd_->Iterate(h);
    ProjectRows(rows_, ToolCollision::kMaxPush, h, &particles_);
    clips_.Project(&particles_);
    const FinishResult finish = xpbd_->Finish(h);
    collision_.TakeForces(rows_);
    report.resets += finish.resets;
    largest_sq = std::max(largest_sq, finish.max_step_sq);
  }
  largest_speed_ = std::sqrt(largest_sq) / h;
  report.max_step_m = largest_speed_ * step_s();
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    grasps_[i].Slip(contacts_.force(static_cast<std::uint32_t>(i)), step_s(), scene_.tools[i], tracks_[i].now, model_,
                    &particles_);
  }
  return report;
}

/// The linearised solve of a substep is valid for a movement by a small part of a cell. With a longer path of a
/// pressing tool the force oscillates by more than its own size.
int TissueSimulation::SubstepsForTools() const {
  float path = 0;
  for (std::uint32_t i = 0; i < kMaxTools; ++i) {
    if (tracks_[i].present && !grasps_[i].holding() && collision_.force(i) != Vec3f::Zero()) {
      path = std::max(path, (tracks_[i].now.p_WT - tracks_[i].last.p_WT).norm());
    }
  }
  if (path == 0.0f) {
    return effort_.substeps;
  }
  const int least = std::max(effort_.substeps, kLeastSubsteps);
  return std::clamp(static_cast<int>(std::ceil(path / kPathPerSubstep)), least, std::max(least, kMostSubsteps));
}

StepReport TissueSimulation::StepAccurate() {
  StepReport report;
  const int count = SubstepsForTools();
  const int iterations =
      count > effort_.substeps ? std::min(effort_.iterations, kIterationsOfShort) : effort_.iterations;
  const auto substeps = static_cast<float>(count);
  const float h = step_s() / substeps;
  // A force is the mean over the last period of the step: in older substeps a moving tool was too far from its place.
  const int older = count - (count + static_cast<int>(step_periods_) - 1) / static_cast<int>(step_periods_);
  report.resets = implicit_->BeginStep();
  const std::span<const float> moved = implicit_->moved();
  moved_.assign(moved.begin(), moved.end());
  auto begun = std::chrono::steady_clock::now();
  const auto end_contacts = [&] {
    report.stages.contacts_ns += std::chrono::nanoseconds(std::chrono::steady_clock::now() - begun).count();
  };
  FindAllContacts(h);
  end_contacts();
  for (int i = 0; i < count; ++i) {
    begun = std::chrono::steady_clock::now();
    const float u0 = static_cast<float>(i) / substeps, u1 = static_cast<float>(i + 1) / substeps;
    PlaceHeld(u1);
    constexpr int kParts = TissueCollision::kParts;
    implicit_->workers().Run(kParts + 2, 0, 2, [&](int part, int) {
      if (part < kParts) {
        tissue_collision_.FindRows(part, u0, u1);
      } else if (part == kParts) {
        collision_.Rows(u0, u1, &rows_);
      } else {
        sheet_collision_.FindRows(u1 - u0);
      }
    });
    tissue_collision_.JoinRows(&rows_);
    sheet_collision_.JoinRows(&rows_);
    end_contacts();
    const implicit::SubstepReport substep = implicit_->Substep(h, iterations, held_places_, rows_);
    collision_.TakeForces(rows_);
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      const float share = 1.0f / static_cast<float>(i < older ? i + 1 : i + 1 - older);
      ToolForce& mean = tool_force_[tool];
      mean.force += share * (collision_.force(tool) - mean.force);
      const Vec3f &from = tracks_[tool].last.p_WT, &to = tracks_[tool].now.p_WT;
      mean.tip += share * (from + u1 * (to - from) - mean.tip);
    }
    report.resets += substep.resets;
    report.stages.prediction_ns += substep.times.prediction_ns;
    report.stages.linearisation_ns += substep.times.linearisation_ns;
    report.stages.solve_ns += substep.times.solve_ns;
    report.stages.update_ns += substep.times.update_ns;
    largest_speed_ = substep.largest_speed_m_s;
    report.max_step_m = std::max(report.max_step_m, largest_speed_ * step_s());
  }
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    Vec3f traction = Vec3f::Zero();
    for (const HeldParticle& held : grasps_[i].held()) {
      traction += implicit_->ForceOn(particles_.Ref(held.particle));
    }
    if (grasps_[i].holding()) {
      tool_force_[i] = {traction, tracks_[i].now.p_WT};
    }
    grasps_[i].Slip(traction, step_s(), scene_.tools[i], tracks_[i].now, model_, &particles_);
  }
  return report;
}

StepReport TissueSimulation::Step(const std::array<ToolInput, kMaxTools>& tools, std::uint64_t periods) {
  const std::uint64_t most = scene_.physics.mode == PhysicsMode::kPaper ? 1 : kMostStepPeriods;
  const std::uint32_t last_periods = step_periods_;
  step_periods_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(periods, 1, most));
  counters_.periods += step_periods_;
  ++counters_.steps;
  FollowTools(tools);
  const bool held = held_particles() > 0;
  UpdateGrasps();
  const bool holds = held_particles() > 0;
  sleep_.asleep = sleep_.asleep && !held && !holds;
  if (StaysAsleep()) {
    StepReport report;
    report.asleep = true;
    return report;
  }
  ++counters_.state_version;
  const StepReport report = implicit_ ? StepAccurate() : xpbd_ ? StepXpbd(last_periods) : StepPaper();
  counters_.quarantined += report.resets;
  WatchTears(report.max_step_m);
  UpdateSleep(report, holds);
  return report;
}

/// In mode accurate the movements by blocks of particles are those of the last step. The delay of a step is far below
/// the time from near tearing (TearWatch::kNear) to tearing.
void TissueSimulation::WatchTears(float max_step_m) {
  const auto rows = scene_.membrane.rows;
  if (implicit_) {
    constexpr std::uint32_t kBlocks = ParticleStore::kBlocksPerRow;
    for (std::uint32_t row = 0; row < rows; ++row) {
      const float* of_row = moved_.data() + particles_.tube_blocks() + row * kBlocks;
      tears_.RowsMoved(row, row + 1, *std::max_element(of_row, of_row + kBlocks));
    }
  } else {
    tears_.RowsMoved(0, rows, max_step_m);
  }
  (void)tears_.Evaluate(counters_.steps);
}

void TissueSimulation::LetThreadsHelp(bool help) {
  if (implicit_) {
    implicit_->workers().EnableHelpers(help);
  }
}

std::uint32_t TissueSimulation::SetCheaper(std::uint32_t presets) {
  const auto own = implicit_ ? static_cast<std::uint32_t>(scene_.physics.preset) : 0u;
  const std::uint32_t cheaper = std::min(presets, own);
  effort_ = implicit::EffortOf(static_cast<PhysicsPreset>(own - cheaper));
  return cheaper;
}

int TissueSimulation::ApplyTopology(const TopologyState& topology) {
  const int edits = model_.Apply(topology, &particles_);
  if (edits > 0) {
    if (implicit_) {
      implicit_->UpdateTopology(model_);
      sheet_collision_.Follow();
    }
    for (Grasp& grasp : grasps_) {
      grasp.DropDead(model_, &particles_);
    }
    clips_.DropDead(model_, particles_);
    tears_.Follow();
    sleep_.asleep = false;
    sleep_.still_steps = 0;
  }
  return edits;
}

bool TissueSimulation::SetOpenCells(const OpenCells& cells) {
  if (cells.scene_hash != scene_.hash) {
    return false;
  }
  collision_.SetOpenCells(cells);
  // A tool that rests against removed cells can move on.
  sleep_.asleep = false;
  sleep_.still_steps = 0;
  return true;
}

DeviceContacts TissueSimulation::Contacts(std::uint32_t tool) {
  if (!tracks_[tool].present) {
    return {};
  }
  if (std::exchange(contacts_step_[tool], counters_.steps) + 1 < counters_.steps) {
    contacts_.Reset(tool, tracks_[tool].now);
  }
  return contacts_.Update(tool, tracks_[tool].now, collision_, grasps_[tool], step_s(),
                          implicit_ ? &tool_force_[tool] : nullptr);
}

CauteryContact TissueSimulation::Cautery(std::uint32_t tool) {
  CauteryContact contact = cautery_.Update(tool, tracks_[tool].now, collision_, step_s());
  if (solid_probe_ && contact.touching) {
    solid_probe_->Leave();
  } else if (solid_probe_) {
    solid_probe_->Update(tool, tracks_[tool].now, collision_, step_s(), &contact);
  }
  return contact;
}

/// body(part, worker) for each of ParticleStore::kParts, on the threads of the solver if it has any.
template <class Body>
void TissueSimulation::InParts(const Body& body) const {
  if (implicit_) {
    implicit_->workers().Run(ParticleStore::kParts, 0, body);
    return;
  }
  for (int part = 0; part < ParticleStore::kParts; ++part) {
    body(part, 0);
  }
}

float TissueSimulation::MaxDisplacement() const {
  std::array<float, ParticleStore::kParts> of_part{};
  InParts([&](int part, int) {
    const Index first = scene_.membrane.first, cols = scene_.membrane.cols;
    const auto cut = [](Index count, int at) {
      return static_cast<Index>(std::uint64_t{count} * static_cast<unsigned>(at) / ParticleStore::kParts);
    };
    float largest = 0;
    const auto measure = [&](ParticleRef at, Index particle) {
      largest = std::max(largest, (particles_.At(at) - scene_.rest_position[particle]).squaredNorm());
    };
    for (Index v = cut(particles_.tube_count(), part); v < cut(particles_.tube_count(), part + 1); ++v) {
      measure({4 * v, 1}, v);
    }
    for (Index row = cut(scene_.membrane.rows, part); row < cut(scene_.membrane.rows, part + 1); ++row) {
      for (Index col = 0; col < cols; ++col) {
        const Index node = row * cols + col;
        if (model_.NodeAlive(node) && !model_.IsDebris(node)) {
          measure(particles_.NodeRef(row, col), first + node);
        }
      }
    }
    of_part[static_cast<std::size_t>(part)] = largest;
  });
  return std::sqrt(*std::max_element(of_part.begin(), of_part.end()));
}

float TissueSimulation::awake_part() const {
  return sleep_.asleep ? 0.0f : implicit_ ? implicit_->regions().awake_part() : 1.0f;
}

std::uint64_t TissueSimulation::StateHash() const {
  std::array<std::uint64_t, ParticleStore::kParts> of_part{};
  InParts([&](int part, int) {
    Hash64 hash;
    for (const std::span<const float> floats : particles_.Part(part)) {
      hash.AddLong(floats);
    }
    of_part[static_cast<std::size_t>(part)] = hash.value();
  });
  Hash64 hash;
  hash.Add(std::span<const std::uint64_t>(of_part));
  hash.AddValue(model_.revision());
  if (tears_.torn_count() > 0) {
    hash.Add(tears_.torn());
  }
  clips_.AddTo(&hash);
  return hash.value();
}

SimulationMemory TissueSimulation::Save() const {
  SimulationMemory memory;
  memory.periods = counters_.periods;
  memory.last_periods = step_periods_;
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    memory.pose[i] = tracks_[i].now;
    memory.known[i] = tracks_[i].present;
    memory.grasp_state[i] = grasps_[i].state();
    memory.held[i] = grasps_[i].held();
  }
  if (tears_.torn_count() > 0) {
    memory.torn_edges.assign(tears_.torn().begin(), tears_.torn().end());
  }
  memory.clips = clips_.Save();
  return memory;
}

bool TissueSimulation::Restore(std::span<const float> xyz, std::span<const float> previous_xyz,
                               const SimulationMemory& memory) {
  const std::size_t floats = 3 * std::size_t{particles_.particle_count()};
  // False for NaN. Finite values are bounded too: squares of large coordinates overflow, and velocities are
  // differences.
  const auto near = [](float a, float b, float limit) { return std::abs(a - b) <= limit; };
  const auto within = [](std::span<const float> values) {
    return std::all_of(values.begin(), values.end(), [](float v) { return std::abs(v) <= kMostCoordinate_m; });
  };
  if (xyz.size() != floats || previous_xyz.size() != floats || !within(xyz) ||
      !std::equal(xyz.begin(), xyz.end(), previous_xyz.begin(),
                  [&](float now, float before) { return near(now, before, kMostTravel_m); })) {
    return false;
  }
  if ((!memory.torn_edges.empty() && !tears_.Fits(memory.torn_edges)) ||
      !clips_.Fits(memory.clips, particles_.particle_count())) {
    return false;
  }
  for (const auto& held : memory.held) {
    if (!std::all_of(held.begin(), held.end(), [&](const HeldParticle& h) {
          return h.particle < particles_.particle_count() && h.p_T.norm() <= kMostCoordinate_m;
        })) {
      return false;
    }
  }
  step_periods_ = std::clamp(memory.last_periods, 1u, kMostStepPeriods);
  particles_.SetAll(xyz, previous_xyz);
  if (implicit_) {
    for (Index p = 0; p < particles_.particle_count(); ++p) {
      const ParticleRef at = particles_.Ref(p);
      implicit_->SetVelocity(at, (particles_.At(at) - particles_.Previous(at)) / step_s());
    }
    implicit_->RestartSlides();
  }
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    tracks_[i] = {memory.known[i], memory.pose[i], memory.pose[i]};
    grasps_[i].Restore(memory.grasp_state[i], memory.held[i], &particles_);
  }
  clips_.Restore(memory.clips, particles_);
  tears_.Restore(memory.torn_edges);
  collision_.Restart();
  sheet_collision_.Restart();
  counters_.steps = counters_.periods = memory.periods;
  sleep_.asleep = false;
  sleep_.still_steps = 0;
  ++counters_.state_version;
  return true;
}

}  // namespace fulcrum::physics
