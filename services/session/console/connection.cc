#include "services/session/console/connection.h"

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/stream_base.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <deque>
#include <optional>
#include <type_traits>
#include <utility>

namespace fulcrum::console {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using tcp = asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;
using Fields = http::request_header<>;

// The page loads from and sends to this server only, and no other page may embed it in a frame.
constexpr const char* kPagePolicy = "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string Field(const Fields& message, http::field name) {
  const auto [first, last] = message.equal_range(name);
  // A repeated field may be an attack on the checks: this value passes none of them.
  if (first != last && std::next(first) != last) return "\x01";
  return first == last ? std::string() : std::string(first->value());
}
std::string Field(const Fields& message, const char* name) {
  const auto found = message.find(name);
  return found == message.end() ? std::string() : std::string(found->value());
}

/// Request without its body.
HttpRequest Plain(const Fields& message, bool secure) {
  HttpRequest request;
  request.method = std::string(message.method_string());
  request.target = std::string(message.target());
  request.host = Field(message, http::field::host);
  request.origin = Field(message, http::field::origin);
  request.authorization = Field(message, http::field::authorization);
  request.content_type = Field(message, http::field::content_type);
  request.fetch_site = Field(message, "Sec-Fetch-Site");
  request.secure = secure;
  return request;
}

template <class Body>
http::response<Body> Head(const HttpResponse& from, bool keep_alive) {
  http::response<Body> response(http::int_to_status(static_cast<unsigned>(from.status)), 11);
  response.set(http::field::content_type, from.type);
  response.set(http::field::cache_control, "no-store");
  response.set("Content-Security-Policy", from.policy.empty() ? kPagePolicy : from.policy.c_str());
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.keep_alive(keep_alive);
  return response;
}

int StatusOf(const beast::error_code& error) {
  if (error == http::error::header_limit) return 431;
  if (error == http::error::body_limit) return 413;
  return 400;
}

