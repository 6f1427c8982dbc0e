// A session, measured while it lasts or from a recording: messages in, figures out. No bus, no clock.
//
//   Assessor assessor(scene);
//   assessor.Begin(manifest.session_start_ns);
//   assessor.Add(message);            // Each message of the topics of kTopics, in the order of its writer.
//   assessor.End(session_time_s);     // Then nothing later counts.
//   Score score = Evaluate(scene.assessment, assessor.figures());
//
// The order between topics does not matter: a measure comes from one topic alone, and a contact waits for the pedal of
// its time. Live and from a recording the same messages give the same figures.
#pragma once

#include <array>
#include <deque>
#include <limits>

#include "services/base/core/generator_inputs.h"
#include "services/base/core/scene_view.h"
#include "services/session/assessment/damage_map.h"
#include "services/session/assessment/force_meter.h"
#include "services/session/assessment/line_meter.h"
#include "services/session/assessment/motion_meter.h"
#include "services/session/assessment/score.h"

namespace fulcrum::assessment {

class Assessor {
 public:
  /// `scene` must have the section (scene.assessment.on) and outlive this.
  explicit Assessor(const SceneView& scene);
  Assessor(const Assessor&) = delete;
  Assessor& operator=(const Assessor&) = delete;

  /// Session time 0; before, nothing counts.
  void Begin(std::int64_t session_start_ns);
  /// The session is over at this time.
  void End(double session_time_s);

  void Add(const ToolState& state);
  void Add(const ContactModel& model);
  void Add(const HandleState& state);
  void Add(const CauteryContact& contact);
  void Add(const ThermalEvent& event);
  void Add(const TopologyState& topology);
  void Add(const TemperaturePatch& patch);

  /// Patches are large, and of use only where a line is planned.
  [[nodiscard]] bool needs_patches() const { return !line_.line().empty(); }

  /// So far. The last movement counts when it has ended, the last contacts when their pedal is known: after Finish()
  /// all do.
  [[nodiscard]] Figures figures() const;
  void Finish();
  /// Set of Prompt bits at a session time.
  [[nodiscard]] std::uint32_t PromptsAt(double session_time_s) const;

 private:
  [[nodiscard]] double TimeOf(const Stamp& stamp) const;
  [[nodiscard]] bool Counts(double time_s) const { return begun_ && time_s >= 0 && time_s <= end_s_; }
  void Raise(Prompt prompt, double until_s);
  /// Those whose pedal is known; all of them: whether or not.
  void MeasureContacts(bool all);
  [[nodiscard]] MeasureValues ToolFigures(int i) const;
  void SetOfMotion(MeasureValues* session) const;
  void SetOfHook(MeasureValues* session) const;

  SceneView scene_;
  bool begun_ = false;
  std::int64_t start_ns_ = 0;
  double end_s_ = std::numeric_limits<double>::infinity();
  MotionMeter motion_;
  ForceMeter force_;
  LineMeter line_;
  GeneratorInputs generator_;
  std::deque<HookSample> contacts_;  ///< Waiting for the pedal of their time.
  DamageMap damage_;
  double cut_length_m_ = 0, cut_width_m_ = 0, cut_off_way_m_ = 0;
  std::array<int, 4> alarms_{};  ///< Ureter warnings and injuries, nerve warnings and injuries.
  std::array<double, kPromptCount> prompt_until_s_{};
};

}  // namespace fulcrum::assessment
