#include "services/session/supervisor/video.h"

#include <yaml-cpp/yaml.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/child_process.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

/// Time in which the video is to be drawn [s]; it says how many pictures a second that allows.
constexpr int kWithin_s = 60;
constexpr std::chrono::seconds kLongest{90};

/// What the last line of a log says behind "replayer: "; empty: it is another line.
std::string LastWords(const fs::path& log) {
  std::ifstream in(log);
  std::string last;
  for (std::string line; std::getline(in, line);) last = line;
  const std::string begin = "replayer: ";
  return last.starts_with(begin) ? last.substr(begin.size()) : std::string();
}

/// "0:12".
std::string MinutesAndSeconds(double time_s) {
  const int seconds = static_cast<int>(time_s);
  char text[32];
  std::snprintf(text, sizeof(text), "%d:%02d", seconds / 60, seconds % 60);
  return text;
}

/// "00:00:12.345".
std::string VttTime(double time_s) {
  const long ms = std::lround(1e3 * time_s);
  char text[48];
  std::snprintf(text, sizeof(text), "%02ld:%02ld:%02ld.%03ld", ms / 3'600'000, ms / 60'000 % 60, ms / 1000 % 60,
                ms % 1000);
  return text;
}

void ReadChapters(const fs::path& json, SessionVideo* video) {
  constexpr double kShown_s = 3;
  try {
    const YAML::Node root = YAML::LoadFile(json.string());  // JSON is YAML.
    video->subtitles = "WEBVTT\n";
    for (const YAML::Node& chapter : root["chapters"]) {
      const auto begin_s = chapter["begin_s"].as<double>();
      const auto title = chapter["title"].as<std::string>();
      video->chapters.push_back(MinutesAndSeconds(begin_s) + " " + title);
      if (begin_s > 0) {
        video->subtitles += "\n" + VttTime(begin_s) + " --> " + VttTime(begin_s + kShown_s) + "\n" + title + "\n";
      }
    }
  } catch (const YAML::Exception&) {
    *video = {.file = video->file};  // The video without its chapters.
  }
}

std::optional<runtime::ProcessEnd> Await(runtime::ChildProcess* child, const std::function<bool()>& goes_on) {
  const auto until = std::chrono::steady_clock::now() + kLongest;
  while (std::chrono::steady_clock::now() < until && goes_on()) {
    if (const std::optional<runtime::ProcessEnd> end = child->Poll()) return end;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return std::nullopt;
}

/// Removes what a killed replayer has left: files beside the video whose names begin with its name.
void RemoveParts(const fs::path& video) {
  std::error_code ignored;
  std::vector<fs::path> parts;
  for (const auto& entry : fs::directory_iterator(video.parent_path(), ignored)) {
    if (entry.path().filename().string().starts_with(video.filename().string() + ".")) parts.push_back(entry.path());
  }
  for (const fs::path& part : parts) fs::remove(part, ignored);
}

}  // namespace

SessionVideo MakeVideo(const VideoOrder& order, const std::function<bool()>& goes_on) {
  const fs::path json = fs::path(order.log).replace_extension(".json");
  try {
    runtime::ChildProcess child = runtime::ChildProcess::Start(
        order.replayer,
        {order.recording.string(), "--video", order.video.string(), "--scene", order.scene.string(), "--within",
         std::to_string(kWithin_s), "--json", json.string()},
        order.log);
    bool left_out = false;
    const std::optional<runtime::ProcessEnd> end = Await(&child, [&] { return !(left_out = !goes_on()); });
    if (!end) {
      child = {};  // Killed.
      RemoveParts(order.video);
      return {.missing = left_out ? "it was left out" : "it was not ready in time"};
    }
    if (end->signal != 0 || end->exit_code != 0) {
      RemoveParts(order.video);
      const std::string words = LastWords(order.log);
      return {.missing = words.empty() ? "replayer " + end->Describe() : words};
    }
  } catch (const InputError& error) {
    return {.missing = error.what()};
  }
  SessionVideo video{.file = order.video};
  ReadChapters(json, &video);
  return video;
}

}  // namespace fulcrum::supervisor
