#include "tests/support/datagram_flood.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

namespace fulcrum::testing {
namespace {

using Bytes = std::vector<std::uint8_t>;

class Maker {
 public:
  explicit Maker(std::uint32_t seed) : random_(seed) {}

  Bytes Next() {
    switch (Below(3)) {
      case 0:
        return Noise();
      case 1:
        return Message();
      default:
        return Announcement();
    }
  }

 private:
  std::uint32_t Below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_()) % limit; }
  std::uint8_t Byte() { return static_cast<std::uint8_t>(random_()); }
  void Append(Bytes* bytes, std::initializer_list<unsigned> more) {
    for (const unsigned byte : more) bytes->push_back(static_cast<std::uint8_t>(byte));
  }
  void AppendNoise(Bytes* bytes, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) bytes->push_back(Byte());
  }

  Bytes Noise() {
    constexpr std::array<std::size_t, 8> kLengths{1, 4, 19, 20, 24, 200, 1400, 9000};
    Bytes bytes;
    AppendNoise(&bytes, kLengths[Below(kLengths.size())]);
    return bytes;
  }

  /// Protocol 2.3 of the vendor of Fast DDS, from a process that does not exist.
  Bytes Header() {
    Bytes bytes;
    Append(&bytes, {'R', 'T', 'P', 'S', 2, 3, 1, 15, 1, 15});
    AppendNoise(&bytes, 10);
    return bytes;
  }

  /// RTPS 2.3, 8.3.7: ACKNACK, HEARTBEAT, GAP, INFO_TS, INFO_SRC, INFO_REPLY_IP4, INFO_DST, INFO_REPLY, NACK_FRAG,
  /// HEARTBEAT_FRAG, DATA, DATA_FRAG, and those of DDS Security.
  Bytes Message() {
    constexpr std::array<unsigned, 17> kKinds{0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0d, 0x0e, 0x0f,
                                              0x12, 0x13, 0x15, 0x16, 0x30, 0x31, 0x32, 0x33};
    Bytes bytes = Header();
    for (std::uint32_t i = 0, count = 1 + Below(4); i < count; ++i) {
      const std::size_t body = Below(3) == 0 ? Below(4) : 4 + Below(80);
      // The length is right, too long, or "to the end of the message".
      const std::array<std::size_t, 4> lengths{body, body + 1 + Below(60'000), 0, 0xffff};
      const std::size_t length = lengths[Below(lengths.size())];
      Append(&bytes, {kKinds[Below(kKinds.size())], Below(2) == 0 ? 1u : Byte(), static_cast<unsigned>(length & 0xff),
                      static_cast<unsigned>(length >> 8 & 0xff)});
      AppendNoise(&bytes, body);
    }
    return bytes;
  }

  /// DATA of a built-in writer of discovery: participants, publications, subscriptions, liveliness.
  Bytes Announcement() {
    constexpr std::array<std::array<unsigned, 3>, 4> kWriters{
        {{0x00, 0x01, 0xc2}, {0x00, 0x03, 0xc2}, {0x00, 0x04, 0xc2}, {0x02, 0x00, 0xc2}}};
    const auto& writer = kWriters[Below(kWriters.size())];
    Bytes bytes = Header();
    Append(&bytes, {0x15, 0x05, 0, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, writer[0], writer[1], writer[2]});
    Append(&bytes, {0, 0, 0, 0, 1 + Below(3), 0, 0, 0, 0, 3, 0, 0});
    // Ids of existing parameters, with lengths beyond the end and invalid values.
    constexpr std::array<unsigned, 12> kParameters{0x02, 0x05, 0x07, 0x0f, 0x15, 0x16,
                                                   0x1a, 0x2c, 0x31, 0x32, 0x50, 0x59};
    for (std::uint32_t i = 0, count = 1 + Below(8); i < count; ++i) {
      const unsigned body = 4 * Below(8), length = Below(2) == 0 ? body : Below(65536);
      Append(&bytes, {kParameters[Below(kParameters.size())], 0, length & 0xff, length >> 8});
      AppendNoise(&bytes, body);
    }
    return bytes;
  }

  std::mt19937 random_;
};

}  // namespace

std::vector<std::uint16_t> PortsOfDomain(int domain) {
  const unsigned first = 7400u + 250u * static_cast<unsigned>(domain);
  std::ifstream table("/proc/net/udp");
  std::vector<std::uint16_t> ports;
  for (std::string line; std::getline(table, line);) {
    std::istringstream words(line);
    std::string slot, address;
    words >> slot >> address;
    const std::size_t colon = address.find(':');
    if (colon == std::string::npos) continue;
    const unsigned long port = std::strtoul(address.c_str() + colon + 1, nullptr, 16);
    if (port >= first && port < first + 250u) ports.push_back(static_cast<std::uint16_t>(port));
  }
  std::sort(ports.begin(), ports.end());
  ports.erase(std::unique(ports.begin(), ports.end()), ports.end());
  return ports;
}

std::uint64_t FloodDomain(int domain, std::uint64_t datagrams, double seconds, std::uint32_t seed) {
  using Clock = std::chrono::steady_clock;
  const std::vector<std::uint16_t> ports = PortsOfDomain(domain);
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (ports.empty() || socket < 0) throw std::runtime_error("no port of the domain is bound, or no socket");
  Maker maker(seed);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::uint64_t sent = 0;
  const auto begin = Clock::now();
  constexpr std::uint64_t kBurst = 10;
  for (std::uint64_t i = 0; i < datagrams; ++i) {
    if (i % kBurst == 0) {
      std::this_thread::sleep_until(begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                                                seconds * static_cast<double>(i) / static_cast<double>(datagrams))));
    }
    const Bytes bytes = maker.Next();
    to.sin_port = htons(ports[i % ports.size()]);
    const ssize_t result =
        ::sendto(socket, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof(to));
    sent += result == static_cast<ssize_t>(bytes.size()) ? 1 : 0;
  }
  ::close(socket);
  return sent;
}

}  // namespace fulcrum::testing
