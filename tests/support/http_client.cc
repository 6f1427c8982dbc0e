#include "tests/support/http_client.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>

#include "tests/support/cart.h"

namespace fulcrum::testing {

HttpConnection::HttpConnection(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    throw std::runtime_error("no listener on port " + std::to_string(port));
  }
}

HttpConnection::~HttpConnection() { ::close(socket_); }

void HttpConnection::Send(const std::string& bytes) const { ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }

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
    pollfd wait{socket_, POLLIN, 0};
    if (::poll(&wait, 1, static_cast<int>(left)) <= 0) continue;
    std::array<char, 65536> part;
    const ssize_t n = ::recv(socket_, part.data(), part.size(), 0);
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
  constexpr const char* kBegin = "http://127.0.0.1:";
  const bool listens = WaitFor(20, [&] { return program_.Said().find("Ctrl-C ends") != std::string::npos; });
  const std::string said = program_.Said();
  const std::size_t at = said.find(kBegin), hash = said.find("/#", at);
  if (!listens || at == std::string::npos || hash == std::string::npos) throw std::runtime_error("no console: " + said);
  port_ = std::stoi(said.substr(at + std::string(kBegin).size()));
  token_ = said.substr(hash + 2, said.find('\n', hash) - hash - 2);
}

HttpReply ConsoleProgram::Ask(const std::string& method, const std::string& target, const std::string& head) const {
  HttpConnection connection(port_);
  connection.Send(method + " " + target + " HTTP/1.1\r\n" + head + "\r\n");
  return connection.Reply();
}

HttpReply ConsoleProgram::Get(const std::string& target) const {
  return Ask("GET", target,
             "Host: 127.0.0.1:" + std::to_string(port_) + "\r\nAuthorization: Bearer " + token_ + "\r\n");
}

HttpReply ConsoleProgram::Post(const std::string& target, const std::string& body) const {
  HttpConnection connection(port_);
  connection.Send(
      "POST " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\nAuthorization: Bearer " +
      token_ + "\r\nContent-Type: application/x-www-form-urlencoded\r\nContent-Length: " + std::to_string(body.size()) +
      "\r\n\r\n" + body);
  return connection.Reply();
}

}  // namespace fulcrum::testing
