#include "services/transport/control/control_socket.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::control {
namespace {

namespace fs = std::filesystem;

// More connections at a time than operators and programs on one cart; the oldest silent one is closed for a new one.
constexpr std::size_t kMostConnections = 16;
// A client sends its request as soon as it is connected [ns].
constexpr std::int64_t kLongestSilence_ns = 2'000'000'000;
constexpr int kBacklog = 32;
constexpr char kDone = '1', kRefused = '0';

std::int64_t NowNs() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

[[noreturn]] void Fail(const fs::path& socket, const char* what) {
  throw InputError(socket.string() + ": " + what + ": " + std::strerror(errno));
}

sockaddr_un AddressOf(const fs::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.string().size() >= sizeof address.sun_path) {
    throw InputError(socket.string() + ": longer than the path of a socket may be");
  }
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  return address;
}

int Listen(const fs::path& socket) {
  const sockaddr_un address = AddressOf(socket);
  const fs::path folder = socket.parent_path();
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) Fail(folder, "cannot be made");
  if (::unlink(socket.c_str()) != 0 && errno != ENOENT) Fail(socket, "cannot be replaced");
  const int listening = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listening < 0) Fail(socket, "no socket");
  // The mode of the socket file is that of the socket: nobody else can connect between bind and chmod.
  ::fchmod(listening, 0600);
  if (::bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::chmod(socket.c_str(), 0600) != 0 || ::listen(listening, kBacklog) != 0) {
    const int error = errno;
    ::close(listening);
    errno = error;
    Fail(socket, "cannot listen");
  }
  return listening;
}

/// Connects; -1 with errno if that fails.
int Connect(const fs::path& socket) {
  const sockaddr_un address = AddressOf(socket);
  const int connection = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (connection < 0) return -1;
  if (::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return connection;
  const int error = errno;
  ::close(connection);
  errno = error;
  return -1;
}

/// Wire form of a reply.
std::vector<char> AnswerOf(const Reply& reply) {
  const std::string answer = (reply.ok ? kDone : kRefused) + reply.text.substr(0, kMostText_B);
  return {answer.begin(), answer.end()};
}

bool SendPacket(int connection, const std::vector<char>& packet) {
  return ::send(connection, packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
         static_cast<ssize_t>(packet.size());
}

}  // namespace

std::vector<char> PacketOf(const Request& request) {
  if (request.verb.empty() || request.verb.size() > kMostVerb_B || request.argument.size() > kMostArgument_B) {
    throw InputError("command \"" + request.verb.substr(0, kMostVerb_B) + "\": a verb has 1 to " +
                     std::to_string(kMostVerb_B) + " bytes, an argument at most " + std::to_string(kMostArgument_B));
  }
  std::vector<char> packet(request.verb.begin(), request.verb.end());
  packet.push_back('\0');
  packet.insert(packet.end(), request.argument.begin(), request.argument.end());
  return packet;
}

std::optional<Request> RequestFrom(std::string_view packet) {
  const std::size_t end = packet.find('\0');
  if (end == std::string_view::npos || end == 0 || end > kMostVerb_B) return std::nullopt;
  const std::string_view verb = packet.substr(0, end), argument = packet.substr(end + 1);
  const bool printable = std::all_of(verb.begin(), verb.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  if (!printable || argument.size() > kMostArgument_B) return std::nullopt;
  return Request{std::string(verb), std::string(argument)};
}

fs::path SocketOf(const fs::path& directory, std::string_view name) { return directory / "control" / name; }

Caller CallerAt(int connection) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "SO_PEERCRED");
  }
  Caller caller{credentials.pid, credentials.uid, {credentials.gid}};
  // As many supplementary groups as the kernel allows a process.
  std::vector<gid_t> groups(65536);
  size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (::getsockopt(connection, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) == 0) {
    caller.groups.insert(caller.groups.end(), groups.begin(),
                         groups.begin() + static_cast<std::ptrdiff_t>(size / sizeof(gid_t)));
  }
  return caller;
}

bool IsAdmitted(const Caller& caller, std::optional<gid_t> group) {
  if (caller.uid == ::geteuid() || caller.uid == 0) return true;
  return group && std::find(caller.groups.begin(), caller.groups.end(), *group) != caller.groups.end();
}

Server::Server(const fs::path& socket) : path_(socket), listening_(Listen(socket)) {}

