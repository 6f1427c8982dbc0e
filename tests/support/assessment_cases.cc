#include "tests/support/assessment_cases.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fulcrum::test {
namespace {

using assessment::Assessor;
using std::numbers::pi;

constexpr double kToolPeriod_s = 1e-3, kModelPeriod_s = 1e-2;
const Vec3d kAside(0.1, 0, 0);  // Resting place of the other tool.

double ValueOf(const Assessor& assessor, Measure measure) {
  return assessor.figures().session[static_cast<std::size_t>(measure)];
}

/// Adds a motion of tool 0 at 1 kHz, quantised to 9 um like the devices.
void Feed(const std::function<Vec3d(double)>& tip, double duration_s, Assessor* assessor) {
  constexpr double kStep_m = 9e-6;
  const int count = static_cast<int>(std::lround(duration_s / kToolPeriod_s));
  for (int i = 0; i <= count; ++i) {
    const double time_s = i * kToolPeriod_s;
    const Vec3d exact = tip(time_s);
    assessor->Add(ToolAt(time_s, (exact / kStep_m).array().round().matrix() * kStep_m, kAside));
  }
  assessor->Finish();
}

/// Reaches of `length_m` there and back, each of `reach_s`, with `rest_s` before, between and after.
struct Reaches {
  int count = 5;
  double length_m = 0.1, reach_s = 1.0, rest_s = 1.5;
  [[nodiscard]] double duration_s() const { return count * reach_s + (count + 1) * rest_s; }
  [[nodiscard]] Vec3d TipAt(double time_s) const {
    const double cycle_s = reach_s + rest_s, since_s = time_s - rest_s;
    if (since_s < 0) return Vec3d::Zero();
    const int k = std::min(static_cast<int>(since_s / cycle_s), count - 1);
    const double way = MinimumJerk(std::min(1.0, (since_s - k * cycle_s) / reach_s));
    return length_m * (k % 2 == 0 ? way : 1 - way) * Vec3d(0.6, 0, 0.8);
  }
  /// Part of a reach's duration, at each end, in which it is slower than `speed`: v = 30 L/T u^2 (1-u)^2.
  [[nodiscard]] double SlowPart(double speed) const {
    double low = 0, high = 0.5;
    for (int i = 0; i < 60; ++i) {
      const double u = 0.5 * (low + high);
      (30 * length_m / reach_s * u * u * (1 - u) * (1 - u) < speed ? low : high) = u;
    }
    return low;
  }
};

/// The spectral arc length of a speed profile on [0, 1], from its Fourier integral on a fine grid: the definition, with
/// neither sampling, filter nor segmentation.
double SpectralArc(const std::function<double(double)>& speed, double duration_s) {
  constexpr int kSamples = 1000, kFrequencies = 1000;
  constexpr double kHighest_Hz = 10, kLeast = 0.05;
  std::vector<double> magnitude;
  for (int j = 0; j <= kFrequencies; ++j) {
    const double omega = 2 * pi * kHighest_Hz * j / kFrequencies * duration_s;
    double re = 0, im = 0;
    for (int i = 0; i < kSamples; ++i) {
      const double u = (i + 0.5) / kSamples;
      re += speed(u) * std::cos(omega * u);
      im += speed(u) * std::sin(omega * u);
    }
    magnitude.push_back(std::hypot(re, im));
  }
  const double first = magnitude[0];
  std::size_t last = 0;
  for (std::size_t j = 0; j < magnitude.size(); ++j) last = magnitude[j] >= kLeast * first ? j : last;
  double length = 0;
  for (std::size_t j = 1; j <= last; ++j) {
    length += std::hypot(1.0 / static_cast<double>(last), (magnitude[j] - magnitude[j - 1]) / first);
  }
  return -length;
}

double MinimumJerkSpeed(double u) { return u <= 0 || u >= 1 ? 0 : 30 * u * u * (1 - u) * (1 - u); }

/// A scope that touches tissue at 1 s and is in its trocar from 3 s on: its lens, smeared by 0.8, is clear 0.8 s later.
void AddLens(SceneView scene, std::vector<KnownAnswer>* answers) {
  const std::vector<Vec3f> tissue{Vec3f::Zero()};
  scene.rest_position = tissue;
  scene.tools[2].kind = ToolKind::kScope;
  scene.tools[2].p_WP = {0, 0, 0.2f};
  Assessor assessor(scene);
  assessor.Begin(kStart_ns);
  for (int i = 0; i <= std::lround(5 / kToolPeriod_s); ++i) {
    const double time_s = i * kToolPeriod_s;
    ToolState state = ToolAt(time_s, Vec3d::Zero(), kAside);
    state.tools[2].kind = ToolKind::kScope;
    const bool touches = time_s >= 1 && time_s < 1.1, drawn_back = time_s >= 3;
    state.tools[2].p_WT = {0, 0, touches ? 0.001f : drawn_back ? 0.19f : 0.1f};
    assessor.Add(state);
  }
  assessor.Finish();
  answers->push_back({"lens_smeared.touch", ValueOf(assessor, Measure::kLensSmeared), 2.8});
}

/// A scope that looks straight down on a flat membrane and moves along the planned line, 1 mm beside it, over its first
/// half.
void AddView(const SceneView& assessed, std::vector<KnownAnswer>* answers) {
  constexpr std::uint32_t kNodes = 41;
  constexpr float kSpacing_m = 0.002f, kBeside_m = 0.001f, kSpeed_m_s = 0.005f;
  std::vector<Vec3f> nodes;
  std::vector<Vec2f> materials;
  for (std::uint32_t i = 0; i < kNodes * kNodes; ++i) {
    const std::uint32_t row = i / kNodes, column = i % kNodes;
    materials.emplace_back(kSpacing_m * static_cast<float>(column), kSpacing_m * static_cast<float>(row));
    nodes.emplace_back(materials.back().x(), materials.back().y(), 0.0f);
  }
  SceneView scene = assessed;
  scene.rest_position = nodes;
  scene.membrane_material = materials;
  scene.membrane = {.first = 0, .rows = kNodes, .cols = kNodes};
  scene.assessment.tracing = LineTracing::kView;
  scene.render.scope_angle_deg = 0;
  scene.tools[2].kind = ToolKind::kScope;
  Assessor assessor(scene);
  assessor.Begin(kStart_ns);
  for (int i = 0; i <= std::lround(4 / kToolPeriod_s); ++i) {
    const double time_s = i * kToolPeriod_s;
    ToolState state = ToolAt(time_s, Vec3d::Zero(), kAside);
    state.tools[2].kind = ToolKind::kScope;
    // The planned line runs 40 mm along y, from (20, 20) mm on.
    state.tools[2].p_WT = {0.02f + kBeside_m, 0.02f + kSpeed_m_s * static_cast<float>(time_s), 0.05f};
    state.tools[2].q_WT = Quatf(Eigen::AngleAxisf(std::numbers::pi_v<float>, Vec3f::UnitX()));
    assessor.Add(state);
  }
  assessor.Finish();
  answers->push_back({"line_done.view", ValueOf(assessor, Measure::kLineDone), 50});
  answers->push_back({"deviation_mean.view", ValueOf(assessor, Measure::kDeviationMean), 1e3 * double{kBeside_m}});
}

/// A scope that turns about the vertical through the origin of W, where tool 0 is, with a tilted horizon.
void AddScope(SceneView scene, std::vector<KnownAnswer>* answers) {
  constexpr double kTilt_deg = 7, kOff_deg = 11, kSession_s = 4;
  scene.tools[1] = {};
  scene.tools[2].kind = ToolKind::kScope;
  scene.render.scope_angle_deg = 0;
  scene.render.scope_tip_W = {0, -0.1f, 0};
  Assessor assessor(scene);
  assessor.Begin(kStart_ns);
  for (int i = 0; i <= std::lround(kSession_s / kToolPeriod_s); ++i) {
    const double time_s = i * kToolPeriod_s;
    ToolState state = ToolAt(time_s, Vec3d::Zero(), kAside);
    ToolSample& scope = state.tools[2];
    scope.kind = ToolKind::kScope;
    const Eigen::AngleAxisd around(0.3 * time_s, Vec3d::UnitZ());
    scope.p_WT = (around * Vec3d(0, -0.1, 0)).cast<float>();
    // z of a level scope towards +y of W, y down; then off its target, level, and tilted, with changing sign.
    Eigen::Matrix3d level;
    level << Vec3d::UnitX(), -Vec3d::UnitZ(), Vec3d::UnitY();
    const double sign = time_s < kSession_s / 2 ? 1 : -1;
    scope.q_WT = (around * Eigen::AngleAxisd(kOff_deg * pi / 180, Vec3d::UnitZ()) * Eigen::Quaterniond(level) *
                  Eigen::AngleAxisd(sign * kTilt_deg * pi / 180, Vec3d::UnitZ()))
                     .cast<float>();
    assessor.Add(state);
  }
  assessor.Finish();
  answers->push_back({"horizon.tilted", ValueOf(assessor, Measure::kHorizon), kTilt_deg});
  answers->push_back({"off_centre.turned", ValueOf(assessor, Measure::kOffCentre), kOff_deg});
}

void AddMotions(const SceneView& scene, std::vector<KnownAnswer>* answers) {
  const Reaches reaches;
  {
    Assessor assessor(scene);
    assessor.Begin(kStart_ns);
    Feed([&](double t) { return reaches.TipAt(t); }, reaches.duration_s(), &assessor);
    answers->push_back(
        {"path_length.reaches", ValueOf(assessor, Measure::kPathLength), 1e3 * reaches.length_m * reaches.count});
    answers->push_back(
        {"movements.reaches", ValueOf(assessor, Measure::kMovements), static_cast<double>(reaches.count)});
    const double slow_s = reaches.reach_s * reaches.SlowPart(static_cast<double>(scene.assessment.idle_speed_m_s));
    answers->push_back({"time.reaches", ValueOf(assessor, Measure::kTime),
                        reaches.count * reaches.reach_s + (reaches.count - 1) * reaches.rest_s - 2 * slow_s});
    answers->push_back({"idle.reaches", ValueOf(assessor, Measure::kIdle),
                        (reaches.count + 1) * reaches.rest_s + 2 * reaches.count * slow_s});
    answers->push_back(
        {"smoothness.reach", ValueOf(assessor, Measure::kSmoothness), SpectralArc(MinimumJerkSpeed, reaches.reach_s)});
  }
  {
    // Two reaches of which the second begins when the first is half done: a corrected movement.
    const double reach_s = 1.2, begin_s = 0.6, total_s = begin_s + reach_s, rest_s = 1;
    Assessor assessor(scene);
    assessor.Begin(kStart_ns);
    Feed(
        [&](double t) {
          const auto way = [&](double from_s) {
            return MinimumJerk(std::clamp((t - rest_s - from_s) / reach_s, 0.0, 1.0));
          };
          return Vec3d(0.05 * way(0) + 0.03 * way(begin_s), 0, 0);
        },
        total_s + 2 * rest_s, &assessor);
    const auto speed = [&](double u) {
      return 0.05 * MinimumJerkSpeed(u * total_s / reach_s) +
             0.03 * MinimumJerkSpeed((u * total_s - begin_s) / reach_s);
    };
    answers->push_back({"smoothness.corrected", ValueOf(assessor, Measure::kSmoothness), SpectralArc(speed, total_s)});
  }
  {
    const double radius_m = 0.03, period_s = 4;
    Assessor assessor(scene);
    assessor.Begin(kStart_ns);
    Feed(
        [&](double t) {
          return Vec3d(radius_m * std::cos(2 * pi * t / period_s), radius_m * std::sin(2 * pi * t / period_s), 0);
        },
        2 * period_s, &assessor);
    answers->push_back({"path_length.circle", ValueOf(assessor, Measure::kPathLength), 1e3 * 2 * 2 * pi * radius_m});
  }
}

void AddForces(const SceneView& scene, std::vector<KnownAnswer>* answers) {
  const double peak_N = 6, period_s = 2.5;
  const int pulses = 4;
  Assessor assessor(scene);
  assessor.Begin(kStart_ns);
  for (int i = 0; i * kModelPeriod_s <= pulses * period_s + 1e-9; ++i) {
    const double time_s = i * kModelPeriod_s;
    assessor.Add(PushAt(time_s, peak_N * std::abs(std::sin(pi * time_s / period_s))));
  }
  answers->push_back(
      {"force_time.pulses", ValueOf(assessor, Measure::kForceTime), pulses * peak_N * 2 * period_s / pi});
  answers->push_back({"peak_force.pulses", ValueOf(assessor, Measure::kPeakForce), peak_N});

  // Three holds: one slips twice and is kept, one is lost, one is opened. The first is raised by 12 mm in 1 s, held for
  // 3 s and lowered again; the required lift is 8 mm.
  Assessor holds(scene);
  holds.Begin(kStart_ns);
  const auto height = [](double t) {
    return 0.012 * (t < 1 ? MinimumJerk(t) : t < 4 ? 1.0 : 1 - MinimumJerk(std::min(1.0, t - 4)));
  };
  double time_s = 0;
  for (int i = 0; i <= 600; ++i, time_s = i * kModelPeriod_s) {
    const bool slips = (i > 450 && i < 470) || (i > 520 && i < 540);
    holds.Add(GraspAt(time_s, Vec3d(0, 0, height(time_s)), slips ? 9 : 3, 8));
  }
  const auto gap = [&] {
    for (int i = 0; i < 20; ++i) holds.Add(PushAt(time_s += kModelPeriod_s, 0));
  };
  const auto open = [&] {  // Opens within 0.4 s under the present traction.
    for (int i = 0; i < 40; ++i)
      holds.Add(GraspAt(time_s += kModelPeriod_s, Vec3d::Zero(), 5, std::max(0.0, 8 - 0.25 * i)));
    gap();
  };
  open();
  for (int i = 0; i < 100; ++i) holds.Add(GraspAt(time_s += kModelPeriod_s, Vec3d::Zero(), 5, 8));
  gap();  // The grasp ends with closed jaws: tissue lost.
  for (int i = 0; i < 100; ++i)
    holds.Add(GraspAt(time_s += kModelPeriod_s, Vec3d::Zero(), 5, std::max(0.0, 8 - 0.2 * std::max(0, i - 50))));
  gap();  // Opened.
  answers->push_back({"grasp_slips.holds", ValueOf(holds, Measure::kGraspSlips), 3});
  answers->push_back({"lift.hold", ValueOf(holds, Measure::kLift), 12});
  double low = 0, high = 1;  // Time at which a reach has covered 8 / 12 of its length.
  for (int i = 0; i < 60; ++i) (MinimumJerk(0.5 * (low + high)) < 8.0 / 12 ? low : high) = 0.5 * (low + high);
  answers->push_back({"lift_hold.hold", ValueOf(holds, Measure::kLiftHold), 3 + 2 * (1 - low)});
}

/// Along the planned line from its beginning to `end_m`, `beside(t)` beside it, energised, at 4 mm/s.
void Trace(const std::function<double(double)>& beside, double end_m, Assessor* assessor) {
  constexpr double kSpeed = 0.004;
  const int count = static_cast<int>(std::lround(end_m / kSpeed / kModelPeriod_s));
  for (int i = 0; i <= count; ++i) {
    const double along = end_m * i / count;
    AddTip(i * kModelPeriod_s, Vec2f(0.02f + static_cast<float>(beside(along)), 0.02f + static_cast<float>(along)),
           true, CauteryMode::kCut, assessor);
  }
}

void AddLines(const SceneView& scene, std::vector<KnownAnswer>* answers) {
  constexpr double kLength_m = 0.04;
  {
    Assessor assessor(scene);
    assessor.Begin(kStart_ns);
    Trace([](double) { return 0.0015; }, 0.6 * kLength_m, &assessor);
    answers->push_back({"deviation_mean.parallel", ValueOf(assessor, Measure::kDeviationMean), 1.5});
    answers->push_back({"deviation_max.parallel", ValueOf(assessor, Measure::kDeviationMax), 1.5});
    answers->push_back({"line_done.part", ValueOf(assessor, Measure::kLineDone), 60});
  }
  {
    const double amplitude_m = 0.002, wave_m = 0.01;
    Assessor assessor(scene);
    assessor.Begin(kStart_ns);
    Trace([&](double along) { return amplitude_m * std::sin(2 * pi * along / wave_m); }, kLength_m, &assessor);
    double length = 0, moment = 0;  // By the midpoint rule over one wave.
    constexpr int kParts = 100000;
    for (int i = 0; i < kParts; ++i) {
      const double phase = 2 * pi * (i + 0.5) / kParts;
      const double slope = 2 * pi * amplitude_m / wave_m * std::cos(phase);
      length += std::sqrt(1 + slope * slope);
      moment += std::sqrt(1 + slope * slope) * amplitude_m * std::abs(std::sin(phase));
    }
    answers->push_back({"deviation_mean.wave", ValueOf(assessor, Measure::kDeviationMean), 1e3 * moment / length});
    answers->push_back({"deviation_max.wave", ValueOf(assessor, Measure::kDeviationMax), 1e3 * amplitude_m});
  }
  {
    // On the membrane for 2 s, in the air for 3 s, pedal up for 1 s, three times.
    Assessor assessor(scene);
    assessor.Begin(kStart_ns);
    for (int i = 0; i < 1800; ++i) {
      const double phase_s = std::fmod((i + 0.5) * kModelPeriod_s, 6.0);
      AddTip(i * kModelPeriod_s, Vec2f(0.02f, 0.03f), phase_s < 2, phase_s < 5 ? CauteryMode::kCut : CauteryMode::kOff,
             &assessor);
    }
    answers->push_back({"pedal_without_contact.air", ValueOf(assessor, Measure::kPedalWithoutContact), 9});
  }
}

void AddHeat(const SceneView& scene, std::vector<KnownAnswer>* answers) {
  Assessor assessor(scene);
  assessor.Begin(kStart_ns);
  // A disc on the middle of the line; within the margin of a line longer than the disc lies a strip.
  const double radius_m = 0.006, margin_m = static_cast<double>(scene.assessment.margin_m);
  const Eigen::Vector2d centre(0.02, 0.04);
  const auto damaged = [&](const Eigen::Vector2d& at) { return (at - centre).norm() < radius_m; };
  for (const auto& [x, y] : {std::pair{60u, 260u}, {150u, 300u}, {100u, 330u}, {60u, 300u}}) {
    assessor.Add(PatchAt(1, x, y, damaged));
  }
  const double beyond = 2 * (radius_m * radius_m * std::acos(margin_m / radius_m) -
                             margin_m * std::sqrt(radius_m * radius_m - margin_m * margin_m));
  answers->push_back({"damage_beyond_margin.disc", ValueOf(assessor, Measure::kDamageBeyondMargin), 1e6 * beyond});
  TopologyState topology;
  topology.stamp = StampAt(2);
  topology.cut_length_m = 0.0123f;
  topology.cut_width_m = 0.0019f;
  topology.cut_off_way_m = 0.0003f;
  assessor.Add(topology);
  topology.stamp = StampAt(3);
  topology.cut_length_m = 0.004f;  // As sent by a thermal node just after a restart.
  assessor.Add(topology);
  answers->push_back({"cut_length.state", ValueOf(assessor, Measure::kCutLength), 12.3});
  answers->push_back({"cut_width.state", ValueOf(assessor, Measure::kCutWidth), 1.9});
  answers->push_back({"cut_off_way.state", ValueOf(assessor, Measure::kCutOffWay), 0.3});
  for (const float mm2 : {1.0f, 3.0f, 7.0f}) {
    ThermalEvent event;
    event.session_time_s = 2;
    event.kind = ThermalEventKind::kSolidBurn;
    event.solid = 0;
    event.value = 1e-6f * mm2;
    assessor.Add(event);
  }
  answers->push_back({"organ_burn.events", ValueOf(assessor, Measure::kOrganBurn), 7});
  const std::array kinds{ThermalEventKind::kUreterWarning, ThermalEventKind::kUreterInjury,
                         ThermalEventKind::kNerveWarning, ThermalEventKind::kNerveInjury};
  const std::array measures{Measure::kUreterWarnings, Measure::kUreterInjuries, Measure::kNerveWarnings,
                            Measure::kNerveInjuries};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (std::size_t i = 0; i <= k; ++i) {
      ThermalEvent event;
      event.session_time_s = 1;
      event.kind = kinds[k];
      assessor.Add(event);
    }
    answers->push_back({std::string(InfoOf(measures[k]).name) + ".events", ValueOf(assessor, measures[k]),
                        static_cast<double>(k + 1)});
  }
}

}  // namespace

