#include "tests/system/install/notify_socket.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>

namespace fulcrum::testing {

NotifySocket::NotifySocket(const std::filesystem::path& path)
    : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().size() >= sizeof(address.sun_path)) throw std::runtime_error(path.string() + ": too long");
  std::memcpy(address.sun_path, path.c_str(), path.native().size());
  if (fd_ < 0 || ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    throw std::runtime_error(path.string() + ": no socket here");
  }
}

NotifySocket::~NotifySocket() { ::close(fd_); }

const std::string& NotifySocket::Heard() {
  std::array<char, 4096> text;
  for (ssize_t n = 0; (n = ::recv(fd_, text.data(), text.size(), 0)) > 0;) {
    heard_.append(text.data(), static_cast<std::size_t>(n)).append("\n");
  }
  return heard_;
}

bool NotifySocket::HasHeard(const std::string& beginning) {
  return Heard().find("\n" + beginning) != std::string::npos;
}

}  // namespace fulcrum::testing
