// Several solids: what a frame of the solver costs while all of ten move, one does, or none; how far solids that hang
// on each other sag compared with the reference, and what a frame of that costs; what sliding tissue holds, and its
// cost over that of glued tissue. Without contacts, tools and publishing.
#include <cmath>
#include <numbers>

#include "tests/benchmark/report.h"
#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/reference/static_solver.h"
#include "tests/support/sliding_blocks.h"

namespace fulcrum::physics {
namespace {

constexpr int kBoxes = 10;

/// The small scene with ten boxes of a thousand vertices in a row beside it, each held below.
scene::SceneData TenBoxes() {
  scene::SceneSettings settings = scene::Small();
  settings.physics.mode = PhysicsMode::kAccurate;
  scene::Anatomy anatomy = scene::ProceduralAnatomy(settings);
  for (int i = 0; i < kBoxes; ++i) {
    const Vec3d low(0.12, 0.05 * (i - 0.5 * kBoxes), 0);
    anatomy.solids.push_back(Box("box", low, {0.04, 0.04, 0.04}, {9, 9, 9}, 2e4));
    Fix(&anatomy.solids.back(), [](const Vec3d& p) { return p.z() < 1e-6; });
  }
  return scene::AssembleScene(settings, anatomy);
}

/// Median time of a frame in which the tops of the first `moving` boxes are led to and fro, after a second of it.
double FrameMs(const SceneView& scene, int moving, int frames) {
  AccurateUnderTest solver(scene);
  std::vector<Index> held;
  for (int i = 0; i < moving; ++i) {
    const Solid& box = scene.solids[static_cast<std::size_t>(i) + 1];
    // The middle of the upper side.
    for (const Index v : {944u, 945u, 954u, 955u}) held.push_back(box.first_vertex + v);
  }
  solver.Hold(held);
  int frame = 0;
  return benchmark::Quantile(
      benchmark::TimeMs(100, frames,
                        [&] {
                          std::vector<Vec3f> places;
                          const float s = std::sin(0.04f * std::numbers::pi_v<float> * static_cast<float>(++frame));
                          for (const Index v : held) {
                            places.push_back(scene.rest_position[v] + Vec3f(0.003f * s, 0, 0));
                          }
                          solver.MoveHeld(places);
                          solver.Step();
                        }),
      0.5);
}

void Ten(benchmark::Report* report) {
  const scene::SceneData data = TenBoxes();
  const SceneView scene = data.View();
  const int frames = report->quick() ? 50 : 400;
  report->Add("body.ten.vertices", static_cast<double>(scene.rest_position.size()), "1");
  const double all = FrameMs(scene, kBoxes, frames), one = FrameMs(scene, 1, frames), none = FrameMs(scene, 0, frames);
  report->Add("body.ten.solver_ms.all_move", all, "ms");
  report->Add("body.ten.solver_ms.one_moves", one, "ms");
  report->Add("body.ten.solver_ms.rest", none, "ms");
  report->Add("body.idle_cost_ratio", one / all, "1");
}

void Sag(benchmark::Report* report) {
  scene::SceneData data = SeveralSolids(Vec3f(0, 0, -9.81f));
  const Solid lump = data.solids[2];
  std::fill_n(data.inverse_mass.begin() + lump.first_vertex, lump.vertex_count, 0.0f);
  const SceneView scene = data.View();
  const reference::ElasticEnergy energy(BuildElasticModel(scene));
  const reference::Points rest = reference::RestPoints(energy.model());
  const reference::Points truth = reference::SolveStatic(energy, rest, {}, {}).x;
  AccurateUnderTest solver(scene);
  const double ms = benchmark::Quantile(benchmark::TimeMs(0, 60, [&] { solver.Step(); }), 0.5);
  for (int i = 0; i < 140; ++i) solver.Step();
  Eigen::Matrix3Xf xyz(3, rest.cols());
  solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
  double worst = 0;
  for (const Solid& solid : data.solids) {
    const auto of = [&](const reference::Points& p) { return p.middleCols(solid.first_vertex, solid.vertex_count); };
    const double sag = (of(truth) - of(rest)).norm();
    if (sag > 0) worst = std::max(worst, (of(xyz.cast<double>()) - of(truth)).norm() / sag);
  }
  report->Add("body.sag.solver_ms_p50", ms, "ms");
  report->Add("body.sag.error_pct", 100 * worst, "%");
}

/// Two blocks, the upper one held and led by `way`, then at rest: the force on it, and the time of a frame meanwhile.
struct Led {
  Vec3d force_N;
  double frame_ms;
};
Led Lead(scene::AttachKind kind, const Vec3f& way) {
  const scene::SceneData data = TwoBlocks(kind);
  const SceneView scene = data.View();
  const Solid& upper = scene.solids[kUpperBlock];
  AccurateUnderTest solver(scene);
  std::vector<Index> held;
  for (Index v = upper.first_vertex; v < upper.first_vertex + upper.vertex_count; ++v) held.push_back(v);
  solver.Hold(held);
  int frame = 0;
  const std::vector<double> times = benchmark::TimeMs(0, 80, [&] {
    std::vector<Vec3f> places;
    const float part = std::min(1.0f, static_cast<float>(++frame) / 40);
    for (const Index v : held) places.push_back(scene.rest_position[v] + part * way);
    solver.MoveHeld(places);
    solver.Step();
  });
  Eigen::Matrix3Xf xyz(3, static_cast<Eigen::Index>(scene.rest_position.size()));
  solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
  reference::Points gradient;
  reference::ElasticEnergy(BuildElasticModel(scene)).Gradient(xyz.cast<double>(), &gradient);
  // Forces within the block add up to nothing.
  return {-gradient.rightCols(upper.vertex_count).rowwise().sum(), benchmark::Quantile(times, 0.5)};
}

/// Of sliding tissue: what it holds in the plane over what glued tissue does, the error of its stiffness along the
/// normal against glued tissue, of the way down an incline against the closed solution, and the time over that of glued
/// tissue.
void Slide(benchmark::Report* report) {
  using scene::AttachKind;
  const Vec3f along(0.002f, 0, 0), off(0, 0, 0.0005f);
  const Led glued_along = Lead(AttachKind::kGlued, along), sliding_along = Lead(AttachKind::kSliding, along);
  const Led glued_off = Lead(AttachKind::kGlued, off), sliding_off = Lead(AttachKind::kSliding, off);
  report->Add("body.slide.in_plane_pct", 100 * std::abs(sliding_along.force_N.x() / glued_along.force_N.x()), "%");
  report->Add("body.slide.normal_error_pct", 100 * std::abs(sliding_off.force_N.z() / glued_off.force_N.z() - 1), "%");
  report->Add("body.slide.time_ratio", sliding_along.frame_ms / glued_along.frame_ms, "1");

  const double down = 4.905;  // Thirty degrees.
  const scene::SceneData data = TwoBlocks(AttachKind::kSliding, Vec3f(static_cast<float>(down), 0, -8.496f));
  const SceneView scene = data.View();
  const Solid& upper = scene.solids[kUpperBlock];
  AccurateUnderTest solver(scene);
  constexpr int kSteps = 9;
  for (int i = 0; i < kSteps; ++i) solver.Step();
  Eigen::Matrix3Xf xyz(3, static_cast<Eigen::Index>(scene.rest_position.size()));
  solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
  double moved = 0;
  for (Index v = upper.first_vertex; v < upper.first_vertex + upper.vertex_count; ++v) {
    moved += static_cast<double>(xyz(0, v) - scene.rest_position[v].x()) / upper.vertex_count;
  }
  const double c = static_cast<double>(scene.physics.damping_per_s);
  const double t = kSteps * static_cast<double>(scene.physics.dt_s);
  const double free = down * (t / c - (1 - std::exp(-c * t)) / (c * c));
  report->Add("body.slide.incline_error_pct", 100 * std::abs(moved / free - 1), "%");
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (report.Wants("body.ten.") || report.Wants("body.idle_cost_ratio")) fulcrum::physics::Ten(&report);
  if (report.Wants("body.sag.")) fulcrum::physics::Sag(&report);
  if (report.Wants("body.slide.")) fulcrum::physics::Slide(&report);
}
