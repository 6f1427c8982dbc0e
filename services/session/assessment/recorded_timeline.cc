#include "services/session/assessment/recorded_timeline.h"

#include <map>
#include <optional>
#include <type_traits>

#include "services/base/core/error.h"
#include "services/records/log_tools/recording.h"
#include "services/records/recording/recorded_scene.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"

namespace fulcrum::assessment {
namespace {

std::int64_t StartOf(const std::filesystem::path& file) {
  std::optional<std::int64_t> start_ns;
  log_tools::Recording recording(file, {.topics = {"SceneManifest"}});
  log_tools::Entry entry;
  while (!start_ns && recording.Next(&entry)) {
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, SceneManifest>) {
        if (bus::PassesGate(message)) start_ns = message.session_start_ns;
      }
    });
  }
  if (!start_ns) {
    throw InputError(file.string() + ": no session begins in it (no SceneManifest); is it a dump of the last seconds?");
  }
  return *start_ns;
}

}  // namespace

RecordedTimeline ReadTimeline(const std::filesystem::path& file, const std::stop_token& stop) {
  const std::filesystem::path beside = recording::BesideRecording("", file, "scene.fulcrum");
  const std::optional<scene::SceneFile> scene = beside.empty() ? std::nullopt : std::optional<scene::SceneFile>(beside);
  Timeline timeline(StartOf(file), scene ? &scene->view() : nullptr);
  log_tools::Recording recording(file,
                                 {.topics = {"ToolState", "ContactModel", "HandleState", "ThermalEvent", "ClipState"}});
  std::map<TopicId, bus::InputAccount> accounts;  // Skips the samples of a process that has been replaced.
  log_tools::Entry entry;
  while (!stop.stop_requested() && recording.Next(&entry)) {
    bus::InputAccount& account = accounts.try_emplace(*entry.source->topic, false, true).first->second;
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (requires { timeline.Add(message); }) {
        if (bus::PassesGate(message) && account.IsOfOwner(bus::StampOf(message))) timeline.Add(message);
      }
    });
  }
  return {timeline.happenings(), timeline.left_out()};
}

}  // namespace fulcrum::assessment
