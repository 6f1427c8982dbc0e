#include "services/transport/bus/dds/socket_buffers.h"

#include <sys/socket.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "services/transport/bus/dds/participant.h"

namespace fulcrum::bus::dds {
namespace {

/// Value of an integer option; -1: not a socket.
int OptionOf(int socket, int option) {
  int value = 0;
  socklen_t size = sizeof value;
  return ::getsockopt(socket, SOL_SOCKET, option, &value, &size) == 0 ? value : -1;
}

}  // namespace

void EnlargeReceiveBuffers() {
  constexpr int kWanted = static_cast<int>(kSocketBuffer_B);
  std::error_code error;
  // The library keeps its sockets to itself.
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    // The kernel reports twice the size, for its own overhead.
    const bool is_small = OptionOf(fd, SO_TYPE) == SOCK_DGRAM && OptionOf(fd, SO_DOMAIN) == AF_INET &&
                          OptionOf(fd, SO_RCVBUF) < 2 * kWanted;
    if (is_small) (void)::setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &kWanted, sizeof kWanted);
  }
}

}  // namespace fulcrum::bus::dds
