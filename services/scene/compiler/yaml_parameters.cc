#include "services/scene/compiler/yaml_parameters.h"

#include <charconv>

#include "services/base/core/thermal_bounds.h"

namespace fulcrum::scene {

using config::Range;
using config::StrictMap;

namespace {

/// The double with the float's shortest decimal form: 0.8f becomes 0.8, not 0.800000011920929.
double Decimal(float value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof(text), value).ptr;
  double result = 0;
  std::from_chars(text, end, result);
  return result;
}

}  // namespace

void ReadSi(StrictMap* map, const char* key, const Range& range, float* field) {
  *field = static_cast<float>(map->NumberSi(key, Decimal(*field), range));
}
void ReadSi(StrictMap* map, const char* key, const Range& range, double* field) {
  *field = map->NumberSi(key, *field, range);
}
void ReadInteger(StrictMap* map, const char* key, int min, int max, int* field) {
  *field = static_cast<int>(map->Integer(key, *field, min, max));
}
void ReadInteger(StrictMap* map, const char* key, int min, int max, std::uint32_t* field) {
  *field = static_cast<std::uint32_t>(map->Integer(key, *field, min, max));
}

namespace {

void ReadPaperForm(StrictMap* map, bool paper, const char* needs, PaperForm* as) {
  *as = map->Choice("as", *as, {{"corrected", PaperForm::kCorrected}, {"printed", PaperForm::kPrinted}});
  if (*as == PaperForm::kPrinted && !paper) {
    map->Fail("as", needs);
  }
}

}  // namespace

void ReadPhysics(StrictMap map, PhysicsParams* p) {
  p->mode =
      map.Choice("mode", p->mode,
                 {{"paper", PhysicsMode::kPaper}, {"xpbd", PhysicsMode::kXpbd}, {"accurate", PhysicsMode::kAccurate}});
  ReadPaperForm(&map, p->mode == PhysicsMode::kPaper, "printed needs physics.mode paper", &p->as);
  p->preset = map.Choice("preset", p->preset,
                         {{"fast", PhysicsPreset::kFast},
                          {"default", PhysicsPreset::kDefault},
                          {"accurate", PhysicsPreset::kAccurate},
                          {"reference", PhysicsPreset::kReference}});
  ReadInteger(&map, "substeps", 1, 1000, &p->substeps);
  ReadInteger(&map, "iterations", 1, 1000, &p->iterations);
  ReadSi(&map, "dt_ms", Range::Between(0.1, 100), &p->dt_s);
  ReadSi(&map, "damping_per_s", Range::Between(0, 1000), &p->damping_per_s);
  p->gravity = map.Vector3Si("gravity_m_s2", p->gravity, Range::Between(-50, 50));
  ReadSi(&map, "k_stretch_tube", Range::Above(0, 1), &p->k_stretch_tube);
  ReadSi(&map, "k_stretch_membrane", Range::Above(0, 1), &p->k_stretch_membrane);
  ReadSi(&map, "k_volume", Range::Between(0, 1), &p->k_volume);
  ReadSi(&map, "k_bending", Range::Between(0, 1), &p->k_bending);
  ReadSi(&map, "k_binding", Range::Between(0, 1), &p->k_binding);
  ReadSi(&map, "tube_youngs_modulus_kPa", Range::Between(0.001, 1e6), &p->tube_youngs_modulus_Pa);
  ReadSi(&map, "tube_poisson", Range::Between(0, 0.495), &p->tube_poisson);
  p->membrane_model = map.Choice("membrane_model", p->membrane_model,
                                 {{"springs", MembraneModel::kSprings}, {"continuum", MembraneModel::kContinuum}});
  ReadSi(&map, "membrane_Et_N_per_m", Range::Between(0.001, 1e7), &p->membrane_Et_N_per_m);
  ReadSi(&map, "membrane_stiffening", Range::Between(0, 1000), &p->membrane_stiffening);
  ReadSi(&map, "membrane_prestrain", Range::Between(0, 0.5), &p->membrane_prestrain);
  ReadSi(&map, "membrane_bending_uNm", Range::Between(0, 1e6), &p->membrane_bending_Nm);
  ReadSi(&map, "fat_youngs_modulus_kPa", Range::Between(0.001, 1e6), &p->fat_youngs_modulus_Pa);
  ReadSi(&map, "friction", Range::Between(0, 2), &p->friction);
  ReadSi(&map, "collision_margin_mm", Range::Between(0, 10), &p->collision_margin_m);
  ReadSi(&map, "grasp_radius_mm", Range::Between(0.1, 50), &p->grasp_radius_m);
  ReadSi(&map, "grasp_close_deg", Range::Between(0, 85), &p->grasp_close_rad);
  ReadSi(&map, "grasp_open_deg", Range::Between(0, 90), &p->grasp_open_rad);
  ReadSi(&map, "grip_force_N", Range::Between(0, 1000), &p->grip_force_N);
  ReadSi(&map, "tear_stretch", Range::Between(0, 10), &p->tear_stretch);
  if (p->tear_stretch != 0.0f && !(p->tear_stretch > 1.0f + p->membrane_prestrain)) {
    map.Fail("tear_stretch", "must be above 1 + membrane_prestrain, or 0 (never)");
  }
  if (!(p->grasp_open_rad > p->grasp_close_rad)) {
    map.Fail("grasp_open_deg", "must be above grasp_close_deg");
  }
}

