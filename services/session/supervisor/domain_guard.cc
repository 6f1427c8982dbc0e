#include "services/session/supervisor/domain_guard.h"

#include <pwd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {
namespace {

// Queries of `fulcrum status` and the like between two turns of the supervisor.
constexpr int kBacklog = 64;

/// Fills in the address of the domain's abstract socket and returns its length [bytes].
socklen_t AddressOf(int domain, sockaddr_un* address) {
  const std::string name = "fulcrum-" + std::to_string(domain);
  address->sun_family = AF_UNIX;
  std::memcpy(address->sun_path + 1, name.data(), name.size());  // The leading zero byte makes the name abstract.
  return static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
}

using Call = int (*)(int, const sockaddr*, socklen_t);

/// Socket on which `call` with the address of the domain succeeded, or -1 with errno set.
int SocketWith(Call call, int domain) {
  sockaddr_un address{};
  const socklen_t length = AddressOf(domain, &address);
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd >= 0 && call(fd, reinterpret_cast<const sockaddr*>(&address), length) != 0) {
    const int error = errno;
    ::close(fd);
    errno = error;
    return -1;
  }
  return fd;
}

std::string NameOfUser(uid_t uid) {
  const passwd* user = ::getpwuid(uid);
  return (user != nullptr ? std::string(user->pw_name) + ", " : std::string()) + "uid " + std::to_string(uid);
}

std::string HostName() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace

DomainGuard::DomainGuard(int domain) : socket_(SocketWith(::bind, domain)) {
  if (socket_ >= 0 && ::listen(socket_, kBacklog) == 0) return;
  const int error = errno;
  const std::string where = "domain " + std::to_string(domain);
  if (socket_ >= 0) ::close(socket_);
  if (error != EADDRINUSE) throw InputError(where + " cannot be reserved: " + std::strerror(error));
  const auto holder = Holder(domain);
  if (holder && holder->uid != ::geteuid()) {
    throw InputError("another user's session runs in " + where + " (" + NameOfUser(holder->uid) + ", pid " +
                     std::to_string(holder->pid) + ", host " + HostName() + "): take another one (--domain N)");
  }
  throw InputError("a session runs in " + where +
                   (holder ? " (pid " + std::to_string(holder->pid) + ")" : std::string()) +
                   "; end it (fulcrum down --domain " + std::to_string(domain) + ") or take another one (--domain N)");
}

DomainGuard::~DomainGuard() { ::close(socket_); }

// connect() instead of bind(): a query that held the name, however briefly, would block a session that starts then.
int DomainGuard::Connect(int domain) { return SocketWith(::connect, domain); }

std::optional<control::Caller> DomainGuard::Holder(int domain) {
  const int fd = Connect(domain);
  if (fd < 0) return std::nullopt;
  control::Caller holder = control::CallerAt(fd);
  ::close(fd);
  return holder;
}

bool DomainGuard::IsTaken(int domain) {
  const int fd = Connect(domain);
  if (fd < 0) return errno == EAGAIN;
  ::close(fd);
  return true;
}

bool DomainGuard::IsHeld(int domain) {
  const auto holder = Holder(domain);
  return holder ? holder->uid == ::geteuid() : IsTaken(domain);
}

std::string DomainGuard::OtherUsers(int domain) {
  const auto holder = Holder(domain);
  if (!holder || holder->uid == ::geteuid()) return {};
  const passwd* user = ::getpwuid(holder->uid);
  const std::string name = user != nullptr ? user->pw_name : "#" + std::to_string(holder->uid);
  return "another user's session runs in domain " + std::to_string(domain) + " (" + NameOfUser(holder->uid) + ", pid " +
         std::to_string(holder->pid) + "): sudo -u " + (user != nullptr ? name : "'" + name + "'") +
         " fulcrum status --domain " + std::to_string(domain);
}

}  // namespace fulcrum::supervisor
