// A raw HTTP client for tests of the console: it sends any text, valid or not.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace fulcrum::testing {

struct HttpReply {
  int status = 0;                           ///< 0: no reply.
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
  /// Receives until `end` has arrived, the other side closes, or the time limit is reached.
  [[nodiscard]] std::string Receive(double limit_s, const std::string& end = "");
  /// Reply to the request sent before.
  [[nodiscard]] HttpReply Reply(double limit_s = 10);
  /// True if the other side closes the connection within the limit.
  [[nodiscard]] bool Closes(double limit_s);

 private:
  std::string ReceiveBytes(double limit_s, std::size_t size);
  /// @param complete returns the number of bytes of rest_ that are complete; npos: more are needed.
  std::string ReceiveUntil(double limit_s, const std::function<std::size_t()>& complete);

  int socket_ = -1;
  std::string rest_;
  bool closed_ = false;
};

/// `fulcrum console` on a free port.
class ConsoleProgram {
 public:
  /// Starts the program and waits until it listens.
  ConsoleProgram(int domain, const std::string& out, const std::vector<std::string>& more = {});

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] const std::string& token() const { return token_; }
  Program& program() { return program_; }

  [[nodiscard]] HttpReply Get(const std::string& target) const;
  [[nodiscard]] HttpReply Post(const std::string& target, const std::string& body = "") const;
  /// Sends a request with these header lines instead of valid ones; each ends with "\r
  /// ".
  [[nodiscard]] HttpReply Ask(const std::string& method, const std::string& target, const std::string& head) const;

 private:
  Program program_;
  int port_ = 0;
  std::string token_;
};

}  // namespace fulcrum::testing
