#include <cstring>
#include <utility>

#include "services/scene/format/validate_checks.h"

namespace fulcrum::scene {
namespace {

struct Bound {
  const char* name;
  float value, low, high;
};

void CheckBounds(std::initializer_list<Bound> bounds) {
  for (const Bound& b : bounds) {
    if (!(b.value >= b.low && b.value <= b.high)) {
      Fail("scene", b.name, " = ", b.value, "; valid: ", b.low, " to ", b.high);
    }
  }
}

void CheckAssessment(const AssessmentParams& a) {
  if (a.tracing > LineTracing::kView) {
    Fail("scene", "assessment.line.by = ", static_cast<std::uint32_t>(a.tracing),
         "; valid: 0 (cut), 1 (touch), 2 (view)");
  }
  CheckBounds({{"assessment", static_cast<float>(a.on), 0, 1},
               {"assessment.line.reach", a.line_reach_m, 1e-4f, 0.05f},
               {"assessment.margin", a.margin_m, 0, 0.05f},
               {"assessment.near", a.near_m, 0, 0.05f},
               {"assessment.movement_speed", a.movement_speed_m_s, 1e-4f, 1},
               {"assessment.idle_speed", a.idle_speed_m_s, 1e-5f, a.movement_speed_m_s},
               {"assessment.idle_after", a.idle_after_s, 0, 60}});
  for (std::size_t i = 0; i < kMeasureCount; ++i) {
    const MeasureInfo& info = kMeasures[i];
    CheckBounds({{info.key, a.limit[i], info.low, info.high}, {info.name, a.points[i], 0, kMostPoints}});
  }
}

void CheckStereo(const StereoParams& s) {
  if (s.layout > StereoLayout::kTopBottom) {
    Fail("scene", "render.stereo = ", static_cast<std::uint32_t>(s.layout),
         "; valid: 0 (none), 1 (side_by_side), 2 (top_bottom)");
  }
  CheckBounds({{"render.interocular", s.interocular_m, 1e-3f, 0.02f}});
  if (s.convergence_m != 0) CheckBounds({{"render.convergence", s.convergence_m, 0.01f, 0.5f}});
}

}  // namespace

void CheckParameters(const SceneView& s) {
  const PhysicsParams& p = s.physics;
  const ThermalParams& t = s.thermal;
  const RenderParams& r = s.render;
  const HapticsParams& h = s.haptics;
  CheckStereo(s.stereo);
  if (p.mode > PhysicsMode::kAccurate) {
    Fail("scene", "physics.mode = ", static_cast<std::uint32_t>(p.mode), "; valid: 0 (paper), 1 (xpbd), 2 (accurate)");
  }
  for (const auto& [key, as] : {std::pair{"physics.as", p.as}, std::pair{"thermal.as", t.as}}) {
    if (as > PaperForm::kPrinted) {
      Fail("scene", key, " = ", static_cast<std::uint32_t>(as), "; valid: 0 (corrected), 1 (printed)");
    }
  }
  if (p.preset > PhysicsPreset::kReference) {
    Fail("scene", "physics.preset = ", static_cast<std::uint32_t>(p.preset), "; valid: 0 (fast) to 3 (reference)");
  }
  if (p.membrane_model > MembraneModel::kContinuum) {
    Fail("scene", "physics.membrane_model = ", static_cast<std::uint32_t>(p.membrane_model),
         "; valid: 0 (springs), 1 (continuum)");
  }
  CheckBounds({{"physics.iterations", static_cast<float>(p.iterations), 1, 1000},
               {"physics.dt_s", p.dt_s, 1e-4f, 0.1f},
               {"physics.damping_per_s", p.damping_per_s, 0, 1000},
               {"physics.gravity", p.gravity.norm(), 0, 100},
               {"physics.k_stretch_tube", p.k_stretch_tube, 0, 1},
               {"physics.k_stretch_membrane", p.k_stretch_membrane, 0, 1},
               {"physics.k_volume", p.k_volume, 0, 1},
               {"physics.k_bending", p.k_bending, 0, 1},
               {"physics.k_binding", p.k_binding, 0, 1},
               {"physics.tube_youngs_modulus", p.tube_youngs_modulus_Pa, 1, 1e9f},
               {"physics.substeps", static_cast<float>(p.substeps), 1, 1000},
               {"physics.tube_poisson", p.tube_poisson, 0, 0.495f},
               {"physics.membrane_Et", p.membrane_Et_N_per_m, 1e-3f, 1e7f},
               {"physics.membrane_stiffening", p.membrane_stiffening, 0, 1000},
               {"physics.membrane_prestrain", p.membrane_prestrain, 0, 0.5f},
               {"physics.membrane_bending", p.membrane_bending_Nm, 0, 1},
               {"physics.fat_youngs_modulus", p.fat_youngs_modulus_Pa, 1, 1e9f},
               {"physics.friction", p.friction, 0, 2},
               {"physics.collision_margin", p.collision_margin_m, 0, 0.01f},
               {"physics.grasp_radius", p.grasp_radius_m, 1e-4f, 0.05f},
               {"physics.grasp_close", p.grasp_close_rad, 0, 1.5f},
               {"physics.grasp_open", p.grasp_open_rad, p.grasp_close_rad, 1.6f},
               {"physics.grip_force", p.grip_force_N, 0, 1000},
               {"physics.tear_stretch", p.tear_stretch, 0, 10}});
  if (p.tear_stretch != 0.0f && !(p.tear_stretch > 1.0f + p.membrane_prestrain)) {
    Fail("scene", "physics.tear_stretch = ", p.tear_stretch, "; valid: 0 (never) or above 1 + membrane_prestrain");
  }
  if (t.model > ThermalModel::kPaper) {
    Fail("scene", "thermal.model = ", static_cast<std::uint32_t>(t.model), "; valid: 0 (accurate), 1 (paper)");
  }
  CheckBounds({{"thermal.cell", t.cell_m, 1e-5f, 0.01f},
               {"thermal.thickness", t.thickness_m, 1e-5f, 0.01f},
               {"thermal.density", t.density_kg_m3, 1, 1e5f},
               {"thermal.heat_capacity", t.heat_capacity_J_kgK, 1, 1e5f},
               {"thermal.conductivity", t.conductivity_W_mK, 0, 1e4f},
               {"thermal.latent_heat", t.latent_heat_J_m3, 0, 1e11f},
               {"thermal.body_temperature", t.body_temperature_C, 0, 60},
               {"thermal.h_top", t.h_top_W_m2K, 0, 1e5f},
               {"thermal.h_below", t.h_below_W_m2K, 0, 1e5f},
               {"thermal.h_tented", t.h_tented_W_m2K, 0, 1e5f},
               {"thermal.perfusion", t.perfusion_per_s, 0, 10},
               {"thermal.sigma", t.sigma_S_m, 1e-4f, 100},
               {"thermal.sigma_per_K", t.sigma_per_K, 0, 1},
               {"thermal.sigma_fat", t.sigma_fat_S_m, 0, 100},
               {"thermal.fat_depth", t.fat_depth_m, 1e-4f, 1},
               {"thermal.v_max", t.v_max_V, 1, 1e4f},
               {"thermal.i_max", t.i_max_A, 1e-3f, 100},
               {"thermal.hook_radius", t.hook_radius_m, 1e-5f, 0.01f},
               {"thermal.shrink_max", t.shrink_max, 0, 0.5f},
               {"thermal.volume", static_cast<float>(t.volume), 0, 1}});
  CheckBounds({{"render.width", static_cast<float>(r.width), 16, 7680},
               {"render.height", static_cast<float>(r.height), 16, 4320},
               {"render.rate", r.rate_Hz, 0.1f, 240},
               {"render.png_rate", r.png_rate_Hz, 0, 240},
               {"render.fov", r.fov_deg, 10, 150},
               {"render.scope_angle", r.scope_angle_deg, 0, 90},
               {"render.roll", r.roll_deg, -180, 180},
               {"render.hud", static_cast<float>(r.hud), 0, 1},
               {"haptics.force_limit", h.force_limit_N, 0.01f, 100},
               {"haptics.slew", h.slew_N_per_ms, 1e-4f, 100},
               {"haptics.hand_mass", h.hand_mass_kg, 1e-3f, 100},
               {"haptics.hand_stiffness", h.hand_stiffness_N_m, 0, 1e5f},
               {"haptics.hand_damping", h.hand_damping_Ns_m, 0, 1e4f},
               {"haptics.force_scale", h.force_scale, 0, 100},
               {"breathing.direction", s.breathing.direction.norm(), 0.999f, 1.001f},
               {"breathing.amplitude", s.breathing.amplitude_m, 0, 0.05f},
               {"breathing.period", s.breathing.period_s, 0.5f, 60},
               {"script duration", s.script_duration_s, 0, 86400},
               {"membrane texel", s.membrane.texel_m, 1e-6f, 0.01f}});
  CheckAssessment(s.assessment);
  CheckPoint("scene", 0, r.scope_tip_W);
  CheckPoint("scene", 1, r.scope_target_W);
  CheckRange("scene", "distance of the scope's target", 0, (r.scope_target_W - r.scope_tip_W).norm(), 0.004, 100);
  for (std::size_t i = 0; i < s.tools.size(); ++i) {
    const ToolDescription& tool = s.tools[i];
    if (tool.kind > ToolKind::kClipApplier) {
      Fail("scene", "tool ", i, ": unknown kind ", static_cast<int>(tool.kind));
    }
    CheckPoint("scene", i, tool.p_WP);
    CheckRange("scene", "shaft_radius_m", i, tool.shaft_radius_m, 0, 0.05);
    CheckRange("scene", "shaft_length_m", i, tool.shaft_length_m, 0, 2);
    CheckRange("scene", "tip_radius_m", i, tool.tip_radius_m, 0, 0.05);
    CheckRange("scene", "tip_length_m", i, tool.tip_length_m, 0, 0.5);
    CheckRange("scene", "traction_N", i, tool.traction_N, 0, 9);
  }
  if (s.node_mask >> kNodeCount != 0) {
    Fail("scene", "node_mask = ", s.node_mask, ": only ", kNodeCount, " nodes exist");
  }
  if (std::memchr(s.name, 0, sizeof(s.name)) == nullptr || s.name[0] == 0) {
    Fail("scene", "the name is empty or too long");
  }
}

}  // namespace fulcrum::scene
