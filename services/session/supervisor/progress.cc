#include "services/session/supervisor/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>

namespace fulcrum::supervisor {
namespace {

constexpr std::int64_t kLivePeriod = 200'000'000;
constexpr std::int64_t kPlainPeriod = 2'000'000'000;

std::size_t Columns() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

Progress::Progress(bool quiet) : quiet_(quiet), live_(::isatty(STDOUT_FILENO) == 1) {}

bool Progress::IsDue(std::int64_t now_ns) const {
  return last_ns_ == 0 || now_ns - last_ns_ >= (live_ ? kLivePeriod : kPlainPeriod);
}

void Progress::Show(std::int64_t now_ns, const std::string& line) {
  last_ns_ = now_ns;
  if (quiet_) return;
  if (!live_) {
    Say(line);
    return;
  }
  ClearLive();
  std::fputs(CutToColumns(line, Columns() - 1).c_str(), stdout);
  std::fflush(stdout);
  open_ = true;
}

void Progress::Say(const std::string& line) {
  ClearLive();
  std::fputs((line + "\n").c_str(), stdout);
  std::fflush(stdout);
}

void Progress::ClearLive() {
  if (open_) {
    std::fputs("\r\x1b[K", stdout);
    open_ = false;
  }
}

std::string CutToColumns(const std::string& text, std::size_t columns) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool starts_character = (static_cast<unsigned char>(text[i]) & 0xc0u) != 0x80u;
    if (starts_character && ++seen > columns) {
      return text.substr(0, i);
    }
  }
  return text;
}

}  // namespace fulcrum::supervisor
