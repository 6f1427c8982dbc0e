#include "services/session/assessment/recorded_assessment.h"

#include <algorithm>
#include <map>
#include <optional>
#include <type_traits>

#include "services/base/core/error.h"
#include "services/records/log_tools/recording.h"
#include "services/records/recording/recorded_scene.h"
#include "services/session/assessment/assessor.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"

namespace fulcrum::assessment {
namespace {

struct Session {
  std::optional<SceneManifest> manifest;
  std::optional<double> end_s;
};

/// Start of the first session in the file, and the session time at which the supervisor stopped its clock.
Session FindSession(const std::filesystem::path& file) {
  Session session;
  log_tools::Recording recording(file, {.topics = {"SceneManifest", "Health"}});
  log_tools::Entry entry;
  while (recording.Next(&entry)) {
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, SceneManifest>) {
        if (!session.manifest) session.manifest = message;
      } else if constexpr (std::is_same_v<T, Health>) {
        if (message.node != NodeId::kSupervisor || message.state != HealthState::kStopping) return;
        const auto time = std::find_if(message.metrics.begin(), message.metrics.end(),
                                       [](const Metric& metric) { return metric.name == "session_time_s"; });
        // The last Health is used: earlier ones with the state "stopping" were sent before the clock stopped.
        if (time != message.metrics.end()) session.end_s = time->value;
      }
    });
  }
  return session;
}

}  // namespace

RecordedAssessment AssessRecording(const std::filesystem::path& file, const SceneView& scene) {
  if (scene.assessment.on == 0) {
    throw InputError(std::string("scene \"") + scene.name +
                     "\" has no section `assessment`, so there are no measures; give a scene that has one");
  }
  const Session session = FindSession(file);
  if (!session.manifest) {
    throw InputError(file.string() + ": no session begins in it (no SceneManifest); is it a dump of the last seconds?");
  }
  recording::RefuseOtherScene(file, session.manifest, scene);
  RecordedAssessment result{session.manifest->session_id, session.end_s.value_or(0), {}};
  Assessor assessor(scene);
  assessor.Begin(session.manifest->session_start_ns);
  if (session.end_s) assessor.End(*session.end_s);
  log_tools::Filter filter{
      .topics = {"ToolState", "HandleState", "ContactModel", "CauteryContact", "ThermalEvent", "TopologyState"}};
  if (assessor.needs_patches()) filter.topics.insert("TemperaturePatch");
  log_tools::Recording recording(file, filter);
  std::map<TopicId, bus::InputAccount> accounts;  // Skips the samples that a node would have refused.
  log_tools::Entry entry;
  while (recording.Next(&entry)) {
    bus::InputAccount& account = accounts.try_emplace(*entry.source->topic, false, true).first->second;
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (requires { assessor.Add(message); }) {
        if (!bus::PassesGate(message) || !account.IsOfOwner(bus::StampOf(message))) return;
        assessor.Add(message);
        if (!session.end_s) {
          const double time_s =
              1e-9 * static_cast<double>(bus::StampOf(message).stamp_ns - session.manifest->session_start_ns);
          result.end_s = std::max(result.end_s, time_s);
        }
      }
    });
  }
  assessor.Finish();
  result.figures = assessor.figures();
  return result;
}

}  // namespace fulcrum::assessment