Server::Server(int listening, std::optional<gid_t> group) : listening_(listening), group_(group) {}

Server::~Server() {
  for (const Connection& connection : connections_) ::close(connection.socket);
  if (path_.empty()) return;
  ::close(listening_);
  std::error_code ignored;
  fs::remove(path_, ignored);
}

void Server::Admit(std::int64_t now_ns) {
  for (;;) {
    const int connection = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (connection < 0) return;
    if (!IsAdmitted(CallerAt(connection), group_)) {
      ++refused_;
      char ignored = 0;
      (void)!::recv(connection, &ignored, 1, MSG_DONTWAIT);  // Closing with a request unread would discard the reply.
      (void)SendPacket(connection, AnswerOf({false, std::string(kNotAdmitted)}));
      ::close(connection);
      continue;
    }
    if (connections_.size() == kMostConnections) {
      ::close(connections_.front().socket);
      connections_.erase(connections_.begin());
    }
    connections_.push_back({connection, now_ns});
  }
}

void Server::Serve(const Handler& handle) {
  const std::int64_t now_ns = NowNs();
  Admit(now_ns);
  std::erase_if(connections_, [&](const Connection& connection) {
    std::array<char, kMostVerb_B + 1 + kMostArgument_B + 1> packet;
    const ssize_t size = ::recv(connection.socket, packet.data(), packet.size(), MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
      if (now_ns - connection.since_ns < kLongestSilence_ns) return false;
    } else if (size > 0) {
      Reply reply{false, "not a request"};
      if (const auto request = RequestFrom({packet.data(), static_cast<std::size_t>(size)})) {
        try {
          reply = handle(*request);
        } catch (const std::exception& error) {
          reply = {false, error.what()};
        }
      }
      (void)SendPacket(connection.socket, AnswerOf(reply));
    }
    ::close(connection.socket);
    return true;
  });
}

void Server::AddDescriptors(std::vector<int>* descriptors) const {
  descriptors->push_back(listening_);
  for (const Connection& connection : connections_) descriptors->push_back(connection.socket);
}

void AwaitInput(const std::vector<int>& descriptors, std::chrono::milliseconds longest) {
  std::vector<pollfd> inputs;
  for (const int descriptor : descriptors) inputs.push_back({descriptor, POLLIN, 0});
  // Connections of users without rights, or one that cannot be accepted, end each wait at once: the pause keeps the
  // caller from using a whole core.
  constexpr std::chrono::milliseconds kShortest(2);
  if (::poll(inputs.data(), inputs.size(), static_cast<int>(longest.count())) > 0)
    std::this_thread::sleep_for(kShortest);
}

Reply Ask(int connection, const Request& request, double limit_s) {
  // A server that does not admit this user replies and closes at once, perhaps before the request is sent.
  if (!SendPacket(connection, PacketOf(request)) && errno != EPIPE && errno != ECONNRESET) {
    throw std::runtime_error(std::string("the command could not be sent: ") + std::strerror(errno));
  }
  pollfd readable{connection, POLLIN, 0};
  const int limit_ms = static_cast<int>(1e3 * limit_s);
  std::array<char, 1 + kMostText_B> packet;
  ssize_t size = 0;
  if (::poll(&readable, 1, limit_ms) == 1) {
    size = ::recv(connection, packet.data(), packet.size(), 0);
    // The error is reported once, before the reply that was received.
    if (size < 0 && errno == ECONNRESET) size = ::recv(connection, packet.data(), packet.size(), 0);
  }
  if (size <= 0) throw std::runtime_error("no reply within " + std::to_string(limit_ms / 1000) + " s");
  return {packet[0] == kDone, std::string(packet.data() + 1, static_cast<std::size_t>(size - 1))};
}

Reply Ask(const fs::path& socket, const Request& request, double limit_s) {
  const int connection = Connect(socket);
  if (connection < 0) Fail(socket, "no process listens");
  try {
    Reply reply = Ask(connection, request, limit_s);
    ::close(connection);
    return reply;
  } catch (...) {
    ::close(connection);
    throw;
  }
}

bool Tell(const fs::path& socket, const Request& request) {
  const int connection = Connect(socket);
  if (connection < 0) return false;
  const bool sent = SendPacket(connection, PacketOf(request));
  ::close(connection);
  return sent;
}

}  // namespace fulcrum::control
