// Measures of a session from its messages, live or from a recording. It uses no bus and no clock.
//
//   Assessor assessor(scene);
//   assessor.Begin(manifest.session_start_ns);
//   assessor.Add(message);            // Each message of the topics of kTopics, in the order of its writer.
//   assessor.End(session_time_s);     // Messages after this time do not count.
//   Score score = Evaluate(scene.assessment, assessor.figures());
//
// The order between topics does not matter: each measure comes from one topic, and a contact waits for the pedal state
// of its time. Live and from a recording the same messages give the same figures.
#pragma once

#include <array>
#include <deque>
#include <limits>

#include "services/base/core/generator_inputs.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/solids.h"
#include "services/session/assessment/damage_map.h"
#include "services/session/assessment/force_meter.h"
#include "services/session/assessment/line_meter.h"
#include "services/session/assessment/motion_meter.h"
#include "services/session/assessment/scope_meter.h"
#include "services/session/assessment/score.h"

namespace fulcrum::assessment {

class Assessor {
 public:
  /// `scene` must have the section (scene.assessment.on) and outlive this.
  explicit Assessor(const SceneView& scene);
  Assessor(const Assessor&) = delete;
  Assessor& operator=(const Assessor&) = delete;

  /// Sets the time of session time 0 [ns]; earlier messages do not count.
  void Begin(std::int64_t session_start_ns);
  /// Sets the session time of the end [s]; later messages do not count.
  void End(double session_time_s);

  void Add(const ToolState& state);
  void Add(const ContactModel& model);
  void Add(const HandleState& state);
  void Add(const CauteryContact& contact);
  void Add(const ThermalEvent& event);
  void Add(const TopologyState& topology);
  void Add(const TemperaturePatch& patch);

  /// True when the scene has a planned line. Without one, the large patches need not be read.
  [[nodiscard]] bool needs_patches() const { return !line_.line().empty(); }

  /// Figures so far. A movement counts when it has ended, a contact when its pedal state is known; after Finish() all
  /// count.
  [[nodiscard]] Figures figures() const;
  void Finish();
  /// Set of Prompt bits at a session time.
  [[nodiscard]] std::uint32_t PromptsAt(double session_time_s) const;

 private:
  [[nodiscard]] double TimeOf(const Stamp& stamp) const;
  [[nodiscard]] bool Counts(double time_s) const { return begun_ && time_s >= 0 && time_s <= end_s_; }
  void Raise(Prompt prompt, double until_s);
  /// Measures the waiting contacts whose pedal state is known, or all of them.
  void MeasureContacts(bool all);
  [[nodiscard]] MeasureValues ToolFigures(int i) const;
  [[nodiscard]] bool Assists(std::size_t tool) const { return scene_.tools[tool].assists(); }
  void SetOfMotion(MeasureValues* session) const;
  void SetOfHook(MeasureValues* session) const;
  void SetOfScope(MeasureValues* session) const;
  void SetOfLine(MeasureValues* session) const;
  [[nodiscard]] bool by_view() const { return scene_.assessment.tracing == LineTracing::kView; }

  SceneView scene_;
  bool begun_ = false;
  std::int64_t start_ns_ = 0;
  double end_s_ = std::numeric_limits<double>::infinity();
  MotionMeter motion_;
  ForceMeter force_;
  LineMeter line_;
  ScopeMeter scope_;
  GeneratorInputs generator_;
  std::deque<HookSample> contacts_;  ///< Contacts that wait for the pedal state of their time.
  DamageMap damage_;
  double cut_length_m_ = 0, cut_width_m_ = 0, cut_off_way_m_ = 0;
  std::array<double, kMaxSolids> burnt_m2_{};  ///< Dead surface of each organ.
  std::array<int, 4> alarms_{};  ///< Counts of ureter warnings, ureter injuries, nerve warnings, nerve injuries.
  std::array<double, kPromptCount> prompt_until_s_{};
};

}  // namespace fulcrum::assessment
