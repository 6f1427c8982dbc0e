#include "services/apps/replayer/film.h"

#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <istream>
#include <mutex>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "services/apps/replayer/render_replay.h"
#include "services/apps/replayer/session_facts.h"
#include "services/base/core/error.h"

namespace fulcrum::replay {
namespace {

/// Longest time between two steps of the renderer: its effects follow the instruments, and its inputs keep few samples.
constexpr double kStep_s = 1.0 / 30;
constexpr int kNice = 10;
constexpr std::chrono::seconds kPatience{5};

/// Takes the drawn pictures. Written by the thread that compresses.
class Screen final : public bus::LoanOutput<Picture> {
 public:
  bool WriteInPlace(const Fill& fill) noexcept override {
    const std::lock_guard lock(mutex_);
    fill({header_, jpeg_});
    full_ = true;
    came_.notify_one();
    return true;
  }
  bool Write(const Picture& picture) noexcept override {
    return WriteInPlace([&](Picture::View view) {
      view.header = picture.header;
      std::ranges::copy(picture.jpeg, view.jpeg.begin());
    });
  }
  [[nodiscard]] bool has_readers() const noexcept override { return wanted_; }
  [[nodiscard]] bus::OutputStats stats() const override { return {}; }

  /// Whether steps draw. From the thread of the steps.
  void Want(bool wanted) {
    const std::lock_guard lock(mutex_);
    wanted_ = wanted;
    full_ = false;
  }
  /// Waits for the picture that the last step has drawn. Valid until the next call. Throws std::runtime_error when it
  /// does not come.
  [[nodiscard]] std::span<const std::uint8_t> Take() {
    std::unique_lock lock(mutex_);
    if (!came_.wait_for(lock, kPatience, [this] { return full_; })) {
      throw std::runtime_error("the picture could not be compressed");
    }
    taken_.assign(jpeg_.begin(), jpeg_.begin() + header_.size);
    return taken_;
  }

 private:
  std::atomic<bool> wanted_{false};
  bool full_ = false;
  std::mutex mutex_;
  std::condition_variable came_;
  PictureHeader header_;
  std::vector<std::uint8_t> jpeg_ = std::vector<std::uint8_t>(kMaxPictureBytes), taken_;
};

double EndOf(const std::filesystem::path& recording, std::int64_t start_ns) {
  recording::McapReader reader(recording, recording::McapReader::Depth::kChunkHeads);
  for (recording::McapMessage none{}; reader.Next(&none);) {
  }
  return 1e-9 * static_cast<double>(static_cast<std::int64_t>(reader.last_ns()) - ClockOffset(reader) - start_ns);
}

double TimeIn(const std::string& line) {
  double time_s = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), time_s);
  if (error != std::errc() || end != line.data() + line.size() || !std::isfinite(time_s)) {
    throw InputError("film: \"" + line.substr(0, 40) + "\" is no session time in seconds, for example 12.5");
  }
  return time_s;
}

}  // namespace

struct Film::Impl {
  Impl(const std::filesystem::path& file, const SceneView& given) : recording(file), scene(given) {
    Begin();
    if (Read()) end_s = std::max(0.0, EndOf(recording, replay->session_start_ns()));
  }

  void Begin() {
    replay.reset();  // Two contexts of OpenGL at a time need twice the memory.
    render::RenderSettings settings;
    settings.quality = render::Quality::kHigh;  // A picture that stands still is looked at.
    replay.emplace(recording, scene, settings, &screen);
    shown_s = read_s = 0;
  }
  bool Read() {
    const std::optional<double> next_s = replay->Next();
    read_s = next_s.value_or(read_s);
    return next_s.has_value();
  }

  /// Hands over what was recorded up to a time, in steps that draw nothing.
  void ReadTo(double time_s) {
    double due_s = shown_s + kStep_s;
    while (read_s < time_s && Read()) {
      if (read_s < due_s || read_s >= time_s) continue;
      replay->Step(read_s);
      replay->node().FollowEffects();
      due_s = read_s + kStep_s;
    }
  }

  const std::filesystem::path recording;
  const SceneView& scene;
  Screen screen;
  std::optional<RenderReplay> replay;
  double end_s = 0;
  double shown_s = 0;  ///< Time of the last picture.
  double read_s = 0;   ///< Time of the newest message.
};

Film::Film(const std::filesystem::path& recording, const SceneView& scene)
    : impl_(std::make_unique<Impl>(recording, scene)) {}

Film::~Film() = default;

double Film::end_s() const { return impl_->end_s; }

std::span<const std::uint8_t> Film::At(double time_s) {
  Impl& film = *impl_;
  time_s = std::clamp(time_s, 0.0, film.end_s);
  if (time_s < film.shown_s) film.Begin();
  film.screen.Want(false);
  film.ReadTo(time_s);
  film.screen.Want(true);
  film.shown_s = time_s;
  render::RenderNode& node = film.replay->node();
  const std::uint64_t drawn = node.pictures_drawn();
  film.replay->Step(time_s);
  // Before the first tissue there is nothing to draw: the first picture is shown in its place.
  while (node.pictures_drawn() == 0 && film.Read()) film.replay->Step(std::max(time_s, film.read_s));
  return node.pictures_drawn() == drawn ? std::span<const std::uint8_t>() : film.screen.Take();
}

void ShowFilm(const std::filesystem::path& recording, const SceneView& scene, std::istream& in, std::ostream& out) {
  // A session that runs meanwhile goes first.
  (void)::setpriority(PRIO_PROCESS, 0, kNice);
  Film film(recording, scene);
  out << "end " << film.end_s() << '\n' << std::flush;
  for (std::string line; std::getline(in, line);) {
    const std::span<const std::uint8_t> jpeg = film.At(TimeIn(line));
    out << line << ' ' << jpeg.size() << '\n';
    out.write(reinterpret_cast<const char*>(jpeg.data()), static_cast<std::streamsize>(jpeg.size()));
    out.flush();
    if (!out) return;
  }
}

}  // namespace fulcrum::replay
