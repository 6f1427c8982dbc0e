#include "services/apps/replayer/recorded_kinematics.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "services/apps/replayer/recorded_topic.h"
#include "services/apps/replayer/session_facts.h"
#include "services/base/core/error.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {

RecordedKinematics ReadKinematics(const std::filesystem::path& recording, const SceneView& scene) {
  const RecordedClock clock = ClockOf(recording);
  RecordedTopic<ToolState> tools;
  RecordedTopic<HandleState> handles;
  RecordedTopic<ContactModel> contacts;
  RecordedKinematics result;
  std::optional<SceneManifest> session;
  bool has_tissue = false;
  recording::TimeOrder messages(recording);
  for (recording::McapMessage message{}; messages.Next(&message);) {
    const std::string& topic = messages.reader().channels().at(message.channel).topic;
    if (topic == bus::RoleOf<SceneManifest>().name) {
      if (SceneManifest manifest; bus::DecodeCdr(message.data, &manifest)) session = manifest;
      RefuseOtherScene(recording, session, scene);
      continue;
    }
    has_tissue = has_tissue || topic == bus::RoleOf<TissueFrame>().name;
    const auto take = [&]<class T>(RecordedTopic<T>* of) {
      if (topic != bus::RoleOf<T>().name) return;
      const T* sample = of->Take(message.data, LatestStamp(clock, message.log_time_ns));
      if (sample != nullptr) result.kinematics.Add(*sample);
    };
    take(&tools);
    take(&handles);
    take(&contacts);
  }
  const auto refuse = [&](const char* what) { throw InputError(recording.string() + ": " + what); };
  if (!session) refuse("no session begins in it (no SceneManifest); is it a dump of the last seconds?");
  if (result.kinematics.empty()) refuse("has no poses of instruments (topic ToolState)");
  if (!has_tissue) refuse("has no tissue to show (topic TissueFrame)");
  result.end_s = std::max(0.0, 1e-9 * static_cast<double>(clock.last_ns - session->session_start_ns));
  return result;
}

}  // namespace fulcrum::replay
