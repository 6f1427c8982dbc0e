#include "tests/support/http_client.h"

#include <arpa/inet.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <stdexcept>

#include "tests/support/cart.h"

namespace fulcrum::testing {

struct HttpConnection::Tls {
  explicit Tls(int socket) : context(SSL_CTX_new(TLS_client_method())), session(SSL_new(context)) {
    SSL_set_fd(session, socket);
  }
  ~Tls() {
    SSL_free(session);
    SSL_CTX_free(context);
  }
  Tls(const Tls&) = delete;
  Tls& operator=(const Tls&) = delete;

  SSL_CTX* context;
  SSL* session;
};

HttpConnection::HttpConnection(int port, const HttpRoute& route)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  if (!route.from.empty()) {
    ::inet_pton(AF_INET, route.from.c_str(), &address.sin_addr);
    ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  }
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const auto fail = [&](const std::string& what) {
    ::close(socket_);
    throw std::runtime_error(what + " on port " + std::to_string(port));
  };
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) fail("no listener");
  if (!route.tls) return;
  tls_ = std::make_unique<Tls>(socket_);
  if (SSL_connect(tls_->session) != 1) fail("no TLS");
}

HttpConnection::~HttpConnection() { ::close(socket_); }

void HttpConnection::Send(const std::string& bytes) const {
  if (tls_) {
    SSL_write(tls_->session, bytes.data(), static_cast<int>(bytes.size()));
  } else {
    ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
}

bool HttpConnection::Arrives(int limit_ms) const {
  if (tls_ && SSL_pending(tls_->session) > 0) return true;
  pollfd wait{socket_, POLLIN, 0};
  return ::poll(&wait, 1, limit_ms) > 0;
}

std::ptrdiff_t HttpConnection::Take(char* bytes, std::size_t size) const {
  return tls_ ? SSL_read(tls_->session, bytes, static_cast<int>(size)) : ::recv(socket_, bytes, size, 0);
}

std::string HttpConnection::fingerprint() const {
  if (!tls_) return {};
  X509* const certificate = SSL_get1_peer_certificate(tls_->session);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  X509_digest(certificate, EVP_sha256(), digest.data(), &size);
  X509_free(certificate);
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    std::array<char, 4> part{};
    std::snprintf(part.data(), part.size(), i == 0 ? "%02X" : ":%02X", digest[i]);
    text += part.data();
  }
  return text;
}

std::string HttpConnection::Receive(double limit_s, const std::string& end) {
  return ReceiveUntil(limit_s, [&] {
    const std::size_t found = end.empty() ? std::string::npos : rest_.find(end);
    return found == std::string::npos ? found : found + end.size();
  });
}

std::string HttpConnection::ReceiveBytes(double limit_s, std::size_t size) {
  return ReceiveUntil(limit_s, [&] { return rest_.size() < size ? std::string::npos : size; });
}

std::string HttpConnection::ReceiveUntil(double limit_s, const std::function<std::size_t()>& complete) {
  using std::chrono::steady_clock;
  const auto stop = steady_clock::now() + std::chrono::duration<double>(limit_s);
  for (;;) {
    const std::size_t found = complete();
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(stop - steady_clock::now()).count();
    if (found != std::string::npos || closed_ || left <= 0) {
      std::string taken = rest_.substr(0, found);
      rest_.erase(0, found);
      return taken;
    }
    if (!Arrives(static_cast<int>(left))) continue;
    std::array<char, 65536> part;
    const std::ptrdiff_t n = Take(part.data(), part.size());
    closed_ = n <= 0;
    if (n > 0) rest_.append(part.data(), static_cast<std::size_t>(n));
  }
}

HttpReply HttpConnection::Reply(double limit_s) {
  const std::string head = Receive(limit_s, "\r\n\r\n");
  HttpReply reply;
  if (!head.starts_with("HTTP/1.1 ")) return reply;
  reply.status = std::stoi(head.substr(9, 3));
  for (std::size_t at = head.find("\r\n") + 2; at < head.size();) {
    const std::size_t end = head.find("\r\n", at);
    const std::size_t colon = head.find(": ", at);
    if (colon < end) {
      std::string name = head.substr(at, colon - at);
      std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
      reply.head[name] = head.substr(colon + 2, end - colon - 2);
    }
    at = end + 2;
  }
  if (const auto length = reply.head.find("content-length"); length != reply.head.end()) {
    const std::size_t size = std::stoul(length->second);
    reply.body = ReceiveBytes(limit_s, size);
  }
  return reply;
}

bool HttpConnection::Closes(double limit_s) {
  (void)Receive(limit_s);
  return closed_;
}

ConsoleProgram::ConsoleProgram(int domain, const std::string& out, const std::vector<std::string>& more) {
  std::vector<std::string> words{"console", "--port", "0", "--domain", std::to_string(domain), "--out", out};
  words.insert(words.end(), more.begin(), more.end());
  program_ = Program("fulcrum", words);
  if (!WaitFor(20, [&] { return program_.Said().find("Ctrl-C ends") != std::string::npos; })) {
    throw std::runtime_error("no console: " + program_.Said());
  }
  const std::string said = program_.Said();
  const auto between = [&](const std::string& begin, const std::string& end) {
    const std::size_t at = said.find(begin);
    if (at == std::string::npos) throw std::runtime_error("no \"" + begin + "\" in what the console says: " + said);
    return said.substr(at + begin.size(), said.find(end, at + begin.size()) - at - begin.size());
  };
  const std::string address = between("open ", "/#");
  route_.tls = address.starts_with("https:");
  port_ = std::stoi(address.substr(address.rfind(':') + 1));
  token_ = ReadFile(between("TOKEN is the line in ", "\n"));
  if (token_.ends_with('\n')) token_.pop_back();
}

HttpReply ConsoleProgram::Ask(const std::string& method, const std::string& target, const std::string& head) const {
  HttpConnection connection(port_, route_);
  connection.Send(method + " " + target + " HTTP/1.1\r\n" + head + "\r\n");
  return connection.Reply();
}

HttpReply ConsoleProgram::Get(const std::string& target) const {
  return Ask("GET", target,
             "Host: 127.0.0.1:" + std::to_string(port_) + "\r\nAuthorization: Bearer " + token_ + "\r\n");
}

HttpReply ConsoleProgram::Post(const std::string& target, const std::string& body) const {
  HttpConnection connection(port_, route_);
  connection.Send(
      "POST " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\nAuthorization: Bearer " +
      token_ + "\r\nContent-Type: application/x-www-form-urlencoded\r\nContent-Length: " + std::to_string(body.size()) +
      "\r\n\r\n" + body);
  return connection.Reply();
}

}  // namespace fulcrum::testing
