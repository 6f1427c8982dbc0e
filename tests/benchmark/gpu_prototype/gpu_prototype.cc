// What a compute backend of the implicit solver would need and gain: the kernels of its linear solve in OpenCL against
// those of the host, on whatever device there is, and a model of a GPU (deploy/docs/measurements/gpu.md). With
// FULCRUM_GPU_SCENE=FILE, a compiled scene, case `scene` counts and models that one.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <utility>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "tests/benchmark/gpu_prototype/device_solve.h"
#include "tests/benchmark/gpu_prototype/substep_cost.h"
#include "tests/benchmark/physics/scaled_scene.h"
#include "tests/benchmark/report.h"

namespace fulcrum::physics::gpu_prototype {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

constexpr int kIterations = 2;
constexpr double kSubsteps = 2;

/// Least time of `body` [us]: what a latency is without the machine's other work. Each sample is `inner` calls and one
/// `finish`.
template <class Body, class Finish>
double LeastUs(int samples, int inner, const Body& body, const Finish& finish) {
  const auto ms = TimeMs(2, samples, [&] {
    for (int i = 0; i < inner; ++i) body();
    finish();
  });
  return 1e3 * Quantile(ms, 0) / inner;
}

/// The same in processor time, of all threads.
template <class Body, class Finish>
double LeastProcessorUs(int samples, int inner, const Body& body, const Finish& finish) {
  std::vector<double> us;
  for (int sample = 0; sample < samples; ++sample) {
    const double begun = ProcessorUs();
    for (int i = 0; i < inner; ++i) body();
    finish();
    us.push_back((ProcessorUs() - begun) / inner);
  }
  return Quantile(us, 0);
}

struct Difference {
  double scale = 0;    ///< Largest value of the host.
  double largest = 0;  ///< Over `scale`.
  bool equal_bits = true;
};
template <class Floats>
Difference Compare(const Floats& host, const Floats& device, std::size_t first, std::size_t end) {
  Difference difference;
  for (std::size_t i = first; i < end; ++i) {
    difference.scale = std::max(difference.scale, std::abs(static_cast<double>(host[i])));
    difference.largest =
        std::max(difference.largest, std::abs(static_cast<double>(host[i]) - static_cast<double>(device[i])));
    difference.equal_bits =
        difference.equal_bits && std::bit_cast<std::uint32_t>(host[i]) == std::bit_cast<std::uint32_t>(device[i]);
  }
  difference.largest /= difference.scale > 0 ? difference.scale : 1;
  return difference;
}

void MeasureDevice(Device* device, Report* report) {
  if (!report->Wants("gpu.device.")) return;
  device->Build(
      "__kernel void Empty(__global float* unused) {}\n"
      "__kernel void Copy(__global const float* from, __global float* to) {\n"
      "  to[get_global_id(0)] = from[get_global_id(0)];\n"
      "}\n",
      "");
  std::fprintf(stderr, "device %s\n", device->name().c_str());
  const std::size_t floats = std::size_t{16} << 20;
  const Buffer from = device->MakeFrom(std::vector<float>(floats, 1.0f)), to = device->Make(sizeof(float) * floats);
  const auto finish = [&] { device->Finish(); };
  const auto empty = [&] { device->Launch("Empty", 1, to); };
  report->Add("gpu.device.rounds_correctly", device->rounds_correctly() ? 1 : 0, "1");
  report->Add("gpu.device.launch_us", LeastUs(21, 200, empty, finish), "us");
  report->Add("gpu.device.launch_and_wait_us", LeastUs(200, 1, empty, finish), "us");
  float value = 0;
  report->Add("gpu.device.read_us",
              LeastUs(
                  200, 1, [&] { device->Read(to, 0, &value, 1); }, [] {}),
              "us");
  const double copy_us = LeastUs(
      7, 1, [&] { device->Launch("Copy", floats, from, to); }, finish);
  report->Add("gpu.device.copy_GB_s", 2e-3 * sizeof(float) * static_cast<double>(floats) / copy_us, "GB/s");
}

/// A direction as the solver has it, and the host's product with it.
struct HostProduct {
  FloatArray direction, product;
  double sheet_dot = 0, organ_dot = 0;
};
HostProduct ProductOnHost(HostCase* host) {
  const std::size_t floats = host->model.layout.floats;
  HostProduct of{FloatArray(floats), FloatArray(floats)};
  host->ResetResidual();
  host->Solve();
  std::copy_n(host->scratch.krylov.z.data(), floats, of.direction.data());
  of.sheet_dot = host->ApplySheet(of.direction);
  of.organ_dot = host->ApplyOrgan(of.direction);
  std::copy_n(host->scratch.krylov.q.data(), floats, of.product.data());
  return of;
}

void CompareProduct(const std::string& stem, const HostProduct& expected, Product how, const HostCase& host,
                    DeviceSolve* solve, Report* report) {
  const implicit::FieldLayout& layout = host.model.layout;
  FloatArray product(layout.floats);
  solve->SetDirection(expected.direction);
  solve->ApplySheet(how);
  solve->ApplyOrgan();
  const Dots dots = solve->ReadDots();
  solve->ReadProduct(&product);
  const Difference sheet =
      Compare(expected.product, product, layout.tube_floats, layout.tube_floats + 3 * layout.plane);
  const Difference organ = Compare(expected.product, product, 0, implicit::kVertexFloats * layout.tube_count);
  report->Add(stem + "sheet_largest_difference", sheet.largest, "1");
  report->Add(stem + "sheet_equal_bits", sheet.equal_bits && dots.sheet == expected.sheet_dot ? 1 : 0, "1");
  report->Add(stem + "organ_largest_difference", organ.largest, "1");
  report->Add(stem + "organ_equal_bits", organ.equal_bits && dots.organ == expected.organ_dot ? 1 : 0, "1");
}

/// Matrix, residual and blocks of the membrane.
void CompareLinearisation(const std::string& stem, HostCase* host, Device* device, DeviceSolve* solve, Report* report) {
  const int samples = report->quick() ? 5 : 41;
  host->ResetResidual();
  host->LineariseSheet();
  solve->Linearise();
  const std::vector<float> expected = host->Linearisation(), planes = solve->ReadLinearisation();
  // By quantity, since their units differ.
  Difference difference;
  for (std::size_t first = 0, plane = host->model.layout.plane; first < planes.size(); first += 3 * plane) {
    const Difference of = Compare(expected, planes, first, first + 3 * plane);
    difference.largest = std::max(difference.largest, of.largest);
    difference.equal_bits = difference.equal_bits && of.equal_bits;
  }
  const auto time = [&](const auto& body) { return LeastProcessorUs(samples, 4, body, [&] { device->Finish(); }); };
  const double host_us = time([&] { host->LineariseSheet(); });
  report->Add(stem + "largest_difference", difference.largest, "1");
  report->Add(stem + "equal_bits", difference.equal_bits ? 1 : 0, "1");
  report->Add(stem + "host_cpu_us", host_us, "us");
  report->Add(stem + "over_host", time([&] { solve->Linearise(); }) / host_us, "1");
}

void TimeProduct(const std::string& stem, HostCase* host, Device* device, DeviceSolve* solve, Report* report) {
  const HostProduct expected = ProductOnHost(host);
  const FloatArray& direction = expected.direction;
  solve->SetDirection(direction);
  const int samples = report->quick() ? 5 : 41;
  const auto on_host = [&](const auto& body) { return LeastProcessorUs(samples, 4, body, [] {}); };
  const auto on_device = [&](const auto& body) {
    return LeastProcessorUs(samples, 4, body, [&] { device->Finish(); });
  };
  const double host_sheet = on_host([&] { (void)host->ApplySheet(direction); });
  const double host_organ = on_host([&] { (void)host->ApplyOrgan(direction); });
  const double one = on_device([&] { solve->ApplySheet(Product::kOneLaunch); });
  const double two = on_device([&] { solve->ApplySheet(Product::kTwoLaunches); });
  const double organ = on_device([&] { solve->ApplyOrgan(); });
  report->Add(stem + "product.host_sheet_cpu_us", host_sheet, "us");
  report->Add(stem + "product.host_organ_cpu_us", host_organ, "us");
  report->Add(stem + "product.sheet_over_host", two / host_sheet, "1");
  report->Add(stem + "product_in_one.sheet_over_host", one / host_sheet, "1");
  report->Add(stem + "product.organ_over_host", organ / host_organ, "1");
}

/// Two iterations on both, in a scene without bindings and hinges, which are not on the device.
void CompareSolve(const std::string& stem, HostCase* host, Device* device, DeviceSolve* solve, Report* report) {
  const std::size_t floats = host->model.layout.tube_floats + 3 * host->model.layout.plane;
  FloatArray d(host->model.layout.floats), expected(host->model.layout.floats);
  host->ResetResidual();
  host->Solve();
  std::copy_n(host->scratch.krylov.d.data(), floats, expected.data());
  host->ResetResidual();
  device->traffic = {};
  solve->Solve(&d);
  const Traffic traffic = device->traffic;
  const Difference difference = Compare(expected, d, 0, floats);
  report->Add(stem + "largest_correction_um", 1e6 * difference.scale, "um");
  report->Add(stem + "largest_difference", difference.largest, "1");
  report->Add(stem + "equal_bits", difference.equal_bits ? 1 : 0, "1");
  report->Add(stem + "launches", traffic.launches, "1");
  report->Add(stem + "transfers", traffic.reads + traffic.writes, "1");
  report->Add(stem + "transfer_kB", 1e-3 * static_cast<double>(traffic.bytes_read + traffic.bytes_written), "kB");
}

/// `over_host`: in processor time, which means something where the device is the host's processor. `_us`: wall time.
void TimeSolve(const std::string& stem, HostCase* host, Device* device, DeviceSolve* solve, Report* report) {
  const int samples = report->quick() ? 5 : 41;
  FloatArray d(host->model.layout.floats);
  const implicit::LinearSystem system = host->System();
  std::vector<double> sums;
  const auto finish = [&] { device->Finish(); };
  double host_cpu_us = 0;
  const auto time = [&](const char* what, const auto& body) {
    const double cpu_us = LeastProcessorUs(samples, 1, body, finish), least_us = LeastUs(samples, 1, body, finish);
    report->Add(stem + what + "_us", least_us, "us");
    if (host_cpu_us > 0) report->Add(stem + what + "_over_host", cpu_us / host_cpu_us, "1");
    return cpu_us;
  };
  host_cpu_us = time("host", [&] {
    host->ResetResidual();
    host->Solve();
  });
  report->Add(stem + "host_cpu_us", host_cpu_us, "us");
  (void)time("device", [&] {
    host->ResetResidual();
    solve->Solve(&d);
  });
  (void)time("queued", [&] { solve->Queue(); });
  (void)time("levels", [&] { host->SolveLevels(system, &sums); });
}

void AddModel(const std::string& stem, const HostCase& host, Report* report) {
  const auto stages = CostOfSubstep(host, kIterations);
  for (const StageCost& stage : stages) {
    std::string name = stage.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    report->Add(stem + "substep." + name + ".launches", stage.launches, "1");
    report->Add(stem + "substep." + name + ".phases", stage.phases, "1");
    report->Add(stem + "substep." + name + ".MB", 1e-6 * stage.bytes, "MB");
    report->Add(stem + "substep." + name + ".Mflop", 1e-6 * stage.flops, "Mflop");
  }
  const StageCost sum = SumOf(stages);
  report->Add(stem + "substep.launches", sum.launches, "1");
  report->Add(stem + "substep.phases", sum.phases, "1");
  report->Add(stem + "substep.MB", 1e-6 * sum.bytes, "MB");
  report->Add(stem + "substep.Mflop", 1e-6 * sum.flops, "Mflop");
  // Modelled: as the prototype is (coefficients and coarse nodes on the host); all on the device, a launch for each
  // loop; the loops of a phase fused and launched as one recorded graph.
  const struct {
    const char* name;
    double launches, launch_us;
    int round_trips;
  } designs[] = {{"as_prototype", static_cast<double>(sum.launches), 5, 7},
                 {"on_device_at_10us", static_cast<double>(sum.launches), 10, 1},
                 {"on_device_at_5us", static_cast<double>(sum.launches), 5, 1},
                 {"graph_of_phases_at_2us", static_cast<double>(sum.phases), 2, 1}};
  for (const auto& design : designs) {
    GpuModel gpu;
    gpu.launch_us = design.launch_us;
    const double out_us = BytesOut(host) / (1e3 * gpu.link_GB_s);
    const double us = kSubsteps * SubstepUs(gpu, design.launches, sum.bytes, design.round_trips) + out_us;
    report->Add(stem + "model." + design.name + "_ms", 1e-3 * us, "ms");
  }
}

void MeasureCase(const std::string& name, const SceneView& scene, Device* device, Report* report) {
  const std::string stem = "gpu." + name + ".";
  std::vector<double> step_ms;
  HostCase host(scene, report->quick() ? 10 : 25, &step_ms);
  report->Add(stem + "particles", static_cast<double>(scene.rest_position.size()), "1");
  report->Add(stem + "host_step_cpu_ms", Quantile(step_ms, 0), "ms");
  AddModel(stem, host, report);
  if (device == nullptr) return;
  const HostProduct product = ProductOnHost(&host);
  const implicit::Selection& elements = host.state.elements.computed();
  const bool whole = elements.bindings.empty() && elements.hinge_rows.empty();
  {
    DeviceSolve solve(device, &host);
    CompareProduct(stem + "product.", product, Product::kTwoLaunches, host, &solve, report);
    CompareProduct(stem + "product_in_one.", product, Product::kOneLaunch, host, &solve, report);
    if (whole) CompareSolve(stem + "solve.", &host, device, &solve, report);
    CompareLinearisation(stem + "linearise.", &host, device, &solve, report);
    TimeProduct(stem, &host, device, &solve, report);
    TimeSolve(stem + "solve.", &host, device, &solve, report);
  }
  DeviceSolve fused(device, &host, Rounding::kFused);
  CompareLinearisation(stem + "fused.linearise.", &host, device, &fused, report);
  CompareProduct(stem + "fused.product.", product, Product::kTwoLaunches, host, &fused, report);
  if (whole) CompareSolve(stem + "fused.solve.", &host, device, &fused, report);
}

/// Shares of a step of the built-in script on the host: what a faster solve cannot change.
void MeasureShares(const SceneView& scene, Report* report) {
  if (!report->Wants("gpu.script.")) return;
  TissueSimulation simulation(scene);
  StageTimes sum;
  double whole_ms = 0, models_ms = 0, hash_ms = 0;
  const int steps = report->quick() ? 600 : static_cast<int>(100 * scene.script_duration_s);
  for (int i = 0; i < steps; ++i) {
    const auto tools = ScriptedTools(scene, 0.01 * i);
    StepReport step;
    const double ms = TimeMs(0, 1, [&] { step = simulation.Step(tools); }).front();
    const double models = TimeMs(0, 1, [&] {
                            for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) (void)simulation.Contacts(tool);
                          }).front();
    if (step.asleep) continue;
    whole_ms += ms + models;
    models_ms += models;
    hash_ms += TimeMs(0, 1, [&] { benchmark::DoNotOptimise(simulation.StateHash()); }).front();
    sum.contacts_ns += step.stages.contacts_ns;
    sum.prediction_ns += step.stages.prediction_ns;
    sum.linearisation_ns += step.stages.linearisation_ns;
    sum.solve_ns += step.stages.solve_ns;
    sum.update_ns += step.stages.update_ns;
  }
  whole_ms += hash_ms;
  const auto share = [&](const char* stage, double ms) {
    report->Add(std::string("gpu.script.") + stage + "_pct", 100 * ms / whole_ms, "%");
  };
  share("contacts", 1e-6 * static_cast<double>(sum.contacts_ns));
  share("prediction", 1e-6 * static_cast<double>(sum.prediction_ns));
  share("linearisation", 1e-6 * static_cast<double>(sum.linearisation_ns));
  share("solve", 1e-6 * static_cast<double>(sum.solve_ns));
  share("update", 1e-6 * static_cast<double>(sum.update_ns));
  share("contact_models", models_ms);
  share("state_hash", hash_ms);
}

}  // namespace
}  // namespace fulcrum::physics::gpu_prototype

int main(int argc, char** argv) {
  using namespace fulcrum;
  using namespace fulcrum::physics::gpu_prototype;
  benchmark::Report report(argc, argv);
  if (!report.Wants("gpu.")) return 0;
  std::optional<Device> device;
  try {
    device.emplace();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_gpu_prototype: %s\n", error.what());
    return 1;
  }
  MeasureDevice(&*device, &report);
  if (report.Wants("gpu.built_in.") || report.Wants("gpu.script.")) {
    const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
    if (report.Wants("gpu.built_in.")) MeasureCase("built_in", data.View(), &*device, &report);
    MeasureShares(data.View(), &report);
  }
  if (const char* const file = std::getenv("FULCRUM_GPU_SCENE"); file != nullptr && report.Wants("gpu.scene.")) {
    const scene::SceneFile scene(file);
    MeasureCase("scene", scene.view(), nullptr, &report);
  }
  for (const int factor : {1, 3, 10}) {
    const std::string name = "x" + std::to_string(factor);
    if (!report.Wants("gpu." + name + ".")) continue;
    const scene::SceneData data = physics::MakeScaledScene(factor);
    MeasureCase(name, data.View(), &*device, &report);
  }
}
