#include "services/session/console/attempt_films.h"

#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/file_descriptor.h"
#include "services/session/console/json.h"
#include "services/session/console/screen_text.h"

namespace fulcrum::console {
namespace {

namespace fs = std::filesystem;

constexpr double kLongest_s = 1e6;
/// Above the largest picture (kMaxPictureBytes).
constexpr std::size_t kMostBytes = std::size_t{1} << 22;
constexpr std::size_t kLongestLine = 100;

/// Reads lines and bytes of a stream to its end.
class Reader {
 public:
  explicit Reader(int from) : from_(from) {}
  [[nodiscard]] std::optional<std::string> Line() {
    std::size_t end;
    while ((end = held_.find('\n')) == std::string::npos) {
      if (held_.size() > kLongestLine || !More()) return {};
    }
    std::string line = held_.substr(0, end);
    held_.erase(0, end + 1);
    return line;
  }
  [[nodiscard]] std::optional<std::string> Bytes(std::size_t count) {
    while (held_.size() < count) {
      if (!More()) return {};
    }
    std::string bytes = held_.substr(0, count);
    held_.erase(0, count);
    return bytes;
  }

 private:
  bool More() {
    std::array<char, 1 << 16> bytes;
    ssize_t got;
    do {
      got = ::read(from_, bytes.data(), bytes.size());
    } while (got < 0 && errno == EINTR);
    if (got <= 0) return false;
    held_.append(bytes.data(), static_cast<std::size_t>(got));
    return true;
  }

  int from_;
  std::string held_;
};

/// The reason that a program has printed last as "replayer: reason"; empty: none.
std::string Reason(int log) {
  constexpr std::string_view kBegin = "replayer: ";
  std::array<char, 8192> bytes{};
  const off_t size = ::lseek(log, 0, SEEK_END);
  const ssize_t got = ::pread(log, bytes.data(), bytes.size(), std::max<off_t>(0, size - off_t{bytes.size()}));
  const std::string text(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(0, got)));
  const std::size_t at = text.rfind(kBegin);
  if (at == std::string::npos) return {};
  const std::size_t begin = at + kBegin.size();
  return ValidUtf8(text.substr(begin, text.find('\n', begin) - begin));
}

/// Size of the picture that follows the line "TIME BYTES"; 0 for other lines.
std::size_t BytesAfter(std::string_view line) {
  const std::size_t space = line.find(' ');
  std::size_t bytes = 0;
  if (space == std::string_view::npos || line.starts_with("end ")) return 0;
  std::from_chars(line.data() + space + 1, line.data() + line.size(), bytes);
  return bytes;
}

std::string Trouble(const std::string& why) { return Json('{').Text("trouble", why).Done(); }

}  // namespace

/// A process that draws a recording, and the thread that waits for its pictures.
class AttemptFilms::Projector {
 public:
  using Take = std::function<void(std::string line, std::shared_ptr<const std::string> jpeg)>;