AssessedScene::AssessedScene() {
  for (int i = 0; i <= 20; ++i) {
    const float t = 0.02f + 0.002f * static_cast<float>(i);
    line.emplace_back(0.02f, t);
    points.push_back({Vec3f::Zero(), Vec2f(0.032f, t)});
  }
  structures.push_back({ProtectedKind::kUreter, 0.0025f, 0.003f, 0, static_cast<Index>(points.size())});
  view.assessment.on = 1;
  view.planned_line = line;
  view.protected_structures = structures;
  view.protected_points = points;
  view.membrane.texel_m = 1e-4f;
  view.tube_surface = surface;
  view.tube_vertex_count = 3;
  view.tools[0].kind = ToolKind::kGrasper;
  view.tools[1].kind = ToolKind::kHook;
}

Stamp StampAt(double time_s) {
  return {static_cast<std::uint64_t>(std::llround(time_s * 1e6)) + 1, 1, kStart_ns + std::llround(time_s * 1e9)};
}

ToolState ToolAt(double time_s, const Vec3d& tip0, const Vec3d& tip1) {
  ToolState state;
  state.stamp = StampAt(time_s);
  state.tools[0].kind = ToolKind::kGrasper;
  state.tools[0].p_WT = tip0.cast<float>();
  state.tools[1].kind = ToolKind::kHook;
  state.tools[1].p_WT = tip1.cast<float>();
  return state;
}

