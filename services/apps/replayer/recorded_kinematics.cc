#include "services/apps/replayer/recorded_kinematics.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "services/apps/replayer/session_facts.h"
#include "services/base/core/error.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

/// A stamp and the log time of its sample come from two clocks' readings; a stamp later than this after the log time
/// is of no process [ns].
constexpr std::int64_t kClockTolerance_ns = 1'000'000'000;

/// One topic, as a node that reads it would take it.
template <class T>
class Topic {
 public:
  void AddIf(const std::string& topic, std::span<const std::uint8_t> bytes, std::int64_t recorded_ns, Kinematics* to) {
    if (topic != bus::RoleOf<T>().name || !bus::DecodeCdr(bytes, &sample_) || !bus::PassesGate(sample_)) return;
    const Stamp& stamp = bus::StampOf(sample_);
    // One stamp of the far future would shut out all samples after it.
    if (stamp.stamp_ns > recorded_ns || !account_.IsOfOwner(stamp, std::max<std::int64_t>(0, recorded_ns))) return;
    to->Add(sample_);
  }

 private:
  T sample_;
  bus::InputAccount account_{false, true};
};

}  // namespace

RecordedKinematics ReadKinematics(const std::filesystem::path& recording, const SceneView& scene) {
  const RecordedClock clock = ClockOf(recording);
  Topic<ToolState> tools;
  Topic<HandleState> handles;
  Topic<ContactModel> contacts;
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
    const std::int64_t recorded_ns =
        static_cast<std::int64_t>(message.log_time_ns) - clock.offset_ns + kClockTolerance_ns;
    tools.AddIf(topic, message.data, recorded_ns, &result.kinematics);
    handles.AddIf(topic, message.data, recorded_ns, &result.kinematics);
    contacts.AddIf(topic, message.data, recorded_ns, &result.kinematics);
  }
  const auto refuse = [&](const char* what) { throw InputError(recording.string() + ": " + what); };
  if (!session) refuse("no session begins in it (no SceneManifest); is it a dump of the last seconds?");
  if (result.kinematics.empty()) refuse("has no poses of instruments (topic ToolState)");
  if (!has_tissue) refuse("has no tissue to show (topic TissueFrame)");
  result.end_s = std::max(0.0, 1e-9 * static_cast<double>(clock.last_ns - session->session_start_ns));
  return result;
}

}  // namespace fulcrum::replay