template <class Stream>
class ConnectionOver final : public Connection,
                             public Socket,
                             public std::enable_shared_from_this<ConnectionOver<Stream>> {
 public:
  static constexpr bool kSecure = std::is_same_v<Stream, TlsStream>;

  ConnectionOver(Admission::Id id, std::shared_ptr<ServerState> state, tcp::socket socket, asio::ssl::context* tls)
      : Connection(id, std::move(state)), tls_(tls) {
    if constexpr (kSecure) {
      silent_.emplace(std::move(socket));
    } else {
      stream_.emplace(std::move(socket));
    }
  }

  void Begin() override {
    // One time limit for handshake and request: bytes that trickle in do not move it.
    transport().expires_after(server().limits.guest_request);
    if constexpr (kSecure) {
      AwaitHello();
    } else {
      ReadHead();
    }
  }

  void SendPart(std::string text) override {
    part_ = std::move(text);
    BeginPart();
    asio::async_write(*stream_, http::make_chunk(asio::const_buffer(part_.data(), part_.size())),
                      [self = this->shared_from_this()](const beast::error_code& error, std::size_t) {
                        self->EndPart();
                        if (error) self->Close();
                      });
  }

  void SendText(std::string text) override {
    if (out_.size() >= kMostUnread) {
      // Not at once: the caller may be about to send to others.
      asio::post(transport().get_executor(), [self = this->shared_from_this()] { self->Close(); });
      return;
    }
    Push({std::make_shared<const std::string>(std::move(text)), false});
  }
  bool SendBytes(std::shared_ptr<const std::string> bytes) override {
    const auto binary = [](const Message& message) { return message.binary; };
    if (std::any_of(out_.begin(), out_.end(), binary)) return false;
    Push({std::move(bytes), true});
    return true;
  }

 protected:
  void CloseSocket() override {
    if (web_) {
      --server().sockets;
      service_->closed(this);
    }
    beast::error_code ignored;
    transport().socket().shutdown(tcp::socket::shutdown_both, ignored);
    transport().socket().close(ignored);
  }

 private:
  struct Message {
    std::shared_ptr<const std::string> bytes;
    bool binary;
  };
  /// Messages that may wait for a client.
  static constexpr std::size_t kMostUnread = 64;
  static constexpr std::chrono::seconds kOpening{5}, kSilence{10};

  beast::tcp_stream& transport() { return stream_ ? beast::get_lowest_layer(*stream_) : *silent_; }

  /// A silent connection costs a socket only: the state of TLS is made when the first bytes have arrived.
  void AwaitHello() {
    silent_->async_read_some(asio::buffer(hello_),
                             [self = this->shared_from_this()](const beast::error_code& error, std::size_t size) {
                               if (error || !self->open()) return self->Close();
                               self->Handshake(size);
                             });
  }

  void Handshake(std::size_t size) {
    if constexpr (kSecure) {
      stream_.emplace(std::move(*silent_), *tls_);
      stream_->async_handshake(asio::ssl::stream_base::server, asio::buffer(hello_.data(), size),
                               [self = this->shared_from_this(), size](const beast::error_code& error, std::size_t n) {
                                 // Before the server's hello no client has more to say than its own.
                                 if (error || n != size) return self->Close();
                                 self->ReadHead();
                               });
    }
  }

  void ReadHead() {
    parser_.emplace();
    parser_->header_limit(server().limits.header_bytes);
    parser_->body_limit(server().limits.body_bytes);
    http::async_read_header(*stream_, buffer_, *parser_,
                            [self = this->shared_from_this()](const beast::error_code& error, std::size_t) {
                              if (error) return self->Fail(error);
                              self->ReadBody();
                            });
  }

  void ReadBody() {
    // Closed for a new guest since the header arrived: it must not take a reserved slot now.
    if (!open()) return;
    const bool has_token = server().service.knows(Plain(parser_->get(), kSecure));
    if (has_token && !known_) known_ = server().admission.Recognise(id());
    // A client with the token gets its response even when all reserved slots are taken.
    last_ = has_token && !known_;
    if (has_token) transport().expires_after(server().limits.request);
    http::async_read(*stream_, buffer_, *parser_,
                     [self = this->shared_from_this()](const beast::error_code& error, std::size_t) {
                       if (error) return self->Fail(error);
                       self->Respond();
                     });
  }

  void Fail(const beast::error_code& error) {
    // Only errors of the request itself get a response.
    const bool of_request = error.category() == make_error_code(http::error::bad_target).category();
    if (!of_request || error == http::error::end_of_stream || error == http::error::partial_message) return Close();
    Refuse(StatusOf(error));
  }

  void Refuse(int status) { Send({.status = status, .type = "text/plain", .body = "refused\n"}, false); }

  void Respond() {
    if (!open()) return;
    const bool keep_alive = parser_->get().keep_alive() && !last_;
    http::request<http::string_body> message = parser_->release();
    HttpRequest request = Plain(message, kSecure);
    request.body = std::move(message.body());
    HttpResponse response = server().service.handle(request);
    if (response.socket != nullptr) return BeginSocket(message, *response.socket);
    if (!response.stream) return Send(std::move(response), keep_alive);
    if (last_ || server().streams.size() >= server().limits.streams) return Refuse(503);
    BeginStream(response);
  }

  void Send(HttpResponse from, bool keep_alive) {
    auto response = std::make_shared<http::response<http::string_body>>(Head<http::string_body>(from, keep_alive));
    response->body() = std::move(from.body);
    response->prepare_payload();
    transport().expires_after(server().limits.response);
    http::async_write(*stream_, *response,
                      [self = this->shared_from_this(), response](const beast::error_code& error, std::size_t) {
                        if (error || response->need_eof()) return self->Close();
                        self->AwaitNext();
                      });
  }

  void AwaitNext() {
    if (!open()) return;
    transport().expires_after(known_ ? server().limits.request : server().limits.guest_request);
    ReadHead();
  }

  void BeginStream(const HttpResponse& from) {
    auto response = std::make_shared<http::response<http::empty_body>>(Head<http::empty_body>(from, true));
    response->chunked(true);
    auto serializer = std::make_shared<http::response_serializer<http::empty_body>>(*response);
    // A stream has its own time limit: Feed closes a connection whose client does not read.
    transport().expires_never();
    BeginPart();
    http::async_write_header(
        *stream_, *serializer,
        [self = this->shared_from_this(), response, serializer](const beast::error_code& error, std::size_t) {
          self->EndPart();
          if (error) return self->Close();
        });
    server().streams.push_back(this->weak_from_this());
    WatchForEnd();
  }

  /// @param message the request, whose header asks for the change of protocol.
  void BeginSocket(const http::request<http::string_body>& message, const SocketService& service) {
    if (!websocket::is_upgrade(message)) return Refuse(426);
    // A WebSocket is of a client with a ticket: it gives way to no guest.
    if (!known_) known_ = server().sockets < server().limits.sockets && server().admission.Recognise(id());
    if (!known_ || server().sockets >= server().limits.sockets) return Refuse(503);
    // From here on the protocol's own pings find a client that is gone.
    transport().expires_never();
    web_.emplace(*stream_);
    web_->set_option(websocket::stream_base::timeout{kOpening, kSilence, true});
    web_->read_message_max(server().limits.message);
    web_->auto_fragment(false);
    ++server().sockets;
    accepting_ = true;  // What `opened` sends waits for the end of the handshake.
    service_ = &service;
    service.opened(this);
    auto request = std::make_shared<http::request<http::string_body>>(message);
    web_->async_accept(*request, [self = this->shared_from_this(), request](const beast::error_code& error) {
      if (error || !self->open()) return self->Close();
      self->accepting_ = false;
      self->WriteNext();
      self->ReadMessage();
    });
  }

  void ReadMessage() {
    buffer_.clear();
    web_->async_read(buffer_, [self = this->shared_from_this()](const beast::error_code& error, std::size_t) {
      if (error || !self->open()) return self->Close();
      const auto bytes = self->buffer_.data();
      self->service_->received(self.get(), {static_cast<const char*>(bytes.data()), bytes.size()});
      if (self->open()) self->ReadMessage();
    });
  }

  void Push(Message message) {
    out_.push_back(std::move(message));
    if (out_.size() == 1) WriteNext();
  }

  void WriteNext() {
    if (accepting_ || out_.empty() || !open()) return;
    web_->binary(out_.front().binary);
    web_->async_write(asio::buffer(*out_.front().bytes),
                      [self = this->shared_from_this()](const beast::error_code& error, std::size_t) {
                        if (error) return self->Close();
                        self->out_.pop_front();
                        self->WriteNext();
                      });
  }

  /// Closes the stream at the next event on the socket: the client ends it, or sends bytes that are not allowed here.
  void WatchForEnd() {
    stream_->async_read_some(
        asio::buffer(&last_word_, 1),
        [self = this->shared_from_this()](const beast::error_code&, std::size_t) { self->Close(); });
  }

  asio::ssl::context* const tls_;            ///< Null: plain TCP.
  std::optional<beast::tcp_stream> silent_;  ///< Until the first bytes of TLS.
  std::array<char, 2048> hello_{};           ///< These bytes.
  std::optional<Stream> stream_;
  beast::flat_buffer buffer_{32 * 1024};
  std::optional<http::request_parser<http::string_body>> parser_;
  bool known_ = false;  ///< Has a reserved slot.
  bool last_ = false;   ///< The connection is closed after this response.
  std::string part_;
  char last_word_ = 0;
  std::optional<websocket::stream<Stream&>> web_;
  const SocketService* service_ = nullptr;  ///< Of `web_`.
  bool accepting_ = false;
  std::deque<Message> out_;  ///< The first is being sent.
};

}  // namespace

void ServerState::Close(Admission::Id connection) {
  const auto found = open.find(connection);
  // The object lives until its pending operations have ended.
  if (const auto held = found == open.end() ? nullptr : found->second.lock()) held->Close();
}

void Connection::Close() {
  if (!open_) return;
  open_ = false;
  server_->admission.Leave(id_);
  server_->open.erase(id_);
  CloseSocket();
}

std::shared_ptr<Connection> MakeConnection(tcp::socket socket, Admission::Id id, std::shared_ptr<ServerState> server,
                                           asio::ssl::context* tls) {
  if (tls == nullptr) {
    return std::make_shared<ConnectionOver<beast::tcp_stream>>(id, std::move(server), std::move(socket), tls);
  }
  return std::make_shared<ConnectionOver<TlsStream>>(id, std::move(server), std::move(socket), tls);
}

}  // namespace fulcrum::console
