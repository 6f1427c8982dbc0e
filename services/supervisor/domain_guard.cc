#include "services/supervisor/domain_guard.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>

#include "services/core/error.h"

namespace fulcrum::supervisor {
namespace {

/// Socket bound to the domain's name, or -1 with errno set.
int Bind(int domain) {
  const std::string name = "fulcrum-" + std::to_string(::getuid()) + "-" + std::to_string(domain);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path + 1, name.data(), name.size());  // A leading zero byte: abstract.
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd >= 0 && ::bind(fd, reinterpret_cast<const sockaddr*>(&address), length) != 0) {
    const int error = errno;
    ::close(fd);
    errno = error;
    return -1;
  }
  return fd;
}

}  // namespace

DomainGuard::DomainGuard(int domain) : socket_(Bind(domain)) {
  if (socket_ < 0 && errno == EADDRINUSE) {
    throw InputError("a session runs in domain " + std::to_string(domain) + "; end it (fulcrum down --domain " +
                     std::to_string(domain) + ") or take another one (--domain N)");
  }
  if (socket_ < 0) {
    throw InputError("domain " + std::to_string(domain) + " cannot be reserved: " + ::strerror(errno));
  }
}

DomainGuard::~DomainGuard() { ::close(socket_); }

bool DomainGuard::IsHeld(int domain) {
  const int fd = Bind(domain);
  if (fd < 0) {
    return errno == EADDRINUSE;
  }
  ::close(fd);
  return false;
}

}  // namespace fulcrum::supervisor
