// A raw HTTP client for tests of the console: it sends any text, valid or not.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace fulcrum::testing {

struct HttpReply {
  int status = 0;                           ///< 0: no reply.
  std::map<std::string, std::string> head;  ///< Names in lower case.
  std::string body;
};

struct HttpRoute {
  std::string from = {};  ///< Address of this end, for example "127.0.0.2"; empty: any.
  bool tls = false;       ///< Any certificate is accepted; see fingerprint().
};

/// One connection to a port of this machine.
class HttpConnection {
 public:
  /// Throws std::runtime_error if no process listens or the TLS handshake fails.
  explicit HttpConnection(int port, const HttpRoute& route = {});
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void Send(const std::string& bytes) const;
  /// Receives until `end` has arrived, the other side closes, or the time limit is reached.
  [[nodiscard]] std::string Receive(double limit_s, const std::string& end = "");
  /// Reply to the request sent before.
  [[nodiscard]] HttpReply Reply(double limit_s = 10);
  /// SHA-256 of the server's certificate, "AB:CD:…"; empty without TLS.
  [[nodiscard]] std::string fingerprint() const;
  /// True if the other side closes the connection within the limit.
  [[nodiscard]] bool Closes(double limit_s);

 private:
  std::string ReceiveBytes(double limit_s, std::size_t size);
  /// @param complete returns the number of bytes of rest_ that are complete; npos: more are needed.
  std::string ReceiveUntil(double limit_s, const std::function<std::size_t()>& complete);

  struct Tls;

  /// Waits for bytes, at most `limit_ms`; false when none have arrived.
  [[nodiscard]] bool Arrives(int limit_ms) const;
  std::ptrdiff_t Take(char* bytes, std::size_t size) const;

  int socket_ = -1;
  std::unique_ptr<Tls> tls_;
  std::string rest_;
  bool closed_ = false;
};

/// `fulcrum console` on a free port.
class ConsoleProgram {
 public:
  /// Starts the program and waits until it listens.
  ConsoleProgram(int domain, const std::string& out, const std::vector<std::string>& more = {});

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] bool tls() const { return route_.tls; }
  [[nodiscard]] const std::string& token() const { return token_; }
  Program& program() { return program_; }

  [[nodiscard]] HttpReply Get(const std::string& target) const;
  [[nodiscard]] HttpReply Post(const std::string& target, const std::string& body = "") const;
  /// Sends a request with these header lines instead of valid ones; each ends with CR LF.
  [[nodiscard]] HttpReply Ask(const std::string& method, const std::string& target, const std::string& head) const;

 private:
  Program program_;
  HttpRoute route_;
  int port_ = 0;
  std::string token_;
};

}  // namespace fulcrum::testing
