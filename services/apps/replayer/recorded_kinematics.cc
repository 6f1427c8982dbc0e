#include "services/apps/replayer/recorded_kinematics.h"

#include <cstdint>
#include <optional>
#include <string>

#include "services/apps/replayer/recorded_topic.h"
#include "services/base/core/error.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

/// Longest time between a sample's stamp and its place in the order of the log [s].
constexpr double kLatest_s = 1;

[[noreturn]] void Refuse(const std::filesystem::path& recording, const char* what) {
  throw InputError(recording.string() + ": " + what);
}

constexpr const char* kNoSession = "no session begins in it (no SceneManifest); is it a dump of the last seconds?";

/// The session's data, if this message has them. Throws MismatchError for one of another scene.
void TakeSession(const std::filesystem::path& recording, const SceneView& scene, const recording::McapMessage& message,
                 std::optional<SceneManifest>* session) {
  if (SceneManifest manifest; bus::DecodeCdr(message.data, &manifest)) *session = manifest;
  RefuseOtherScene(recording, *session, scene);
}

}  // namespace

RecordedSpan ReadSpan(const std::filesystem::path& recording, const SceneView& scene) {
  std::optional<SceneManifest> session;
  recording::McapReader reader(recording);
  for (recording::McapMessage message{}; !session && reader.Next(&message);) {
    const std::string& topic = reader.channels().at(message.channel).topic;
    if (topic == bus::RoleOf<SceneManifest>().name) TakeSession(recording, scene, message, &session);
  }
  if (!session) Refuse(recording, kNoSession);
  return SpanOf(recording, ClockOf(recording), session->session_start_ns);
}

Kinematics ReadKinematics(const std::filesystem::path& recording, const SceneView& scene, double until_s) {
  const RecordedClock clock = ClockOf(recording);
  RecordedTopic<ToolState> tools;
  RecordedTopic<HandleState> handles;
  RecordedTopic<ContactModel> contacts;
  Kinematics result;
  std::optional<SceneManifest> session;
  bool has_tissue = false;
  recording::TimeOrder messages(recording);
  for (recording::McapMessage message{}; messages.Next(&message);) {
    const std::string& topic = messages.reader().channels().at(message.channel).topic;
    if (topic == bus::RoleOf<SceneManifest>().name) {
      TakeSession(recording, scene, message, &session);
      continue;
    }
    const auto has_passed = [&](std::int64_t ns, double margin_s) {
      return session && 1e-9 * static_cast<double>(ns - session->session_start_ns) > until_s + margin_s;
    };
    if (has_passed(static_cast<std::int64_t>(message.log_time_ns) - clock.offset_ns, kLatest_s)) break;
    has_tissue = has_tissue || topic == bus::RoleOf<TissueFrame>().name;
    const auto take = [&]<class T>(RecordedTopic<T>* of) {
      if (topic != bus::RoleOf<T>().name) return;
      const T* sample = of->Take(message.data, LatestStamp(clock, message.log_time_ns));
      // A later sample does not contribute to the state at `until_s`.
      if (sample != nullptr && !has_passed(bus::StampOf(*sample).stamp_ns, Kinematics::kLongest_s)) result.Add(*sample);
    };
    take(&tools);
    take(&handles);
    take(&contacts);
  }
  if (!session) Refuse(recording, kNoSession);
  if (result.empty()) Refuse(recording, "has no poses of instruments (topic ToolState)");
  if (!has_tissue) Refuse(recording, "has no tissue to show (topic TissueFrame)");
  return result;
}

}  // namespace fulcrum::replay
