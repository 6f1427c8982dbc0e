// The HTTP server alone, under small limits: slots, time limits, streams, sizes.
#include "services/session/console/http_server.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "services/session/console/socket.h"
#include "tests/support/cart.h"
#include "tests/support/http_client.h"

namespace fulcrum::console {
namespace {

using fulcrum::testing::HttpConnection;
using fulcrum::testing::WaitFor;
using std::chrono::seconds;

constexpr const char* kPage = "GET / HTTP/1.1\r\nHost: x\r\n\r\n";
constexpr const char* kKnown = "GET / HTTP/1.1\r\nHost: x\r\nAuthorization: yes\r\n\r\n";

/// Serves in a thread. The header "Authorization: yes" authenticates a client.
class Served {
 public:
  explicit Served(const HttpLimits& limits, std::optional<TlsIdentity> tls = {})
      : server_({.address = "127.0.0.1", .port = 0, .tls = std::move(tls)},
                {.handle =
                     [this](const HttpRequest& request) {
                       return HttpResponse{.body = request.secure ? "secure" : "plain",
                                           .stream = request.target == "/stream",
                                           .socket = request.target == "/socket" ? &service_ : nullptr};
                     },
                 .knows = [](const HttpRequest& request) { return request.authorization == "yes"; }},
                limits),
        thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            server_.Turn(std::chrono::milliseconds(20));
            server_.Feed([](std::uint64_t* cursor) { return "part " + std::to_string(++*cursor); });
          }
        }) {}
  [[nodiscard]] int port() const { return server_.port(); }
  [[nodiscard]] int sockets() const { return sockets_; }

 private:
  static void Answer(Socket* socket, std::string_view text) {
    socket->SendText("received " + std::string(text));
    const auto bytes = std::make_shared<const std::string>(100'000, 'x');
    EXPECT_TRUE(socket->SendBytes(bytes));
    EXPECT_FALSE(socket->SendBytes(bytes)) << "the first are still on their way";
  }

  std::atomic<int> sockets_{0};
  const SocketService service_{.opened =
                                   [this](Socket* socket) {
                                     ++sockets_;
                                     socket->SendText("welcome");
                                   },
                               .received = [](Socket* socket, std::string_view text) { Answer(socket, text); },
                               .closed = [this](Socket*) { --sockets_; }};
  HttpServer server_;
  std::jthread thread_;
};

HttpLimits Small() {
  HttpLimits limits;
  limits.slots = {.guests = 3, .guests_per_address = 2, .known = 2};
  limits.streams = 1;
  limits.guest_request = seconds(1);
  return limits;
}

TEST(HttpServer, TheOldestGuestOfAnAddressGivesWay) {
  HttpLimits limits = Small();
  limits.guest_request = seconds(60);
  Served served(limits);
  HttpConnection first(served.port()), second(served.port()), third(served.port());
  EXPECT_TRUE(first.Closes(5));
  third.Send(kPage);
  EXPECT_EQ(third.Reply().status, 200);
  // Another address takes the third slot; the fourth connection closes the oldest of all.
  HttpConnection other(served.port(), {.from = "127.0.0.2"}), another(served.port(), {.from = "127.0.0.3"});
  EXPECT_TRUE(second.Closes(5));
  other.Send(kPage);
  EXPECT_EQ(other.Reply().status, 200);
}

TEST(HttpServer, NoGuestTakesAReservedSlot) {
  Served served(Small());
  HttpConnection known(served.port());
  known.Send(kKnown);
  EXPECT_EQ(known.Reply().status, 200);
  std::vector<std::unique_ptr<HttpConnection>> guests;
  for (int i = 0; i < 50; ++i) guests.push_back(std::make_unique<HttpConnection>(served.port()));
  EXPECT_FALSE(known.Closes(0.2));
  known.Send(kKnown);
  EXPECT_EQ(known.Reply().status, 200);
}

TEST(HttpServer, AClientWithTheTokenIsAnsweredWhenItsSlotsAreTaken) {
  Served served(Small());
  HttpConnection one(served.port()), two(served.port());
  for (HttpConnection* held : {&one, &two}) {
    held->Send(kKnown);
    EXPECT_EQ(held->Reply().status, 200);
  }
  HttpConnection more(served.port());
  more.Send(kKnown);
  EXPECT_EQ(more.Reply().status, 200);
  EXPECT_TRUE(more.Closes(5));
  one.Send(kKnown);
  EXPECT_EQ(one.Reply().status, 200);
}

TEST(HttpServer, ASlowGuestHasOneLimitForItsWholeRequest) {
  Served served(Small());
  HttpConnection slow(served.port());
  slow.Send("GET / HT");
  // Single bytes of a request, each sent well before the limit, do not extend the limit.
  int drops = 0;
  while (drops < 50 && !slow.Closes(0.1)) {
    slow.Send("T");
    ++drops;
  }
  EXPECT_LT(drops, 50);
  // The same for a body, and for a handshake that does not end.
  HttpConnection body(served.port());
  body.Send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n");
  for (drops = 0; drops < 50 && !body.Closes(0.1); ++drops) body.Send("x");
  EXPECT_LT(drops, 50);
}

