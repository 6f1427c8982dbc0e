#include "physics_node/profile/scene_profile.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "physics_node/profile/quantile.h"
#include "physics_node/simulation/script_player.h"
#include "services/base/core/error.h"

namespace fulcrum::physics {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRefined = 4;       ///< Steps of the reference in a period.
constexpr int kSampleSteps = 10;  ///< Positions are compared once in so many periods.

double Ms(Clock::duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

/// What is compared: positions at the samples, force on each tool in each period.
struct Course {
  std::vector<std::vector<float>> positions;
  std::vector<std::array<Vec3f, kMaxTools>> force_N;
};

struct Run {
  Course course;
  std::vector<double> step_ms;
  std::array<double, kStages> stage_ms{};
  double deepest_m = 0;
  int steps = 0;
};

/// Depth of the deepest contact with a tool [m].
double Deepest(const TissueSimulation& simulation) {
  double deepest = 0;
  const ParticleStore& particles = simulation.particles();
  for (const ContactRow& row : simulation.rows()) {
    if ((row.source & TissueCollision::kSource) != 0) continue;
    Vec3f place = Vec3f::Zero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k)
      place += row.weight[k] * particles.At(row.at[k]);
    deepest = std::max(deepest, static_cast<double>(row.offset - row.normal.dot(place)));
  }
  return deepest;
}

void AddStages(const StageTimes& times, double models_ms, double all_ms, std::array<double, kStages>* sum) {
  const std::array<double, kStages - 1> known{
      1e-6 * static_cast<double>(times.contacts_ns),      1e-6 * static_cast<double>(times.prediction_ns),
      1e-6 * static_cast<double>(times.linearisation_ns), 1e-6 * static_cast<double>(times.solve_ns),
      1e-6 * static_cast<double>(times.update_ns),        models_ms};
  double rest = all_ms;
  for (std::size_t i = 0; i < known.size(); ++i) {
    (*sum)[i] += known[i];
    rest -= known[i];
  }
  sum->back() += rest;
}

/// The script with steps of a `refined`-th of the period.
Run Play(SceneView scene, int periods, int threads, int refined, const std::function<void(double)>& progress) {
  const double period_s = static_cast<double>(scene.physics.dt_s);
  scene.physics.dt_s /= static_cast<float>(refined);
  TissueSimulation simulation(scene, threads);
  Run run;
  for (int i = 0; i < periods; ++i) {
    std::array<Vec3f, kMaxTools> force;
    force.fill(Vec3f::Zero());
    for (int k = 0; k < refined; ++k) {
      const auto tools = ScriptedTools(scene, (i + static_cast<double>(k + 1) / refined) * period_s);
      const auto begin = Clock::now();
      const StepReport step = simulation.Step(tools);
      const auto stepped = Clock::now();
      for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
        (void)simulation.Contacts(tool);
        if (scene.tools[tool].kind == ToolKind::kHook) (void)simulation.Cautery(tool);
        if (!step.asleep) force[tool] += simulation.solver_force(tool) / static_cast<float>(refined);
      }
      const auto end = Clock::now();
      ++run.steps;
      if (step.asleep) continue;
      run.step_ms.push_back(Ms(end - begin));
      AddStages(step.stages, Ms(end - stepped), Ms(end - begin), &run.stage_ms);
      run.deepest_m = std::max(run.deepest_m, Deepest(simulation));
    }
    run.course.force_N.push_back(force);
    if (i % kSampleSteps == 0) {
      run.course.positions.emplace_back(3 * scene.rest_position.size());
      simulation.particles().CopyPositions(run.course.positions.back());
      progress(static_cast<double>(i) / periods);
    }
  }
  for (double& ms : run.stage_ms) ms /= std::max<double>(1, static_cast<double>(run.step_ms.size()));
  return run;
}

double PositionError(const SceneView& scene, const Course& course, const Course& reference) {
  double difference = 0, displacement = 0;
  for (std::size_t s = 0; s < reference.positions.size(); ++s) {
    const std::vector<float>&x = course.positions[s], &r = reference.positions[s];
    for (std::size_t p = 0; p < scene.rest_position.size(); ++p) {
      const Vec3f at(&x[3 * p]), right(&r[3 * p]);
      difference += static_cast<double>((at - right).squaredNorm());
      displacement += static_cast<double>((right - scene.rest_position[p]).squaredNorm());
    }
  }
  return displacement > 0 ? std::sqrt(difference / displacement) : 0;
}

