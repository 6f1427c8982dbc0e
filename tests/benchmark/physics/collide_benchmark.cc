// Cost of the tools' collision in each step of the built-in scene's script.
#include <algorithm>
#include <chrono>
#include <cstdio>

#include "physics_node/collision/tissue_collision.h"
#include "physics_node/contact_model/cautery_probe.h"
#include "physics_node/contact_model/surface_curvature.h"
#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/report.h"

namespace fulcrum::physics {
namespace {

using benchmark::Quantile;

double NowUs() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Times of one step [us per tool].
struct Cost {
  double find = 3e38, project = 3e38, rows = 3e38;
  double curvature = 3e38;  ///< Sum over the tools near a surface; 0: none is near.
  double tissue = 3e38;     ///< Per step, not per tool.
  double footprint = 3e38;  ///< Contact of the hook, footprint included; 0: no contact.
  double slits = 3e38;      ///< As `footprint`, where every second row of triangles lies over a slit.
  void TakeLess(const Cost& other) {
    find = std::min(find, other.find);
    project = std::min(project, other.project);
    rows = std::min(rows, other.rows);
    curvature = std::min(curvature, other.curvature);
    tissue = std::min(tissue, other.tissue);
    footprint = std::min(footprint, other.footprint);
    slits = std::min(slits, other.slits);
  }
};

struct Counts {
  std::size_t pairs = 0, rows = 0, tissue_rows = 0;
};

/// Topology in which the edges of every second row are severed.
TopologyState EverySecondRowSevered(const MembraneGrid& grid) {
  TopologyState topology;
  topology.rows = grid.rows;
  topology.cols = grid.cols;
  topology.dead_nodes.assign((grid.node_count() + 7) / 8, 0);
  topology.dead_edges.assign((3 * grid.node_count() + 7) / 8, 0);
  topology.shrink.assign(3 * grid.node_count(), 0);
  for (std::size_t row = 0; row < grid.rows; row += 2) {
    for (std::size_t node = row * grid.cols; node < (row + 1) * grid.cols; ++node) {
      SetBit(topology.dead_edges, 3 * node + 1);
      SetBit(topology.dead_edges, 3 * node + 2);
    }
  }
  return topology;
}

/// One pass over the script: the simulation moves tissue and tools, a separate collision is timed beside it.
std::vector<Cost> Pass(const SceneView& scene, Counts* most) {
  TissueSimulation simulation(scene);
  ParticleStore& particles = simulation.particles();
  TissueModel model(scene, &particles);
  ToolCollision collision(scene, &model, &particles);
  TissueCollision tissue(scene, &model, &particles);
  SurfaceCurvature curvature(scene, &model, &particles);
  CauteryProbe cautery(scene, &model, &particles);
  ParticleStore cut_particles(scene);
  TissueModel cut_model(scene, &cut_particles);
  cut_model.Apply(EverySecondRowSevered(scene.membrane), &cut_particles);
  CauteryProbe cut_cautery(scene, &cut_model, &cut_particles);
  std::vector<Cost> costs;
  std::vector<float> moved, xyz(3 * std::size_t{particles.particle_count()}), previous(xyz.size());
  std::vector<ContactRow> rows;
  rows.reserve(TissueCollision::kMaxRows);
  std::array<ToolInput, kMaxTools> last;
  const int end = static_cast<int>(scene.script_duration_s * 100);
  for (int index = 0; index < end; ++index) {
    const auto tools = ScriptedTools(scene, 0.01 * index);
    simulation.Step(tools);
    std::array<ToolCollision::ToolMotion, kMaxTools> motions;
    int count = 0;
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      if (tools[i].present) {
        const ToolPose& from = last[i].present ? last[i].pose : tools[i].pose;
        motions[i] = {ShapeOf(scene.tools[i], from), ShapeOf(scene.tools[i], tools[i].pose),
                      simulation.grasp(static_cast<std::uint32_t>(i)).holding(), tools[i].pose.jaw_rad < from.jaw_rad};
        ++count;
      }
    }
    last = tools;
    if (count == 0) {
      continue;
    }
    particles.CopyPositions(xyz);
    particles.CopyPrevious(previous);
    const double t0 = NowUs();
    collision.FindPairs(motions, true);
    const double t1 = NowUs();
    for (const float u : {0.0f, 0.5f}) {
      collision.Rows(u, u + 0.5f, &rows);
      collision.TakeForces(rows);
      most->rows = std::max(most->rows, rows.size());
    }
    const double t2 = NowUs();
    collision.Sweep();
    for (std::uint32_t iteration = 0; iteration < scene.physics.iterations; ++iteration) {
      collision.Project();
    }
    collision.Settle();
    const double t3 = NowUs();
    particles.SetAll(xyz, previous);
    particles.MeasureMoves(&moved);
    rows.clear();
    const double t4 = NowUs();
    tissue.FindPairs(moved, 0, 0);
    for (const float u : {0.0f, 0.5f}) {
      rows.clear();
      tissue.Rows(u, u + 0.5f, &rows);
    }
    const double t5 = NowUs();
    std::array<SurfacePoint, kMaxTools> nearest;
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      constexpr float kReach = 0.010f;
      nearest[i] =
          tools[i].present ? collision.Nearest(WorkingLine(scene.tools[i], tools[i].pose), kReach) : nearest[i];
    }
    const double t6 = NowUs();
    for (const SurfacePoint& point : nearest) {
      (void)curvature.At(point, false, (point.closest.on_segment - point.closest.on_triangle).stableNormalized());
    }
    const double t7 = NowUs();
    double footprint = 0, slits = 0;
    cut_particles.SetAll(xyz, previous);
    for (std::uint32_t i = 0; i < kMaxTools; ++i) {
      if (!tools[i].present || scene.tools[i].kind != ToolKind::kHook) {
        continue;
      }
      const double begin = NowUs();
      const bool touches = cautery.Update(i, tools[i].pose, collision, scene.physics.dt_s).touching;
      footprint = touches ? NowUs() - begin : 0;
      const double begin_slits = NowUs();
      const bool touches_lips = cut_cautery.Update(i, tools[i].pose, collision, scene.physics.dt_s).touching;
      slits = touches_lips ? NowUs() - begin_slits : 0;
    }
    most->tissue_rows = std::max(most->tissue_rows, rows.size());
    costs.push_back(
        {(t1 - t0) / count, (t3 - t2) / count, (t2 - t1) / count,
         std::any_of(nearest.begin(), nearest.end(), [](const SurfacePoint& p) { return p.found; }) ? t7 - t6 : 0,
         t5 - t4, footprint, slits});
    most->pairs = std::max(most->pairs, collision.pairs().size());
  }
  return costs;
}

