// The assessment of a running session: subscription of its topics, prompts and score while the session lasts.
#pragma once

#include <memory>
#include <string>

#include "services/session/assessment/assessor.h"
#include "services/session/supervisor/outcome.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/port.h"

namespace fulcrum::supervisor {

class SessionAssessment {
 public:
  /// Subscribes the topics. `scene` must outlive this.
  SessionAssessment(const SceneView& scene, bus::DdsParticipant* participant);

  void Begin(std::int64_t session_start_ns) { assessor_.Begin(session_start_ns); }
  void End(double session_time_s) { assessor_.End(session_time_s); }
  /// Reads all samples that have arrived. Thermal events are an input of the supervisor, which passes them here.
  void Take();
  void Add(const ThermalEvent& event) { assessor_.Add(event); }
  /// Text with the most urgent prompt and the score so far.
  [[nodiscard]] std::string Line(double session_time_s) const;
  /// Metrics for the supervisor's Health: the set of prompts and the score.
  void AddTo(double session_time_s, Health* health) const;
  /// Closes the inputs; the figures stay.
  void Close();

  /// Measures and score at the end of the session.
  [[nodiscard]] ScoreSheet Finish();

 private:
  const AssessmentParams params_;
  assessment::Assessor assessor_;
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<HandleState>> handles_;
  std::unique_ptr<bus::Input<ContactModel>> contacts_;
  std::unique_ptr<bus::Input<CauteryContact>> cautery_;
  std::unique_ptr<bus::Input<TopologyState>> topology_;
  std::unique_ptr<bus::Input<TemperaturePatch>> patches_;
  TopologyState topology_sample_;  ///< The samples are members so that their buffers are reused.
  TemperaturePatch patch_;
};

}  // namespace fulcrum::supervisor