void ReadThermal(StrictMap map, ThermalParams* t) {
  t->model = map.Choice("model", t->model, {{"accurate", ThermalModel::kAccurate}, {"paper", ThermalModel::kPaper}});
  ReadPaperForm(&map, t->model == ThermalModel::kPaper, "printed needs thermal.model paper", &t->as);
  for (const ThermalBound& bound : kThermalBounds) {
    ReadSi(&map, bound.key, Range::Between(bound.low, bound.high), &(t->*bound.value));
  }
  t->volume = map.Flag("volume", t->volume != 0) ? 1 : 0;
}

namespace {

/// From the scope's tip to the middle of its picture [m]: it gives the direction of sight, and nothing nearer than 4 mm
/// is drawn.
constexpr float kLeastSight_m = 0.005f * (1 - 1e-6f);

}  // namespace

void ReadRender(StrictMap map, RenderParams* r, StereoParams* s) {
  ReadInteger(&map, "width", 16, 7680, &r->width);
  ReadInteger(&map, "height", 16, 4320, &r->height);
  ReadSi(&map, "rate_Hz", Range::Between(0.1, 240), &r->rate_Hz);
  ReadSi(&map, "png_rate_Hz", Range::Between(0, 240), &r->png_rate_Hz);
  r->scope_tip_W = map.Vector3Si("scope_tip_mm", r->scope_tip_W, Range::Between(-1000, 1000));
  r->scope_target_W = map.Vector3Si("scope_target_mm", r->scope_target_W, Range::Between(-1000, 1000));
  if ((r->scope_target_W - r->scope_tip_W).norm() < kLeastSight_m) {
    map.Fail("scope_target_mm", "must be at least 5 mm from scope_tip_mm");
  }
  r->fov_deg = static_cast<float>(map.Number("fov_deg", Decimal(r->fov_deg), Range::Between(10, 150)));
  r->scope_angle_deg =
      static_cast<float>(map.Number("scope_angle_deg", Decimal(r->scope_angle_deg), Range::Between(0, 90)));
  r->roll_deg = static_cast<float>(map.Number("roll_deg", Decimal(r->roll_deg), Range::Between(-180, 180)));
  ReadInteger(&map, "hud", 0, 1, &r->hud);
  s->layout = map.Choice("stereo", s->layout,
                         {{"none", StereoLayout::kNone},
                          {"side_by_side", StereoLayout::kSideBySide},
                          {"top_bottom", StereoLayout::kTopBottom}});
  ReadSi(&map, "interocular_mm", Range::Between(1, 20), &s->interocular_m);
  ReadSi(&map, "convergence_mm", Range::Between(0, 500), &s->convergence_m);
  if (s->convergence_m != 0 && s->convergence_m < 0.01f) {
    map.Fail("convergence_mm", "must be 10 to 500, or 0 (the distance of scope_target_mm)");
  }
}

