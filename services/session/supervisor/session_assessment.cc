#include "services/session/supervisor/session_assessment.h"

namespace fulcrum::supervisor {

SessionAssessment::SessionAssessment(const SceneView& scene, bus::DdsParticipant* participant)
    : params_(scene.assessment),
      assessor_(scene),
      tools_(participant->MakeInput<ToolState>()),
      handles_(participant->MakeInput<HandleState>()),
      contacts_(participant->MakeInput<ContactModel>()),
      cautery_(participant->MakeInput<CauteryContact>()),
      topology_(participant->MakeInput<TopologyState>()) {
  if (assessor_.needs_patches()) patches_ = participant->MakeInput<TemperaturePatch>();
}

void SessionAssessment::Take() {
  const auto take = [this](auto* input, auto* sample) {
    while (input != nullptr && input->TakeNext(sample)) assessor_.Add(*sample);
  };
  ToolState tool;
  HandleState handles;
  ContactModel model;
  CauteryContact contact;
  take(tools_.get(), &tool);
  take(handles_.get(), &handles);
  take(contacts_.get(), &model);
  take(cautery_.get(), &contact);
  take(topology_.get(), &topology_sample_);
  take(patches_.get(), &patch_);
}

std::string SessionAssessment::Line(double session_time_s) const {
  const std::string_view prompt = MostUrgent(assessor_.PromptsAt(session_time_s));
  const assessment::Score score = assessment::Evaluate(params_, assessor_.figures());
  return (prompt.empty() ? std::string() : " · ! " + std::string(prompt)) + " · score " + Fixed(score.percent(), 0) +
         " %";
}

void SessionAssessment::AddTo(double session_time_s, Health* health) const {
  health->metrics.push_back({"prompts", static_cast<double>(assessor_.PromptsAt(session_time_s))});
  health->metrics.push_back({"score_pct", assessment::Evaluate(params_, assessor_.figures()).percent()});
}

ScoreSheet SessionAssessment::Finish() {
  assessor_.Finish();
  const assessment::Figures figures = assessor_.figures();
  return {figures, assessment::Evaluate(params_, figures)};
}

void SessionAssessment::Close() {
  tools_.reset();
  handles_.reset();
  contacts_.reset();
  cautery_.reset();
  topology_.reset();
  patches_.reset();
}

}  // namespace fulcrum::supervisor
