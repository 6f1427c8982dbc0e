#include "services/session/supervisor/clip.h"

#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "services/base/core/error.h"
#include "services/session/supervisor/child_process.h"
#include "services/session/supervisor/picture.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kLongest{60};

fs::path FindProgram(const std::string& name) {
  const char* folders = std::getenv("PATH");
  std::istringstream list(folders ? folders : "");
  for (std::string folder; std::getline(list, folder, ':');) {
    fs::path program = fs::path(folder) / name;
    if (!folder.empty() && access(program.c_str(), X_OK) == 0 && !fs::is_directory(program)) {
      return program;
    }
  }
  return {};
}

/// List of the pictures with the time for which each is shown, in the format of ffmpeg's concat demuxer.
void WriteList(const std::vector<Frame>& frames, const fs::path& file) {
  std::ofstream list(file);
  list << "ffconcat version 1.0\n";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double next_s = i + 1 < frames.size() ? frames[i + 1].time_s : frames[i].time_s + 0.1;
    list << "file '" << fs::absolute(frames[i].file).string() << "'\nduration " << next_s - frames[i].time_s << '\n';
  }
}

std::optional<ProcessEnd> Await(ChildProcess* child) {
  const auto until = std::chrono::steady_clock::now() + kLongest;
  while (std::chrono::steady_clock::now() < until) {
    if (const std::optional<ProcessEnd> end = child->Poll()) {
      return end;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return std::nullopt;
}

}  // namespace

bool MakeClip(const fs::path& frames, const fs::path& clip, const fs::path& log) {
  const fs::path program = FindProgram("ffmpeg");
  const std::vector<Frame> all = FindFrames(frames);
  if (program.empty() || all.size() < 2) {
    return false;
  }
  const fs::path list = clip.string() + ".frames";
  WriteList(all, list);
  std::error_code ignored;
  bool made = false;
  try {
    ChildProcess child = ChildProcess::Start(
        program, {"-nostdin", "-y",      "-loglevel", "error",       "-f",         "concat",
                  "-safe",    "0",       "-i",        list.string(), "-vf",        "fps=20,scale=640:-2",
                  "-c:v",     "libx264", "-preset",   "veryfast",    "-crf",       "27",
                  "-pix_fmt", "yuv420p", "-movflags", "+faststart",  clip.string()},
        log);
    const std::optional<ProcessEnd> end = Await(&child);
    made = end && end->signal == 0 && end->exit_code == 0 && fs::file_size(clip, ignored) > 0 && !ignored;
  } catch (const InputError&) {
    made = false;
  }
  fs::remove(list, ignored);
  if (!made) {
    fs::remove(clip, ignored);
  }
  return made;
}

}  // namespace fulcrum::supervisor
