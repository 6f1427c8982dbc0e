#include "services/apps/replayer/video_file.h"

#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/file_descriptor.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

fs::path Ffmpeg() {
  fs::path program = runtime::FindInPath("ffmpeg");
  if (program.empty()) throw InputError("ffmpeg is not installed; it makes the video: apt install ffmpeg");
  return program;
}

/// A run of ffmpeg whose standard input is one end of a socket.
class Run {
 public:
  explicit Run(const Words& arguments) : said_(::memfd_create("ffmpeg", MFD_CLOEXEC)) {
    std::array<int, 2> pair{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
      throw InputError(std::string("no socket for ffmpeg: ") + ::strerror(errno));
    }
    input_ = runtime::FileDescriptor(pair[0]);
    const runtime::FileDescriptor theirs(pair[1]);
    Words words{"-nostdin", "-y", "-loglevel", "error", "-xerror"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    process_ = runtime::ChildProcess::StartOn(Ffmpeg(), words, {.input = theirs.get(), .output = said_.get()});
  }

  /// Throws when ffmpeg has closed its input.
  void Write(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(input_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) Fail();
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
    }
  }
  /// Ends the input and waits for the end of ffmpeg. Throws when it has failed.
  void End() {
    input_.Close();
    std::optional<runtime::ProcessEnd> end;
    while (!(end = process_.Poll())) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    // It may report that it could not write the end of a file and still return 0.
    if (end->signal != 0 || end->exit_code != 0 || ::lseek(said_.get(), 0, SEEK_END) > 0) Fail();
  }

 private:
  [[noreturn]] void Fail() const {
    std::array<char, 300> words{};
    const ssize_t got = ::pread(said_.get(), words.data(), words.size(), 0);
    std::string text(words.data(), static_cast<std::size_t>(std::max<ssize_t>(0, got)));
    std::replace(text.begin(), text.end(), '\n', ' ');
    throw std::runtime_error("ffmpeg has failed: " + (text.empty() ? std::string("it gives no reason") : text));
  }

  runtime::FileDescriptor input_, said_;
  runtime::ChildProcess process_;
};

/// A value in ffmpeg's file of metadata.
std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (std::string_view("=;#\\\n").find(c) != std::string_view::npos) escaped += '\\';
    escaped += c;
  }
  return escaped;
}

void WriteMetadata(const fs::path& file, const std::string& title, std::span<const Chapter> chapters, double end_s) {
  const auto ms = [](double time_s) { return std::llround(1e3 * time_s); };
  std::ofstream out(file);
  out << ";FFMETADATA1\ntitle=" << Escaped(title) << '\n';
  for (std::size_t i = 0; i < chapters.size(); ++i) {
    const double next_s = i + 1 < chapters.size() ? chapters[i + 1].begin_s : end_s;
    out << "[CHAPTER]\nTIMEBASE=1/1000\nSTART=" << ms(chapters[i].begin_s)
        << "\nEND=" << ms(std::max(next_s, chapters[i].begin_s)) << "\ntitle=" << Escaped(chapters[i].title) << '\n';
  }
  if (!out.flush()) throw InputError("cannot write " + file.string());
}

/// A picture's bottom row comes first; the size becomes VideoSize(). Colours as in television of high definition,
/// because a player takes them for that.
Words Encoding(int width, int height, int rate_Hz, int group, const fs::path& file) {
  return {"-f",
          "rawvideo",
          "-pix_fmt",
          "rgb24",
          "-s",
          std::to_string(width) + "x" + std::to_string(height),
          "-r",
          std::to_string(rate_Hz),
          "-i",
          "pipe:0",
          "-vf",
          "vflip,pad=" + std::to_string(VideoSize(width)) + ":" + std::to_string(VideoSize(height)) +
              ",scale=out_color_matrix=bt709:out_range=tv",
          "-colorspace",
          "bt709",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "bt709",
          "-color_range",
          "tv",
          "-c:v",
          "libx264",
          "-preset",
          "veryfast",
          "-crf",
          "23",
          "-pix_fmt",
          "yuv420p",
          "-g",
          std::to_string(group > 0 ? group : 2 * rate_Hz),  // A player finds a place within two seconds.
          "-f",
          "mp4",
          file.string()};
}

}  // namespace

struct VideoFile::Impl {
  /// Files on the way to the video, removed with this object.
  struct Parts {
    explicit Parts(const fs::path& video)
        : pictures(video.string() + ".pictures"),
          metadata(video.string() + ".chapters"),
          complete(video.string() + ".part") {
      if (!std::ofstream(pictures)) {
        throw InputError("cannot write " + pictures.string() + ": " + ::strerror(errno) +
                         "; name a folder that can be written");
      }
    }
    ~Parts() {
      std::error_code ignored;
      for (const fs::path& part : {pictures, metadata, complete}) fs::remove(part, ignored);
    }
    Parts(const Parts&) = delete;
    Parts& operator=(const Parts&) = delete;

    const fs::path pictures, metadata, complete;
  };

  Impl(fs::path to, int width, int height, int rate_Hz, int group)
      : file(std::move(to)), parts(file), encoder(Encoding(width, height, rate_Hz, group, parts.pictures)) {}

  const fs::path file;
  const Parts parts;
  Run encoder;
};

VideoFile::VideoFile(fs::path file, int width, int height, int rate_Hz, int group)
    : impl_(std::make_unique<Impl>(std::move(file), width, height, rate_Hz, group)) {}

VideoFile::~VideoFile() = default;

void VideoFile::Add(const render::Bitmap& picture) { impl_->encoder.Write(picture.rgb); }

void VideoFile::Finish(const std::string& title, std::span<const Chapter> chapters, double end_s) {
  Impl& video = *impl_;
  video.encoder.End();
  WriteMetadata(video.parts.metadata, title, chapters, end_s);
  // The index first, so that a player can begin before it has the whole file.
  Run({"-i", video.parts.pictures.string(), "-f", "ffmetadata", "-i", video.parts.metadata.string(), "-map", "0",
       "-map_metadata", "1", "-map_chapters", "1", "-c", "copy", "-movflags", "+faststart", "-f", "mp4",
       video.parts.complete.string()})
      .End();
  fs::rename(video.parts.complete, video.file);
}

}  // namespace fulcrum::replay