ContactModel GraspAt(double time_s, const Vec3d& tip, double force_N, double slip_N) {
  ContactModel model;
  model.stamp = StampAt(time_s);
  model.devices[0].count = 1;
  Contact& contact = model.devices[0].contacts[0];
  contact.kind = ContactKind::kGrasp;
  contact.x_ref = tip.cast<float>();
  contact.f_ref = Vec3f(0, 0, static_cast<float>(-force_N));
  contact.slip_force = static_cast<float>(slip_N);
  return model;
}

ContactModel PushAt(double time_s, double force_N) {
  ContactModel model;
  model.stamp = StampAt(time_s);
  model.devices[1].count = 1;
  Contact& contact = model.devices[1].contacts[0];
  contact.kind = ContactKind::kSurface;
  contact.f_ref = Vec3f(0, static_cast<float>(0.6 * force_N), static_cast<float>(0.8 * force_N));
  return model;
}

HandleState PedalAt(double time_s, CauteryMode mode) {
  HandleState state;
  state.stamp = StampAt(time_s);
  state.pedals = mode == CauteryMode::kCut     ? kPedalCut
                 : mode == CauteryMode::kBlend ? kPedalBlend
                 : mode == CauteryMode::kCoag  ? kPedalCoag
                                               : kPedalNone;
  return state;
}