void ReadHaptics(StrictMap map, HapticsParams* h) {
  ReadSi(&map, "force_limit_N", Range::Between(0.01, 100), &h->force_limit_N);
  h->slew_N_per_ms =
      static_cast<float>(map.Number("slew_N_per_ms", Decimal(h->slew_N_per_ms), Range::Between(1e-4, 100)));
  ReadSi(&map, "hand_mass_kg", Range::Between(0.001, 100), &h->hand_mass_kg);
  ReadSi(&map, "hand_stiffness_N_m", Range::Between(0, 1e5), &h->hand_stiffness_N_m);
  ReadSi(&map, "hand_damping_Ns_m", Range::Between(0, 1e4), &h->hand_damping_Ns_m);
  ReadSi(&map, "force_scale", Range::Between(0, 100), &h->force_scale);
}

void ReadBreathing(StrictMap map, PhysicsMode mode, Breathing* b) {
  b->direction = map.Vector3Si("direction", b->direction, Range::Between(-1, 1));
  if (!(b->direction.norm() > 0.1f)) {
    map.Fail("direction", "must be a direction, not (nearly) zero");
  }
  b->direction.normalize();
  ReadSi(&map, "amplitude_mm", Range::Between(0, 50), &b->amplitude_m);
  ReadSi(&map, "period_s", Range::Between(0.5, 60), &b->period_s);
  if (b->amplitude_m > 0 && mode == PhysicsMode::kPaper) {
    map.Fail("amplitude_mm", "needs physics.mode accurate or xpbd: in mode paper nothing touches the surroundings");
  }
}

namespace {

constexpr std::size_t kMaxLinePoints = 64;

void ReadLine(StrictMap map, AssessmentParams* a, std::vector<Vec2f>* line) {
  const auto across = map.Numbers("s", 2, kMaxLinePoints, Range::Between(0, 1));
  const auto along = map.Numbers("t", 2, kMaxLinePoints, Range::Between(0, 1));
  if (across.size() != along.size()) {
    map.Fail("t", "must have as many entries as s");
  }
  for (std::size_t i = 0; i < across.size(); ++i) {
    line->emplace_back(static_cast<float>(across[i]), static_cast<float>(along[i]));
    if (i > 0 && (*line)[i] == (*line)[i - 1]) {
      map.Fail("t", "a point of the line stands twice");
    }
  }
  a->tracing = map.Choice("by", a->tracing,
                          {{"cut", LineTracing::kCut}, {"touch", LineTracing::kTouch}, {"view", LineTracing::kView}});
  ReadSi(&map, "reach_mm", Range::Between(0.1, 50), &a->line_reach_m);
}

}  // namespace

void ReadAssessment(StrictMap map, AssessmentParams* a, std::vector<Vec2f>* line) {
  a->on = 1;
  if (auto entry = map.OptionalMap("line")) {
    ReadLine(*entry, a, line);
  }
  ReadSi(&map, "margin_mm", Range::Between(0, 50), &a->margin_m);
  ReadSi(&map, "near_mm", Range::Between(0, 50), &a->near_m);
  ReadSi(&map, "movement_speed_mm_s", Range::Between(0.1, 1000), &a->movement_speed_m_s);
  ReadSi(&map, "idle_speed_mm_s", Range::Between(0.01, 1000), &a->idle_speed_m_s);
  if (a->idle_speed_m_s > a->movement_speed_m_s) {
    map.Fail("idle_speed_mm_s", "must not exceed movement_speed_mm_s");
  }
  ReadSi(&map, "idle_after_s", Range::Between(0, 60), &a->idle_after_s);
  StrictMap limits = map.MapOrDefaults("limits"), points = map.MapOrDefaults("points");
  for (std::size_t i = 0; i < kMeasureCount; ++i) {
    const MeasureInfo& m = kMeasures[i];
    a->limit[i] = static_cast<float>(limits.Number(m.key, Decimal(m.limit), Range::Between(Decimal(m.low), m.high)));
    a->points[i] = static_cast<float>(points.Number(m.name, Decimal(m.points), Range::Between(0, kMostPoints)));
  }
}

}  // namespace fulcrum::scene
