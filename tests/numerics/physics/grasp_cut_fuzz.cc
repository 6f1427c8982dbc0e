#include "tests/numerics/physics/grasp_cut_fuzz.h"

#include <algorithm>
#include <vector>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/numerics/physics/tissue_validator.h"
#include "tests/support/several_solids.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {
namespace {

constexpr float kOpen = 0.9f, kClosed = 0.0f;
/// Number of cuts after which the sheet is restored, as after a loss of the thermal state.
constexpr int kCutsPerSheet = 60;
constexpr int kRestSteps = 1500;
/// Bounds while tools act: the largest pull of a grasper and the speed limit of the solver.
constexpr TissueBounds kActing{0.120f, 5.0f, 20.0f, false};
/// Of the strands: a pull of 8 N stretches them by half.
constexpr double kStrand_Pa = 2e6;
/// Bounds at rest: a cut sheet under tension retracts from the cut, and its flaps stay where they have fallen. Some
/// flaps keep moving: there the preconditioned matrix exceeds what two iterations can handle.
constexpr TissueBounds kResting{0.030f, 0.3f, 0.0f, true};
/// Beside several solids flaps of a cut sheet stay where they hang over a strand: asleep, 60.4 mm from rest at most in
/// what has been seen.
constexpr TissueBounds kRestingOnSeveral{0.075f, 0.3f, 0.0f, true};

/// Forty millimetres of the small scene, in which a step takes some tens of microseconds.
scene::SceneData TinyScene(bool two_graspers, bool several_solids) {
  scene::SceneSettings settings = scene::Small();
  settings.tube.rings = 6;
  settings.tube.segments = 8;
  settings.tube.length_m = 0.040;
  settings.tube.fold_count = 1;
  settings.membrane.rows = 25;
  settings.membrane.cols = 17;
  if (two_graspers) {
    settings.tools[1] = scene::DefaultTool(ToolKind::kGrasper, settings.tools[1].p_WP);
  }
  return several_solids ? WithSolids(settings, {0.036, -0.02, 0.02}, true, kStrand_Pa, true)
                        : scene::BuildProcedural(settings);
}

}  // namespace

GraspCutFuzz::GraspCutFuzz(unsigned seed, bool several_solids)
    : random_(seed),
      several_solids_(several_solids),
      data_(TinyScene(seed % 2 == 1, several_solids)),
      scene_(data_.View()),
      simulation_(std::make_unique<TissueSimulation>(scene_)),
      topology_(WholeTopology(scene_)) {}

void GraspCutFuzz::Step() {
  // A node that is late simulates up to three periods in a step.
  report_ = simulation_->Step(tools_, Unit() < 0.8f ? 1 : 2 + Below(2));
  ++counts_.steps;
  counts_.farthest_m = std::max(counts_.farthest_m, simulation_->MaxDisplacement());
  counts_.fastest_m_s = std::max(counts_.fastest_m_s, report_.max_step_m / simulation_->step_s());
}

/// Near the present position of a random node, sometimes of a vertex of a solid; somewhat above or in it.
Vec3f GraspCutFuzz::PlaceOnTissue() {
  const Index first = scene_.membrane.first;
  const Index p = Unit() < (several_solids_ ? 0.5f : 0.8f) ? first + Below(scene_.membrane.node_count()) : Below(first);
  const Vec3f off(0.004f * (Unit() - 0.5f), 0.004f * (Unit() - 0.5f), 0.010f * (Unit() - 0.6f));
  return simulation_->particles().At(simulation_->particles().Ref(p)) + off;
}

void GraspCutFuzz::Drive(std::size_t tool, const Vec3f& tip, float jaw_rad, int steps) {
  const Vec3f above = tip + Vec3f(0, 0, 0.03f);
  ToolInput& input = tools_[tool];
  const ToolPose from = input.present ? input.pose : PoseAtTip(scene_.tools[tool], above, jaw_rad);
  const ToolPose to = PoseAtTip(scene_.tools[tool], tip, jaw_rad);
  for (int i = 1; i <= steps; ++i) {
    input = {true, Interpolate(from, to, static_cast<float>(i) / static_cast<float>(steps))};
    Step();
  }
}

void GraspCutFuzz::DoGrasp(std::size_t tool) {
  const Vec3f place = PlaceOnTissue();
  Drive(tool, place, kOpen, 3 + static_cast<int>(Below(10)));
  Drive(tool, place, kClosed, 1 + static_cast<int>(Below(6)));
  ++counts_.grasps;
  counts_.holds += simulation_->grasp(static_cast<std::uint32_t>(tool)).holding();
}

/// Moves the tool away, mostly without a change of the jaws, upward more often than not.
void GraspCutFuzz::DoPull(std::size_t tool) {
  if (!tools_[tool].present) {
    return DoGrasp(tool);
  }
  const Vec3f by(0.03f * (Unit() - 0.5f), 0.03f * (Unit() - 0.5f), 0.03f * (Unit() - 0.25f));
  const float jaw = Unit() < 0.8f ? tools_[tool].pose.jaw_rad : 0.3f * Unit();
  Drive(tool, tools_[tool].pose.p_WT + by, jaw, 2 + static_cast<int>(Below(12)));
  ++counts_.pulls;
}

