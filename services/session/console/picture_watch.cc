#include "services/session/console/picture_watch.h"

#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <utility>

#include "services/session/console/form.h"
#include "services/session/supervisor/picture.h"

namespace fulcrum::console {

PictureWatch::PictureWatch(const std::filesystem::path& frames)
    : frames_(frames), notify_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
  // Pictures are written under another name and then renamed, so a reported picture is complete.
  if (notify_ >= 0) ::inotify_add_watch(notify_, frames.c_str(), IN_MOVED_TO | IN_ONLYDIR);
  if (const auto all = supervisor::FindFrames(frames); !all.empty()) newest_ = all.back().file.filename();
}

PictureWatch::~PictureWatch() {
  if (notify_ >= 0) ::close(notify_);
}

PictureWatch::PictureWatch(PictureWatch&& other) noexcept
    : frames_(std::move(other.frames_)), notify_(std::exchange(other.notify_, -1)), newest_(std::move(other.newest_)) {}

PictureWatch& PictureWatch::operator=(PictureWatch&& other) noexcept {
  std::swap(frames_, other.frames_);
  std::swap(notify_, other.notify_);
  std::swap(newest_, other.newest_);
  return *this;
}

const std::string& PictureWatch::Newest() {
  alignas(inotify_event) std::array<char, 4096> events;
  for (ssize_t size = 0; notify_ >= 0 && (size = ::read(notify_, events.data(), events.size())) > 0;) {
    for (ssize_t at = 0; at < size;) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof(event));
      const char* const name = events.data() + at + sizeof(event);
      if (event.len > 0 && IsPictureName(name)) newest_ = name;
      at += static_cast<ssize_t>(sizeof(event) + event.len);
    }
  }
  return newest_;
}

std::filesystem::path PictureWatch::FileOf(const std::string& name) const {
  return frames_.empty() || !IsPictureName(name) ? std::filesystem::path() : frames_ / name;
}

}  // namespace fulcrum::console