double ForceError(const Course& course, const Course& reference) {
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < reference.force_N.size(); ++i) {
    for (std::size_t tool = 0; tool < kMaxTools; ++tool) {
      const Vec3f& right = reference.force_N[i][tool];
      difference += static_cast<double>((course.force_N[i][tool] - right).squaredNorm());
      size += static_cast<double>(right.squaredNorm());
    }
  }
  return size > 0 ? std::sqrt(difference / size) : 0;
}

}  // namespace

std::string_view NameOf(Stage stage) {
  constexpr std::array<std::string_view, kStages> kNames{"contacts", "prediction", "linearisation", "solve",
                                                         "update",   "models",     "rest"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::string_view NameOf(PhysicsPreset preset) {
  constexpr std::array<std::string_view, 4> kNames{"fast", "default", "accurate", "reference"};
  return kNames[static_cast<std::size_t>(preset)];
}

SceneProfile ProfileScene(const SceneView& given, const ProfileSettings& settings,
                          const std::function<void(std::string_view, double)>& progress) {
  if (given.physics.mode != PhysicsMode::kAccurate) {
    throw InputError(std::string("scene \"") + given.name +
                     "\": physics.mode is not accurate, which alone has presets");
  }
  const double script_s = static_cast<double>(given.script_duration_s),
               period_s = static_cast<double>(given.physics.dt_s);
  if (given.script.empty() || !(script_s > 0)) {
    throw InputError(std::string("scene \"") + given.name + "\" has no script: there is nothing to profile");
  }
  const double seconds = settings.seconds > 0 ? std::min(settings.seconds, script_s) : script_s;
  const int periods = std::max(1, static_cast<int>(seconds / period_s));
  SceneView scene = given;
  const auto play = [&](std::string_view what, int threads, int refined) {
    return Play(scene, periods, threads, refined, [&](double share) { progress(what, share); });
  };

  SceneProfile profile;
  profile.period_ms = 1e3 * period_s;
  scene.physics.preset = PhysicsPreset::kReference;
  const Course reference = play("reference", settings.reference_threads, kRefined).course;
  for (const PhysicsPreset preset : {PhysicsPreset::kFast, PhysicsPreset::kDefault, PhysicsPreset::kAccurate}) {
    scene.physics.preset = preset;
    const Run run = play(NameOf(preset), 1, 1);
    profile.presets.push_back({preset, Quantile(run.step_ms, 0.5), Quantile(run.step_ms, 0.99),
                               static_cast<double>(run.step_ms.size()) / run.steps, run.stage_ms,
                               PositionError(scene, run.course, reference), ForceError(run.course, reference),
                               1e3 * run.deepest_m});
  }
  scene.physics.preset = given.physics.preset;
  for (int threads = 1; threads <= settings.most_threads; threads *= 2) {
    const Run run = play("threads", threads, 1);
    profile.threads.push_back({threads, Quantile(run.step_ms, 0.5), Quantile(run.step_ms, 0.99)});
  }
  return profile;
}

Advice AdviceOf(const SceneProfile& profile) {
  const auto fastest =
      std::min_element(profile.threads.begin(), profile.threads.end(),
                       [](const ThreadFigures& a, const ThreadFigures& b) { return a.step_p99_ms < b.step_p99_ms; });
  // More threads must earn their keep: the other nodes want the cores too.
  constexpr double kGain = 0.85;
  const ThreadFigures& one = profile.threads.front();
  const ThreadFigures& chosen = fastest->step_p99_ms < kGain * one.step_p99_ms ? *fastest : one;
  const double share = one.step_p99_ms > 0 ? chosen.step_p99_ms / one.step_p99_ms : 1;
  Advice advice;
  for (auto preset = profile.presets.rbegin(); preset != profile.presets.rend(); ++preset) {
    advice = {false, preset->preset, chosen.threads, kSessionOverAlone * share * preset->step_p99_ms};
    advice.in_time = advice.forecast_p99_ms <= kMostOfPeriod * profile.period_ms;
    if (advice.in_time) break;
  }
  return advice;
}

}  // namespace fulcrum::physics
