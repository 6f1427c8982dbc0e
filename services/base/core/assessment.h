// Measures by which a session is assessed, their usual thresholds, and the prompts that a trainee sees during the
// session. Plain data, shared by scene description, assessment and displays. No I/O here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace fulcrum {

// ------------------------------------------------------------------------------------------------- measures

/// Measures in the order of the score sheet. Definition of each: services/session/assessment/DESIGN.md.
enum class Measure : std::uint32_t {
  kLift,
  kLiftHold,
  kCutLength,
  kCutWidth,
  kCutOffWay,
  kLineDone,
  kTime,
  kPathLength,
  kMovements,
  kIdle,
  kSmoothness,
  kForceTime,
  kPeakForce,
  kGraspSlips,
  kPedalWithoutContact,
  kDeviationMean,
  kDeviationMax,
  kDamageBeyondMargin,
  kOrganBurn,
  kOffCentre,
  kHorizon,
  kLensSmeared,
  kUreterWarnings,
  kUreterInjuries,
  kNerveWarnings,
  kNerveInjuries
};
inline constexpr std::size_t kMeasureCount = 26;

/// Part of a measure in the score.
enum class MeasureRole : std::uint8_t {
  kTask,   ///< The result: at least the threshold; the other points count in proportion to it.
  kSkill,  ///< The quality of execution.
};

struct MeasureInfo {
  const char* name;   ///< Key in a scene's `points`.
  const char* key;    ///< Key in a scene's `limits`, in JSON and in the trainees' database: the name and its unit.
  const char* label;  ///< For people.
  const char* unit;
  int decimals;
  MeasureRole role;
  bool at_least;    ///< Whether the threshold is a lower limit of the value; otherwise it is an upper limit.
  bool per_tool;    ///< Also measured for each tool.
  float limit;      ///< Usual threshold, in `unit`.
  float low, high;  ///< Range of valid thresholds.
  float points;     ///< Usual points; 0: measured, not scored.
};

inline constexpr float kMostPoints = 1000;

inline constexpr std::array<MeasureInfo, kMeasureCount> kMeasures{{
    {"lift", "lift_mm", "lift of the grasped tissue", "mm", 1, MeasureRole::kTask, true, true, 8, 0, 200, 0},
    {"lift_hold", "lift_hold_s", "held lifted within the force", "s", 1, MeasureRole::kTask, true, true, 2, 0, 3600, 0},
    {"cut_length", "cut_length_mm", "cut length", "mm", 1, MeasureRole::kTask, true, false, 10, 0, 1000, 0},
    {"cut_width", "cut_width_mm", "width of the slit, 95 % below", "mm", 2, MeasureRole::kSkill, false, false, 2.2f, 0,
     100, 0},
    {"cut_off_way", "cut_off_way_mm", "slit off the metal's way, 95 % below", "mm", 2, MeasureRole::kSkill, false,
     false, 0.5f, 0, 100, 0},
    {"line_done", "line_done_pct", "planned line done", "%", 0, MeasureRole::kTask, true, false, 90, 0, 100, 15},
    {"time", "time_s", "time from first to last movement", "s", 1, MeasureRole::kSkill, false, true, 120, 0, 86400, 5},
    {"path_length", "path_length_mm", "path length", "mm", 0, MeasureRole::kSkill, false, true, 2000, 0, 1e6f, 5},
    {"movements", "movements", "movements", "", 0, MeasureRole::kSkill, false, true, 60, 0, 1e5f, 5},
    {"idle", "idle_s", "idle time", "s", 1, MeasureRole::kSkill, false, true, 20, 0, 86400, 5},
    {"smoothness", "smoothness", "smoothness (SPARC)", "", 2, MeasureRole::kSkill, true, true, -3, -50, -1, 5},
    {"force_time", "force_time_Ns", "force · time", "N s", 1, MeasureRole::kSkill, false, true, 300, 0, 1e6f, 5},
    {"peak_force", "peak_force_N", "peak force", "N", 2, MeasureRole::kSkill, false, true, 11.4f, 0, 100, 15},
    {"grasp_slips", "grasp_slips", "grasp slips", "", 0, MeasureRole::kSkill, false, true, 0, 0, 1000, 5},
    {"pedal_without_contact", "pedal_without_contact_s", "pedal time without contact", "s", 1, MeasureRole::kSkill,
     false, false, 2, 0, 3600, 5},
    {"deviation_mean", "deviation_mean_mm", "mean deviation from the line", "mm", 2, MeasureRole::kSkill, false, false,
     1, 0, 100, 10},
    {"deviation_max", "deviation_max_mm", "largest deviation from the line", "mm", 2, MeasureRole::kSkill, false, false,
     3, 0, 100, 5},
    {"damage_beyond_margin", "damage_beyond_margin_mm2", "thermal damage beyond the margin", "mm²", 1,
     MeasureRole::kSkill, false, false, 5, 0, 1e5f, 10},
    {"organ_burn", "organ_burn_mm2", "burnt surface of organs", "mm²", 1, MeasureRole::kSkill, false, false, 5, 0, 1e5f,
     5},
    {"off_centre", "off_centre_deg", "tool off the middle of the picture", "°", 1, MeasureRole::kSkill, false, false,
     12, 0, 180, 0},
    {"horizon", "horizon_deg", "tilt of the horizon", "°", 1, MeasureRole::kSkill, false, false, 5, 0, 180, 0},
    {"lens_smeared", "lens_smeared_s", "time with a smeared lens", "s", 1, MeasureRole::kSkill, false, false, 2, 0,
     3600, 0},
    {"ureter_warnings", "ureter_warnings", "ureter: warnings", "", 0, MeasureRole::kSkill, false, false, 0, 0, 1000, 5},
    {"ureter_injuries", "ureter_injuries", "ureter: injuries", "", 0, MeasureRole::kSkill, false, false, 0, 0, 1000,
     15},
    {"nerve_warnings", "nerve_warnings", "nerve: warnings", "", 0, MeasureRole::kSkill, false, false, 0, 0, 1000, 5},
    {"nerve_injuries", "nerve_injuries", "nerve: injuries", "", 0, MeasureRole::kSkill, false, false, 0, 0, 1000, 15},
}};

