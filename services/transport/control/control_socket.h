// Commands between processes of one user on one machine: a Unix socket on which a process serves requests, one packet
// each way. No command travels on the bus.
//
//   control::Server server(control::SocketOf(memory, "supervisor"));
//   server.Serve([](const control::Request& request) { return control::Reply{true, "done"}; });  // Each turn.
//   control::Reply reply = control::Ask(control::SocketOf(memory, "supervisor"), {"down", ""});
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::control {

inline constexpr std::size_t kMostVerb_B = 31;         ///< Longest verb of a request.
inline constexpr std::size_t kMostArgument_B = 16384;  ///< Longest argument.
inline constexpr std::size_t kMostText_B = 4096;       ///< Longest text of a reply; a longer one is cut.

struct Request {
  std::string verb;
  std::string argument;
};

/// Result of a request.
struct Reply {
  bool ok = true;    ///< False: refused, and nothing was changed.
  std::string text;  ///< One line, for people.
};

/// Text of the reply to a caller that is not admitted.
inline constexpr std::string_view kNotAdmitted = "not admitted";

/// Wire form of a request: verb, a zero byte, argument.
[[nodiscard]] std::vector<char> PacketOf(const Request& request);
/// Inverse of PacketOf; empty: not a request.
[[nodiscard]] std::optional<Request> RequestFrom(std::string_view packet);

/// Socket of a process in the cart's private directory: "<directory>/control/<name>".
[[nodiscard]] std::filesystem::path SocketOf(const std::filesystem::path& directory, std::string_view name);

/// Process at the other end of a connection, as the kernel gives it.
struct Caller {
  pid_t pid = 0;
  uid_t uid = 0;
  std::vector<gid_t> groups;  ///< Primary and supplementary.
};
[[nodiscard]] Caller CallerAt(int connection);
/// Whether the caller runs as this user or as root, or belongs to `group` where one is given.
[[nodiscard]] bool IsAdmitted(const Caller& caller, std::optional<gid_t> group);

class Server {
 public:
  using Handler = std::function<Reply(const Request& request)>;

  /// Makes the socket with mode 0600 in a folder of mode 0700; replaces the socket of an earlier process. Throws
  /// InputError.
  explicit Server(const std::filesystem::path& socket);
  /// Serves on a socket that listens already and stays the caller's. @param group whose members are admitted too.
  Server(int listening, std::optional<gid_t> group);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Executes the requests that have arrived and replies to each. Never waits. Connections of callers that are not
  /// admitted are closed and counted.
  void Serve(const Handler& handle);
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Adds the descriptors that can be read when Serve() has something to do.
  void AddDescriptors(std::vector<int>* descriptors) const;

 private:
  struct Connection {
    int socket;
    std::int64_t since_ns;
  };
  void Admit(std::int64_t now_ns);

  const std::filesystem::path path_;  ///< Empty: the socket belongs to the caller.
  const int listening_;
  const std::optional<gid_t> group_;
  std::vector<Connection> connections_;
  std::uint64_t refused_ = 0;
};

/// Waits until one of the descriptors can be read, a signal with a handler arrives, or the time is over.
void AwaitInput(const std::vector<int>& descriptors, std::chrono::milliseconds longest);

/// Sends a request and waits for the reply. Throws InputError if no process listens there or this user is not admitted,
/// std::runtime_error if no reply arrives within the time.
[[nodiscard]] Reply Ask(const std::filesystem::path& socket, const Request& request, double limit_s = 10);
/// As above, over a connection that the caller has opened and keeps.
[[nodiscard]] Reply Ask(int connection, const Request& request, double limit_s = 10);
/// Sends a request and waits for no reply. False if no process listens there.
bool Tell(const std::filesystem::path& socket, const Request& request);

}  // namespace fulcrum::control
