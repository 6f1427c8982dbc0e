#include "services/session/supervisor/domain_guard.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {
namespace {

/// Fills in the address of the domain's abstract socket and returns its length [bytes].
socklen_t AddressOf(int domain, sockaddr_un* address) {
  const std::string name = "fulcrum-" + std::to_string(::getuid()) + "-" + std::to_string(domain);
  address->sun_family = AF_UNIX;
  std::memcpy(address->sun_path + 1, name.data(), name.size());  // The leading zero byte makes the name abstract.
  return static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
}

using Call = int (*)(int, const sockaddr*, socklen_t);

/// Socket on which `call` with the address of the domain succeeded, or -1 with errno set.
int SocketWith(Call call, int domain) {
  sockaddr_un address{};
  const socklen_t length = AddressOf(domain, &address);
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd >= 0 && call(fd, reinterpret_cast<const sockaddr*>(&address), length) != 0) {
    const int error = errno;
    ::close(fd);
    errno = error;
    return -1;
  }
  return fd;
}

}  // namespace

DomainGuard::DomainGuard(int domain) : socket_(SocketWith(::bind, domain)) {
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
  // connect() instead of bind(): a query that held the name, however briefly, would block a session that starts then.
  const int fd = SocketWith(::connect, domain);
  if (fd >= 0) {
    ::close(fd);
  }
  return fd >= 0;
}

}  // namespace fulcrum::supervisor
