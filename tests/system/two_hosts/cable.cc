// A cable between two interfaces of this network namespace: passes each Ethernet frame on after a delay, and loses
// some.
//
//   two_hosts_cable INTERFACE INTERFACE DELAY_MS LOSS_PERCENT WORD
//
// Prints one line when a frame contains WORD in the clear.
// Used instead of tc's netem, which not every kernel has.
#include <arpa/inet.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <random>
#include <string_view>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

int OpenEnd(const char* interface) {
  const int fd = socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, htons(ETH_P_ALL));
  const int on = 1, buffer_B = 8 << 20;
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(ETH_P_ALL);
  address.sll_ifindex = static_cast<int>(if_nametoindex(interface));
  // The header of each frame marks a missing checksum: virtual interfaces do not compute it.
  if (fd < 0 || setsockopt(fd, SOL_PACKET, PACKET_VNET_HDR, &on, sizeof on) != 0 ||
      setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &buffer_B, sizeof buffer_B) != 0 ||
      bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    std::perror(interface);
    std::exit(1);
  }
  return fd;
}

struct Waiting {
  Clock::time_point due;
  int to;
  std::vector<char> frame;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fputs("usage: two_hosts_cable INTERFACE INTERFACE DELAY_MS LOSS_PERCENT WORD\n", stderr);
    return 2;
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::array<int, 2> ends{OpenEnd(argv[1]), OpenEnd(argv[2])};
  const auto delay = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double, std::milli>(std::strtod(argv[3], nullptr)));
  std::mt19937 random(1);
  std::bernoulli_distribution lost(std::strtod(argv[4], nullptr) / 100);
  const std::string_view word = argv[5];
  bool overheard = false;
  std::deque<Waiting> wire;  // In order: all frames have the same delay.
  std::array<char, 70'000> buffer{};
  for (;;) {
    const auto now = Clock::now();
    while (!wire.empty() && wire.front().due <= now) {
      // Writing to an interface that is down has no effect: the cable is cut.
      (void)!write(wire.front().to, wire.front().frame.data(), wire.front().frame.size());
      wire.pop_front();
    }
    timespec rest{1, 0};
    if (!wire.empty()) {
      const auto ns = std::chrono::nanoseconds(wire.front().due - Clock::now()).count();
      rest = {0, ns > 0 ? ns : 0};
    }
    std::array<pollfd, 2> polled{{{ends[0], POLLIN, 0}, {ends[1], POLLIN, 0}}};
    if (ppoll(polled.data(), polled.size(), &rest, nullptr) < 0 && errno != EINTR) return 1;
    for (std::size_t from = 0; from < ends.size(); ++from) {
      for (;;) {
        sockaddr_ll sender{};
        socklen_t length = sizeof sender;
        const ssize_t size =
            recvfrom(ends[from], buffer.data(), buffer.size(), 0, reinterpret_cast<sockaddr*>(&sender), &length);
        if (size <= 0) {
          if (size < 0 && errno == ENETDOWN) continue;
          break;
        }
        if (sender.sll_pkttype == PACKET_OUTGOING || lost(random)) continue;
        const std::string_view frame(buffer.data(), static_cast<std::size_t>(size));
        if (!overheard && frame.find(word) != std::string_view::npos) {
          overheard = true;
          std::puts("overheard");
          std::fflush(stdout);
        }
        wire.push_back({Clock::now() + delay, ends[1 - from], {buffer.data(), buffer.data() + size}});
      }
    }
  }
}
