// Any bytes sent to the console's server over a connection of its own: parsed by the server, routed as the console
// does, and answered. A missing answer is a fault, too.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <system_error>
#include <thread>

#include "services/session/console/http_server.h"
#include "services/session/console/socket.h"
#include "tests/fuzz/console/route_check.h"
#include "tests/fuzz/target.h"

namespace fulcrum::fuzz {
namespace {

/// Longer than any pause of a loaded machine.
constexpr timeval kPatience{20, 0};

/// Result of `call`, which is repeated while a signal interrupts it: the engine's own clock sends one each few seconds.
template <class Call>
auto Uninterrupted(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

class Socket {
 public:
  explicit Socket(int port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    // Closed without TIME_WAIT, which would use up the ports.
    const linger at_once{1, 0};
    (void)::setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    (void)::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd_ < 0 || !Connect(address)) {
      throw std::system_error(errno, std::generic_category(), "connection to the console's server");
    }
  }
  ~Socket() { ::close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  /// Sends all input and nothing more, and reads until the server closes.
  std::string Ask(Input input) {
    // The server may close before it has read everything.
    while (!input.empty()) {
      const ssize_t sent = Uninterrupted([&] { return ::send(fd_, input.data(), input.size(), MSG_NOSIGNAL); });
      if (sent <= 0) break;
      input = input.subspan(static_cast<std::size_t>(sent));
    }
    (void)::shutdown(fd_, SHUT_WR);
    std::string answer;
    std::array<char, 4096> piece{};
    ssize_t got = 0;
    while ((got = Uninterrupted([&] { return ::recv(fd_, piece.data(), piece.size(), 0); })) > 0)
      answer.append(piece.data(), static_cast<std::size_t>(got));
    Promise(got == 0 || errno != EAGAIN, "the server neither answers nor closes");
    return answer;
  }

 private:
  /// False with errno. A connect that a signal interrupts goes on, and a second call would be refused.
  bool Connect(const sockaddr_in& address) {
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return true;
    if (errno != EINTR) return false;
    pollfd ready{fd_, POLLOUT, 0};
    Uninterrupted([&] { return ::poll(&ready, 1, -1); });
    int error = 0;
    socklen_t size = sizeof error;
    if (::getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size) != 0) return false;
    errno = error;
    return error == 0;
  }

  int fd_;
};

class ConsoleHttp final : public Target {
 public:
  ConsoleHttp() {
    thread_ = std::thread([this] {
      while (!stop_) server_.Turn(std::chrono::milliseconds(20));
    });
  }
  ~ConsoleHttp() override {
    stop_ = true;
    thread_.join();
  }
  Outcome Offer(Input input) override {
    const std::string answer = Socket(server_.port()).Ask(input);
    Promise(answer.empty() || answer.starts_with("HTTP/1.1 "), "an answer that is not HTTP");
    const bool well = answer.starts_with("HTTP/1.1 200 ") || answer.starts_with("HTTP/1.1 101 ");
    return well ? Outcome::kAccepted : Outcome::kRefused;
  }
  std::vector<std::string> Words() override {
    return {"GET ",
            "POST ",
            " HTTP/1.1",
            "Host: ",
            "Origin: ",
            "Sec-Fetch-Site: ",
            "Authorization: Bearer ",
            "Content-Length: ",
            "Transfer-Encoding: chunked",
            "Content-Type: application/x-www-form-urlencoded",
            "Connection: keep-alive",
            "Expect: 100-continue",
            "Upgrade: websocket",
            "Sec-WebSocket-Key: ",
            "/live?ticket=",
            "/film?ticket=",
            "/api/",
            "/report?ticket=",
            "localhost"};
  }
  std::vector<Seed> Seeds() override {
    const std::string from = "Host: 127.0.0.1:8480\r\nAuthorization: Bearer " + console::testing::kToken + "\r\n";
    const std::string form = "scene=built-in&power=35&seconds=60&record=on";
    return {{"page", BytesOf("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")},
            {"state", BytesOf("GET /api/state HTTP/1.1\r\n" + from + "\r\n")},
            {"events", BytesOf("GET /api/events HTTP/1.1\r\n" + from + "Sec-Fetch-Site: same-origin\r\n\r\n")},
            {"two", BytesOf("GET /api/choices HTTP/1.1\r\n" + from + "\r\nGET / HTTP/1.0\r\nHost: cart\r\n\r\n")},
            {"live", BytesOf("GET /live?ticket=" + std::string(64, 'a') +
                             " HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
                             "\x81\x86....x=1234")},
            {"start", BytesOf("POST /api/start HTTP/1.1\r\n" + from +
                              "Origin: http://127.0.0.1:8480\r\nContent-Type: application/x-www-form-urlencoded\r\n"
                              "Content-Length: " +
                              std::to_string(form.size()) + "\r\n\r\n" + form)},
            {"chunked", BytesOf("POST /api/restart HTTP/1.1\r\n" + from +
                                "Content-Type: application/x-www-form-urlencoded\r\nTransfer-Encoding: chunked\r\n\r\n"
                                "5\r\nnode=\r\nc\r\nphysics_node\r\n0\r\n\r\n")}};
  }

 private:
  /// A violation here ends the program: the exception is thrown on the server's thread.
  console::HttpResponse Answer(const console::HttpRequest& request) const {
    const std::string broken = console::testing::Broken(request);
    Promise(broken.empty(), broken);
    const console::RouteResult result = Route(access_, request);
    if (!result.routed) return result.refusal;
    console::HttpResponse response = console::Done("taken");
    response.stream = result.routed->wanted == console::Wanted::kEvents;
    const bool socket =
        result.routed->wanted == console::Wanted::kLive || result.routed->wanted == console::Wanted::kFilm;
    response.socket = socket ? &sockets_ : nullptr;
    return response;
  }

  const console::SocketService sockets_{};
  const console::Access access_{console::testing::kToken, {"cart"}};
  console::HttpServer server_{{"127.0.0.1", 0, {}},
                              {[this](const console::HttpRequest& request) { return Answer(request); },
                               [](const console::HttpRequest& request) {
                                 return request.authorization ==
                                        std::string("Bearer ") + std::string(console::testing::kToken);
                               }}};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Target> MakeConsoleHttp() { return std::make_unique<ConsoleHttp>(); }

}  // namespace fulcrum::fuzz
