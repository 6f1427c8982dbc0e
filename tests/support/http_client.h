// A raw HTTP client for tests of the console: it sends what it is given, right or wrong.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace fulcrum::testing {

struct HttpReply {
  int status = 0;                           ///< 0: none came.
  std::map<std::string, std::string> head;  ///< Names in lower case.
  std::string body;
};

/// One connection to a port of this machine.
class HttpConnection {
 public:
  explicit HttpConnection(int port);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void Send(const std::string& bytes) const;
  /// What comes until `end` has come, the other side closes, or the limit is over.
  [[nodiscard]] std::string Receive(double limit_s, const std::string& end = "");
  /// Of what was sent before.
  [[nodiscard]] HttpReply Reply(double limit_s = 10);
  /// The other side has closed, within the limit.
  [[nodiscard]] bool Closes(double limit_s);

 private:
  std::string ReceiveBytes(double limit_s, std::size_t size);
  /// @param complete how much of rest_ is wanted; npos: there is more to come.
  std::string ReceiveUntil(double limit_s, const std::function<std::size_t()>& complete);

  int socket_ = -1;
  std::string rest_;
  bool closed_ = false;
};

/// `fulcrum console` on a free port.
class ConsoleProgram {
 public:
  /// Waits until it listens.
  ConsoleProgram(int domain, const std::string& out, const std::vector<std::string>& more = {});

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] const std::string& token() const { return token_; }
  Program& program() { return program_; }

  [[nodiscard]] HttpReply Get(const std::string& target) const;
  [[nodiscard]] HttpReply Post(const std::string& target, const std::string& body = "") const;
  /// A request with these header lines instead of the right ones; "\r\n" after each.
  [[nodiscard]] HttpReply Ask(const std::string& method, const std::string& target, const std::string& head) const;

 private:
  Program program_;
  int port_ = 0;
  std::string token_;
};

}  // namespace fulcrum::testing
