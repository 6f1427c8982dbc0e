// The assessment of a running session: the topics it needs, and what is told of it while it lasts.
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
  /// Subscribes. `scene` must outlive this.
  SessionAssessment(const SceneView& scene, bus::DdsParticipant* participant);

  void Begin(std::int64_t session_start_ns) { assessor_.Begin(session_start_ns); }
  void End(double session_time_s) { assessor_.End(session_time_s); }
  /// Takes what has come. Thermal events are the supervisor's own input: hand them in.
  void Take();
  void Add(const ThermalEvent& event) { assessor_.Add(event); }
  /// The most urgent prompt, and the score so far.
  [[nodiscard]] std::string Line(double session_time_s) const;
  /// Its metrics: the set of prompts and the score.
  void AddTo(double session_time_s, Health* health) const;
  /// Closes the inputs; the figures stay.
  void Close();

  /// The session is over: what it came to.
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
  TopologyState topology_sample_;  ///< Reused: they keep their buffers.
  TemperaturePatch patch_;
};

}  // namespace fulcrum::supervisor
