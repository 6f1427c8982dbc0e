#include "tests/support/siege.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

namespace fulcrum::testing {
namespace {

/// Begins to connect; -1: the system refused.
int Connect(int port, const std::string& from) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return -1;
  const int on = 1;
  ::setsockopt(socket, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &on, sizeof(on));
  // A reset instead of TIME_WAIT at the end; otherwise the ports of an address are used up after seconds.
  const linger reset{1, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &reset, sizeof(reset));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ::inet_pton(AF_INET, from.c_str(), &address.sin_addr);
  ::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  return socket;
}

}  // namespace

Siege::Siege(int port, Attack attack) {
  // A thousand sockets are more than the usual soft limit of descriptors permits.
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 4096);
  ::setrlimit(RLIMIT_NOFILE, &limit);
  thread_ = std::thread([this, port, attack = std::move(attack)] { Run(port, attack); });
}

Siege::~Siege() {
  stop_ = true;
  thread_.join();
}

void Siege::Run(int port, const Attack& attack) {
  std::vector<pollfd> sockets(attack.connections, pollfd{-1, POLLIN, 0});
  std::size_t next = 0;
  while (!stop_) {
    for (pollfd& one : sockets) {
      if (one.fd >= 0 && one.revents != 0) {
        std::array<char, 4096> ignored;
        // Data from the server is read and dropped; its end, or an error, ends the connection.
        if (::recv(one.fd, ignored.data(), ignored.size(), MSG_DONTWAIT) > 0) continue;
        ::close(one.fd);
        one.fd = -1;
      }
      if (one.fd < 0 && !stop_) {
        one = {Connect(port, attack.from[next++ % attack.from.size()]), POLLIN, 0};
        if (one.fd < 0) continue;
        if (!attack.said.empty()) ::send(one.fd, attack.said.data(), attack.said.size(), MSG_NOSIGNAL);
        ++made_;
      }
    }
    ::poll(sockets.data(), sockets.size(), 50);
  }
  for (const pollfd& one : sockets) {
    if (one.fd >= 0) ::close(one.fd);
  }
}

std::size_t OpenDescriptors(int pid) {
  const std::filesystem::path folder = "/proc/" + std::to_string(pid) + "/fd";
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace fulcrum::testing