/// A WebSocket to the server, with calls that wait.
class Client {
 public:
  /// Throws boost::system::system_error if the server refuses.
  explicit Client(int port) {
    namespace ip = boost::asio::ip;
    web_.next_layer().connect({ip::make_address("127.0.0.1"), static_cast<unsigned short>(port)});
    web_.handshake("127.0.0.1", "/socket");
  }
  void Send(const std::string& text) { web_.write(boost::asio::buffer(text)); }
  std::string Read() {
    boost::beast::flat_buffer buffer;
    web_.read(buffer);
    return boost::beast::buffers_to_string(buffer.data());
  }
  [[nodiscard]] bool binary() const { return web_.got_binary(); }

 private:
  boost::asio::io_context io_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> web_{io_};
};

TEST(HttpServer, WebSocketsCarryTextAndBytes) {
  Served served({});
  {
    Client client(served.port());
    EXPECT_EQ(client.Read(), "welcome");
    EXPECT_TRUE(WaitFor(5, [&] { return served.sockets() == 1; }));
    for (const char* text : {"one", "two"}) {
      client.Send(text);
      EXPECT_EQ(client.Read(), std::string("received ") + text);
      EXPECT_FALSE(client.binary());
      EXPECT_EQ(client.Read(), std::string(100'000, 'x'));
      EXPECT_TRUE(client.binary());
    }
  }
  EXPECT_TRUE(WaitFor(5, [&] { return served.sockets() == 0; })) << "a client that is gone";
}

TEST(HttpServer, WebSocketsAreFewAndTheirMessagesShort) {
  HttpLimits limits;
  limits.sockets = 2;
  Served served(limits);
  Client first(served.port()), second(served.port());
  EXPECT_THROW(Client(served.port()), boost::system::system_error);
  EXPECT_EQ(second.Read(), "welcome");
  second.Send(std::string(limits.message + 1, 'x'));
  EXPECT_THROW(second.Read(), boost::system::system_error);
  EXPECT_TRUE(WaitFor(5, [&] { return served.sockets() == 1; }));
  Client third(served.port());
  EXPECT_EQ(third.Read(), "welcome");
  third.Send("here");
  EXPECT_EQ(third.Read(), "received here");
  // No guest takes its slot.
  std::vector<std::unique_ptr<HttpConnection>> guests;
  for (int i = 0; i < 300; ++i) guests.push_back(std::make_unique<HttpConnection>(served.port()));
  third.Send("still here");
  EXPECT_EQ(third.Read(), std::string(100'000, 'x'));
  EXPECT_EQ(third.Read(), "received still here");
  // A request that asks for no change of protocol.
  HttpConnection plain(served.port());
  plain.Send("GET /socket HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(plain.Reply().status, 426);
}

TEST(HttpServer, StreamsAreFew) {
  Served served(Small());
  HttpConnection stream(served.port());
  const std::string ask = "GET /stream HTTP/1.1\r\nHost: x\r\nAuthorization: yes\r\n\r\n";
  stream.Send(ask);
  EXPECT_NE(stream.Receive(5, "part 3").find("part 1"), std::string::npos);
  HttpConnection second(served.port());
  second.Send(ask);
  EXPECT_EQ(second.Reply().status, 503);
  EXPECT_NE(stream.Receive(5, "part 5").find("part 4"), std::string::npos);
}

TEST(HttpServer, WebSocketsWorkOverTls) {
  Served served({}, MakeTlsIdentity({"localhost"}, std::time(nullptr)));
  HttpConnection client(served.port(), {.tls = true});
  client.Send(
      "GET /socket HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n");
  EXPECT_NE(client.Receive(5, "welcome").find("HTTP/1.1 101"), std::string::npos);
  client.Send(std::string("\x81\x84\0\0\0\0here", 10));  // A text of four bytes, masked with 0.
  EXPECT_NE(client.Receive(5, "received here").find("received here"), std::string::npos);
}

TEST(HttpServer, ServesOverTlsAndNothingElseThere) {
  const TlsIdentity identity = MakeTlsIdentity({"localhost"}, std::time(nullptr));
  Served served(Small(), identity);
  HttpConnection client(served.port(), {.tls = true});
  EXPECT_EQ(client.fingerprint(), identity.fingerprint);
  client.Send(kKnown);
  EXPECT_EQ(client.Reply().body, "secure");
  const std::string ask = "GET /stream HTTP/1.1\r\nHost: x\r\nAuthorization: yes\r\n\r\n";
  client.Send(ask);
  EXPECT_NE(client.Receive(5, "part 3").find("part 1"), std::string::npos);
  HttpConnection plain(served.port());
  plain.Send(kKnown);
  EXPECT_EQ(plain.Reply().status, 0) << "no response without TLS";
  EXPECT_TRUE(plain.Closes(5));
  HttpConnection half(served.port());
  half.Send(std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11));
  EXPECT_TRUE(half.Closes(5)) << "a handshake that does not end has the limit of a request";
}

}  // namespace
}  // namespace fulcrum::console