void Collide(const SceneView& scene, benchmark::Report* report) {
  // The minimum of some passes for each step excludes the time of other programs.
  Counts most;
  std::vector<Cost> costs = Pass(scene, &most);
  for (int pass = 1; pass < (report->quick() ? 2 : 5); ++pass) {
    const std::vector<Cost> again = Pass(scene, &most);
    for (std::size_t i = 0; i < costs.size(); ++i) {
      costs[i].TakeLess(again[i]);
    }
  }
  std::vector<double> find, with_rows, with_projection, curvature, tissue, footprint, slits;
  for (const Cost& cost : costs) {
    find.push_back(cost.find);
    tissue.push_back(cost.tissue);
    if (cost.curvature > 0) {
      curvature.push_back(cost.curvature);  // Mean over the tools near a surface.
    }
    if (cost.footprint > 0) {
      footprint.push_back(cost.footprint);
    }
    if (cost.slits > 0) {
      slits.push_back(cost.slits);
    }
    with_rows.push_back(cost.find + cost.rows);
    with_projection.push_back(cost.find + cost.project);
  }
  report->Add("physics.collide.us_per_tool_p50", Quantile(with_rows, 0.5), "us");
  report->Add("physics.collide.us_per_tool_p99", Quantile(with_rows, 0.99), "us");
  report->Add("physics.collide.paper_us_per_tool_p50", Quantile(with_projection, 0.5), "us");
  report->Add("physics.collide.paper_us_per_tool_p99", Quantile(with_projection, 0.99), "us");
  report->Add("physics.collide.find_us_per_tool_p50", Quantile(find, 0.5), "us");
  report->Add("physics.collide.find_us_per_tool_p99", Quantile(find, 0.99), "us");
  report->Add("physics.collide.curvature_us_p50", Quantile(curvature, 0.5), "us");
  report->Add("physics.collide.curvature_us_p99", Quantile(curvature, 0.99), "us");
  report->Add("physics.collide.footprint_us_p50", Quantile(footprint, 0.5), "us");
  report->Add("physics.collide.footprint_us_p99", Quantile(footprint, 0.99), "us");
  report->Add("physics.collide.footprint_slits_us_p50", Quantile(slits, 0.5), "us");
  report->Add("physics.collide.footprint_slits_us_p99", Quantile(slits, 0.99), "us");
  report->Add("physics.collide.tissue_us_p50", Quantile(tissue, 0.5), "us");
  report->Add("physics.collide.tissue_us_p99", Quantile(tissue, 0.99), "us");
  report->Add("physics.collide.tissue_rows_max", static_cast<double>(most.tissue_rows), "1");
  report->Add("physics.collide.pairs_max", static_cast<double>(most.pairs), "1");
  report->Add("physics.collide.rows_max", static_cast<double>(most.rows), "1");
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (!report.Wants("physics.collide.")) {
    return 0;
  }
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  physics::Collide(data.View(), &report);
  return 0;
}