  /// `take` is called from another thread; with an empty line at the end.
  Projector(std::uint64_t number, const fs::path& replayer, const fs::path& recording, Take take) : number_(number) {
    std::array<int, 2> pair{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
      throw InputError(std::string("no socket for the film: ") + ::strerror(errno));
    }
    ours_ = runtime::FileDescriptor(pair[0]);
    const runtime::FileDescriptor theirs(pair[1]);
    log_ = runtime::FileDescriptor(::memfd_create("film", MFD_CLOEXEC));
    if (log_.get() < 0) throw InputError(std::string("no memory for the film's messages: ") + ::strerror(errno));
    process_ = runtime::ChildProcess::StartOn(replayer, {recording.string(), "--film"},
                                              {.input = theirs.get(), .output = theirs.get(), .error = log_.get()});
    thread_ = std::jthread([from = ours_.get(), take = std::move(take)] { Forward(from, take); });
  }
  ~Projector() {
    process_ = {};  // Killed: the thread reads to the end.
    ::shutdown(ours_.get(), SHUT_RDWR);
  }
  Projector(const Projector&) = delete;
  Projector& operator=(const Projector&) = delete;

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] std::string reason() const { return Reason(log_.get()); }
  void Ask(double time_s) {
    const std::string line = std::to_string(time_s) + "\n";
    (void)::send(ours_.get(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

 private:
  static void Forward(int from, const Take& take) {
    Reader reader(from);
    while (std::optional<std::string> line = reader.Line()) {
      const std::size_t bytes = BytesAfter(*line);
      std::optional<std::string> jpeg = bytes > kMostBytes ? std::nullopt : reader.Bytes(bytes);
      if (!jpeg) break;
      take(*std::move(line), bytes == 0 ? nullptr : std::make_shared<const std::string>(*std::move(jpeg)));
    }
    take({}, nullptr);
  }

  const std::uint64_t number_;
  runtime::FileDescriptor ours_, log_;
  runtime::ChildProcess process_;
  std::jthread thread_;
};

AttemptFilms::AttemptFilms(fs::path replayer, FolderOf folder_of, Post post)
    : replayer_(std::move(replayer)), folder_of_(std::move(folder_of)), post_(std::move(post)) {}

AttemptFilms::~AttemptFilms() = default;

void AttemptFilms::End() { films_.clear(); }

void AttemptFilms::Stop(const std::string& why) {
  for (auto& [page, film] : films_) {
    if (film) page->SendText(Trouble(why));
    film.reset();
  }
}

void AttemptFilms::Open(Socket* page) { films_[page]; }

void AttemptFilms::Close(Socket* page) { films_.erase(page); }

void AttemptFilms::Receive(Socket* page, std::string_view text) {
  const auto film = films_.find(page);
  const std::optional<Form> form = ParseForm(text);
  if (film == films_.end() || !form) return;
  if (const auto session = form->find("session"); session != form->end() && !film->second) {
    try {
      Begin(page, session->second);
    } catch (const std::exception& why) {
      page->SendText(Trouble(why.what()));
    }
  }
  const auto time = form->find("t");
  const auto time_s = time == form->end() ? std::nullopt : ParseNumber(time->second, 0, kLongest_s);
  if (time_s && film->second) film->second->Ask(*time_s);
}

void AttemptFilms::Begin(Socket* page, const std::string& session) {
  const fs::path folder = folder_of_(session);
  if (folder.empty()) throw InputError("no attempt \"" + session + "\" of yours");
  const fs::path recording = folder / "recording.mcap";
  std::error_code error;
  if (!fs::is_regular_file(recording, error))
    throw InputError("The session was not recorded, or its recording is gone.");
  if (std::ranges::count_if(films_, [](const auto& film) { return film.second != nullptr; }) >= std::ptrdiff_t{kMost}) {
    throw InputError("Other pages show attempts; close one of them.");
  }
  const std::uint64_t number = ++begun_;
  films_[page] = std::make_unique<Projector>(
      number, replayer_, recording, [this, number](std::string line, std::shared_ptr<const std::string> jpeg) {
        post_([this, number, line = std::move(line), jpeg = std::move(jpeg)] { Show(number, line, jpeg); });
      });
}

void AttemptFilms::Show(std::uint64_t number, const std::string& line, const std::shared_ptr<const std::string>& jpeg) {
  // The page may have gone meanwhile.
  const auto film =
      std::ranges::find_if(films_, [number](const auto& one) { return one.second && one.second->number() == number; });
  if (film == films_.end()) return;
  Socket* const page = film->first;
  if (line.empty()) {
    const std::string reason = film->second->reason();
    film->second.reset();
    return page->SendText(Trouble(reason.empty() ? "The recording could not be drawn." : reason));
  }
  if (jpeg) (void)page->SendBytes(jpeg);
  const bool first = line.starts_with("end ");
  const std::optional<double> time_s =
      ParseNumber(std::string_view(line).substr(first ? 4 : 0, first ? line.npos : line.find(' ')), 0, kLongest_s);
  page->SendText(Json('{').Number(first ? "end" : "t", time_s.value_or(0), 1e-3).Done());
}

}  // namespace fulcrum::console
