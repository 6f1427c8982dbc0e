// Silent connections to a port of this machine, from one address or many: a client connects, sends nothing or less than
// a whole request, and connects again each time it is closed.
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

namespace fulcrum::testing {

class Siege {
 public:
  struct Attack {
    std::size_t connections = 1000;
    std::vector<std::string> from{"127.0.0.1"};  ///< Addresses of the clients, in turn.
    std::string said = {};                       ///< Sent on each connection.
  };
  Siege(int port, Attack attack);
  ~Siege();
  Siege(const Siege&) = delete;
  Siege& operator=(const Siege&) = delete;

  /// Connections made so far. From the first `connections` on, each replaces one that the server has closed.
  [[nodiscard]] std::size_t made() const { return made_; }

 private:
  void Run(int port, const Attack& attack);

  std::atomic<bool> stop_{false};
  std::atomic<std::size_t> made_{0};
  std::thread thread_;
};

/// Number of open file descriptors of a process.
[[nodiscard]] std::size_t OpenDescriptors(int pid);

}  // namespace fulcrum::testing
