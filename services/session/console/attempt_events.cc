#include "services/session/console/attempt_events.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "services/session/assessment/recorded_timeline.h"
#include "services/session/console/json.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

constexpr int kNice = 10;  // A running session goes first.

std::string Nothing(const std::string& why) {
  return Json('{').Flag("ready", true).Text("why", why).Raw("events", "[]").Raw("left_out", "0").Done();
}

std::string Read(const fs::path& folder, const std::stop_token& stop) {
  // Linux applies it to the calling thread only. Without it the result is the same.
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  const fs::path file = folder / "recording.mcap";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return Nothing("The session was not recorded, so its events are not known.");
  try {
    const assessment::RecordedTimeline timeline = assessment::ReadTimeline(file, stop);
    Json events('[');
    for (const assessment::Happening& one : timeline.happenings) {
      Json json('{');
      json.Number("t", one.time_s, 0.01).Number("until", one.until_s, 0.01).Text("kind", assessment::KeyOf(one));
      events.Item(json.Text("text", assessment::TextOf(one)).Done());
    }
    return Json('{')
        .Flag("ready", true)
        .Text("why", "")
        .Raw("events", events.Done())
        .Raw("left_out", std::to_string(timeline.left_out))
        .Done();
  } catch (const std::exception& trouble) {
    return Nothing(trouble.what());
  }
}

bool IsDone(const std::shared_future<std::string>& json) {
  return json.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

AttemptEvents::~AttemptEvents() { stop_.request_stop(); }

std::string AttemptEvents::JsonOf(const fs::path& folder) {
  const auto known = std::ranges::find(readings_, folder, &Reading::folder);
  if (known != readings_.end()) {
    readings_.splice(readings_.begin(), readings_, known);
  } else if (std::ranges::count_if(readings_, [](const Reading& one) { return !IsDone(one.json); }) < kMostReading) {
    readings_.push_front({folder, std::async(std::launch::async, Read, folder, stop_.get_token()).share()});
    // The end of one that still reads would have to be waited for.
    if (readings_.size() > kMostKept && IsDone(readings_.back().json)) readings_.pop_back();
  } else {
    return R"({"ready":false})";
  }
  const std::shared_future<std::string>& json = readings_.front().json;
  return IsDone(json) ? json.get() : R"({"ready":false})";
}

}  // namespace fulcrum::console