[[nodiscard]] constexpr const MeasureInfo& InfoOf(Measure measure) {
  return kMeasures[static_cast<std::size_t>(measure)];
}

// ------------------------------------------------------------------------------------------- section assessment

/// Instrument action that traces the planned line.
/// kView: the middle of the picture of a held scope.
enum class LineTracing : std::uint32_t { kCut = 0, kTouch = 1, kView = 2 };

/// Section `assessment` of a scene. The planned line itself is an array of the scene.
struct AssessmentParams {
  std::uint32_t on = 0;  ///< 1: the scene has the section. Otherwise nothing is measured or subscribed.
  LineTracing tracing = LineTracing::kCut;
  float line_reach_m = 0.002f;                ///< A point of the line is done if the trace passes within this distance.
  float margin_m = 0.002f;                    ///< Coagulated tissue farther than this from the planned line is damage.
  float near_m = 0.005f;                      ///< An energised tip this near a ureter or nerve is a prompt.
  float movement_speed_m_s = 0.005f;          ///< A movement is faster than this at some time …
  float idle_speed_m_s = 0.001f;              ///< … and lasts as long as the tip is faster than this.
  float idle_after_s = 0.5f;                  ///< Rest counts as idle time if it lasts longer than this.
  std::array<float, kMeasureCount> limit{};   ///< In the unit of the measure.
  std::array<float, kMeasureCount> points{};  ///< 0: not scored.
};

/// Parameters with the usual thresholds and points.
[[nodiscard]] constexpr AssessmentParams UsualAssessment() {
  AssessmentParams params;
  for (std::size_t i = 0; i < kMeasureCount; ++i) {
    params.limit[i] = kMeasures[i].limit;
    params.points[i] = kMeasures[i].points;
  }
  return params;
}

// --------------------------------------------------------------------------------------------------- prompts

/// Warnings shown to a trainee at once, most urgent first. The supervisor's Health carries the set as its metric
/// `prompts`, the sum of 1 << prompt.
enum class Prompt : std::uint32_t {
  kInjury,
  kUreterHot,
  kNerveHot,
  kOrganBurnt,
  kForceTooHigh,
  kUreterNear,
  kNerveNear,
  kPedalWithoutContact,
  kGraspSlips,
  kOffLine
};
inline constexpr std::size_t kPromptCount = 10;
inline constexpr std::array<std::string_view, kPromptCount> kPromptTexts{
    "injury: stop", "ureter is getting hot", "nerve is getting hot", "organ burnt", "force too high", "ureter near",
    "nerve near",   "pedal, no contact",     "grasp slips",          "off the line"};

inline constexpr std::uint32_t BitOf(Prompt prompt) { return 1u << static_cast<std::uint32_t>(prompt); }
/// Text of the most urgent prompt of a set; empty if the set is empty.
[[nodiscard]] constexpr std::string_view MostUrgent(std::uint32_t prompts) {
  for (std::size_t i = 0; i < kPromptCount; ++i) {
    if ((prompts >> i & 1u) != 0) return kPromptTexts[i];
  }
  return {};
}

}  // namespace fulcrum