/// Opens the jaws, or removes the tool.
void GraspCutFuzz::DoRelease(std::size_t tool) {
  if (Unit() < 0.2f) {
    tools_[tool].present = false;
    Step();
  } else if (tools_[tool].present) {
    Drive(tool, tools_[tool].pose.p_WT, kOpen, 1 + static_cast<int>(Below(5)));
    Drive(tool, tools_[tool].pose.p_WT + Vec3f(0, 0, 0.04f * Unit()), kOpen, 2 + static_cast<int>(Below(8)));
  }
  ++counts_.releases;
}

void GraspCutFuzz::Publish() {
  ++topology_.revision;
  const Index nodes = scene_.membrane.node_count();
  Index debris = 0;
  simulation_->ApplyTopology(topology_);
  for (Index node = 0; node < nodes; ++node) {
    debris += simulation_->model().IsDebris(node) && !simulation_->model().IsAbsent(node);
  }
  counts_.debris = std::max(counts_.debris, static_cast<int>(debris));
}

/// Cuts edges and nodes anywhere and shrinks some other edges.
void GraspCutFuzz::DoCut() {
  const Index nodes = scene_.membrane.node_count();
  for (Index i = Below(8); i > 0; --i) {
    SetBit(topology_.dead_edges, Below(3 * nodes));
  }
  for (Index i = Below(3); i > 0; --i) {
    SetBit(topology_.dead_nodes, Below(nodes));
  }
  for (Index i = Below(4); i > 0; --i) {
    std::uint8_t& shrink = topology_.shrink[Below(3 * nodes)];
    shrink = static_cast<std::uint8_t>(std::max<Index>(shrink, Below(154)));  // Up to 30 %, as heat does.
  }
}

/// Cuts around a rectangle of the sheet, or along a row, so that pieces are freed.
void GraspCutFuzz::DoSlit() {
  const Index rows = scene_.membrane.rows, cols = scene_.membrane.cols;
  const Index row0 = Below(rows), col0 = Below(cols), height = Below(6), width = 2 + Below(6);
  for (Index row = row0; row <= std::min(row0 + height, rows - 1); ++row) {
    for (Index col = col0; col <= std::min(col0 + width, cols - 1); ++col) {
      if (row == row0 || row == row0 + height || col == col0 || col == col0 + width) {
        SetBit(topology_.dead_nodes, row * cols + col);
      }
    }
  }
}

/// Restarts the process from its checkpoint; the topology follows after some steps.
void GraspCutFuzz::DoRestart() {
  const ParticleStore& particles = simulation_->particles();
  std::vector<float> xyz(3 * std::size_t{particles.particle_count()}), previous(xyz.size());
  particles.CopyPositions(xyz);
  particles.CopyPrevious(previous);
  const SimulationMemory memory = simulation_->Save();
  simulation_ = std::make_unique<TissueSimulation>(scene_);
  simulation_->Restore(xyz, previous, memory);
  simulation_->LetStillBodiesSleep();
  for (Index i = Below(3); i > 0; --i) {
    Step();
  }
  Publish();
  ++counts_.restarts;
}

std::string GraspCutFuzz::Operate() {
  const std::size_t tool = Below(kOperated);
  const float what = Unit();
  if (what < 0.28f) {
    DoGrasp(tool);
  } else if (what < 0.50f) {
    DoPull(tool);
  } else if (what < 0.70f) {
    DoRelease(tool);
  } else if (what < 0.98f) {
    if (++cuts_since_whole_ > kCutsPerSheet) {
      const std::uint64_t revision = topology_.revision;
      topology_ = WholeTopology(scene_);
      topology_.revision = revision;
      cuts_since_whole_ = 0;
      ++counts_.revivals;
    } else if (Unit() < 0.85f) {
      DoCut();
    } else {
      DoSlit();
    }
    Publish();
    ++counts_.cuts;
  } else if (what < 0.99f) {
    DoRestart();
  } else {
    simulation_->SetCheaper(Below(2));
  }
  Step();
  return FaultOf(simulation_.get(), scene_, report_, kActing);
}

std::string GraspCutFuzz::Rest() {
  tools_ = {};
  Step();
  for (int i = 0; i < kRestSteps && !simulation_->asleep(); ++i) {
    Step();
  }
  ++counts_.rests;
  counts_.farthest_at_rest_m = std::max(counts_.farthest_at_rest_m, simulation_->MaxDisplacement());
  counts_.restless += simulation_->asleep() ? 0 : 1;
  counts_.fastest_at_rest_m_s = std::max(counts_.fastest_at_rest_m_s, report_.max_step_m / simulation_->step_s());
  return FaultOf(simulation_.get(), scene_, report_, several_solids_ ? kRestingOnSeveral : kResting);
}

}  // namespace fulcrum::physics