void AddTip(double time_s, const Vec2f& material, bool touching, CauteryMode mode, Assessor* assessor) {
  assessor->Add(PedalAt(time_s, mode));
  assessor->Add(TipAt(time_s, material, touching));
}

CauteryContact TipAt(double time_s, const Vec2f& material, bool touching) {
  CauteryContact contact;
  contact.stamp = StampAt(time_s);
  contact.session_time_s = time_s;
  contact.touching = touching;
  contact.material = material;
  contact.triangle = 0;
  contact.barycentric = {1, 0, 0};
  contact.tool = 1;
  return contact;
}

TemperaturePatch PatchAt(double time_s, std::uint32_t x, std::uint32_t y,
                         const std::function<bool(const Eigen::Vector2d&)>& damaged) {
  TemperaturePatch patch;
  patch.header.stamp = StampAt(time_s);
  patch.header.origin_x = x;
  patch.header.origin_y = y;
  patch.texels.assign(std::size_t{4} * kPatchTexels * kPatchTexels, 0);
  for (std::uint32_t j = 0; j < kPatchTexels; ++j) {
    for (std::uint32_t i = 0; i < kPatchTexels; ++i) {
      const Eigen::Vector2d at(1e-4 * (x + i + 0.5), 1e-4 * (y + j + 0.5));
      patch.texels[4 * (j * kPatchTexels + i) + 1] = damaged(at) ? 200 : 100;
    }
  }
  return patch;
}

double MinimumJerk(double u) { return u * u * u * (10 - 15 * u + 6 * u * u); }

double KnownAnswer::error_pct() const { return 100 * std::abs(measured - known) / std::abs(known); }

std::vector<KnownAnswer> KnownAnswers() {
  const AssessedScene scene;
  std::vector<KnownAnswer> answers;
  AddMotions(scene.view, &answers);
  AddLens(scene.view, &answers);
  AddView(scene.view, &answers);
  AddScope(scene.view, &answers);
  AddForces(scene.view, &answers);
  AddLines(scene.view, &answers);
  AddHeat(scene.view, &answers);
  return answers;
}

}  // namespace fulcrum::test
