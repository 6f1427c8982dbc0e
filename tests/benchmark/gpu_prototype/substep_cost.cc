#include "tests/benchmark/gpu_prototype/substep_cost.h"

#include "physics_node/implicit/phases.h"

namespace fulcrum::physics::gpu_prototype {

std::vector<StageCost> CostOfSubstep(const HostCase& host, int iterations) {
  constexpr double kFloat = sizeof(float);
  const implicit::OrganModel& model = host.model.organ;
  const implicit::RegionSet& computed = host.state.regions.computed();
  double nodes = 0, vertices = 0, links = 0, row_sums = 0;
  const double row_width = static_cast<double>(host.state.coarse.row_width());
  for (const implicit::Task& task : computed.tasks) {
    const double length = task.end - task.first;
    nodes += task.sheet ? length * static_cast<double>(host.model.layout.stride) : 0;
    row_sums += task.sheet ? length * row_width : 0;
    vertices += task.sheet ? 0 : length;
  }
  for (const implicit::Task& task : computed.patches) {
    links += model.start[implicit::Vertex(task.end)] - model.start[implicit::Vertex(task.first)];
  }
  const auto elements = static_cast<double>(host.state.elements.computed().bindings.size() +
                                            host.state.elements.computed().hinge_rows.size());
  const double hats = row_sums / implicit::kHatSpacing / 3;
  const auto stage = [&](const char* name, int launches, int phases, double floats, double flops) {
    return StageCost{name, launches, phases, kFloat * floats, flops};
  };
  std::vector<StageCost> stages;
  // Membrane, organ; held, pressed and frayed particles; the largest velocity.
  stages.push_back(stage("predict", 4, 2, 10 * nodes + 12 * vertices, 15 * nodes + 20 * vertices));
  // Cells, patches, hinges, bindings; nodes and edges, residual and blocks of the organ; hats, forces of the elements.
  const double of_patches = 5 * links + 46 * vertices, of_vertices = 5 * links + 36 * vertices,
               of_blocks = (5 * links + 24 * vertices) / 2;
  stages.push_back(stage("linearise", 9, 3,
                         (29 + 42) * nodes + of_patches + of_vertices + of_blocks + 47 * hats + 30 * elements,
                         (330 + 150) * nodes + (24 + 32 + 25) * links + (150 + 30 + 30) * vertices + 250 * hats));
  // Restriction of both; to hats, to coarse nodes, their solve with a stored inverse, back to hats; z of both; three
  // sums; the coefficient. Once an iteration. The coarse matrix is not counted: it depends on how it is stored.
  const double repeats = iterations;
  stages.push_back(stage("precondition", 12 * iterations, 9 * iterations,
                         repeats * ((4 + 14 + 1) * nodes + 3 * row_sums + 12 * hats + 48 * vertices),
                         repeats * ((12 + 60) * nodes + 4 * row_sums + 80 * vertices)));
  // Patches, hinges, bindings; membrane and vertices; contacts; three sums; the coefficient.
  const double of_stress = 5 * links + 44 * vertices, of_apply = 5 * links + 26 * vertices;
  stages.push_back(stage("product", 10 * (iterations - 1), 5 * (iterations - 1),
                         (repeats - 1) * ((23 + 1) * nodes + of_stress + of_apply + 20 * elements),
                         (repeats - 1) * (165 * nodes + (24 + 32) * links + (90 + 15) * vertices + 20 * elements)));
  // Products of the elements, then residual and correction; from the third iteration on the direction.
  const int combines = iterations > 2 ? iterations - 2 : 0;
  stages.push_back(stage("advance", 2 * (iterations - 1) + combines, 2 * (iterations - 1) + combines,
                         (repeats - 1 + combines) * (9 * nodes + 12 * vertices),
                         (repeats - 1 + combines) * 6 * (nodes + vertices)));
  stages.push_back(stage("curvature", 8, 4, 21 * nodes + 5 * links + 45 * vertices + 20 * elements,
                         110 * nodes + 28 * links + 120 * vertices));
  // The step; the residual where it is a force, in three loops over few regions; the largest correction by region.
  stages.push_back(stage("last step", 5, 3, 10 * nodes + 12 * vertices, 15 * (nodes + vertices)));
  stages.push_back(stage("update", 3, 2, 16 * nodes + 20 * vertices, 25 * (nodes + vertices)));
  return stages;
}

StageCost SumOf(const std::vector<StageCost>& stages) {
  StageCost sum;
  for (const StageCost& stage : stages) {
    sum.launches += stage.launches;
    sum.phases += stage.phases;
    sum.bytes += stage.bytes;
    sum.flops += stage.flops;
  }
  return sum;
}

double BytesOut(const HostCase& host) {
  const implicit::FieldLayout& layout = host.model.layout;
  return sizeof(float) * static_cast<double>(layout.tube_floats + 3 * layout.plane);
}

double SubstepUs(const GpuModel& model, double launches, double bytes, int round_trips) {
  return launches * model.launch_us + bytes / (1e3 * model.bandwidth_GB_s) + round_trips * model.round_trip_us;
}

}  // namespace fulcrum::physics::gpu_prototype
