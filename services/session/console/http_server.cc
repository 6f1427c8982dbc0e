#include "services/session/console/http_server.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <list>
#include <optional>
#include <string_view>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::console {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = asio::ip::tcp;
using Clock = std::chrono::steady_clock;

// The page loads from and sends to this server only, and no other page may embed it in a frame.
constexpr const char* kPagePolicy = "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string Field(const http::request<http::string_body>& message, http::field name) {
  const auto [first, last] = message.equal_range(name);
  // A repeated field may be an attack on the checks: this value passes none of them.
  if (first != last && std::next(first) != last) return "\x01";
  return first == last ? std::string() : std::string(first->value());
}
std::string Field(const http::request<http::string_body>& message, const char* name) {
  const auto found = message.find(name);
  return found == message.end() ? std::string() : std::string(found->value());
}

HttpRequest Plain(http::request<http::string_body> message) {
  HttpRequest request;
  request.method = std::string(message.method_string());
  request.target = std::string(message.target());
  request.host = Field(message, http::field::host);
  request.origin = Field(message, http::field::origin);
  request.authorization = Field(message, http::field::authorization);
  request.content_type = Field(message, http::field::content_type);
  request.fetch_site = Field(message, "Sec-Fetch-Site");
  request.body = std::move(message.body());
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

/// Data that all connections share.
struct Shared {
  HttpServer::Handler handler;
  HttpLimits limits;
  std::size_t connections = 0;
};

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, std::shared_ptr<Shared> shared, std::list<std::weak_ptr<Connection>>* streams)
      : stream_(std::move(socket)), shared_(std::move(shared)), streams_(streams) {
    ++shared_->connections;
  }
  ~Connection() { --shared_->connections; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Read() {
    parser_.emplace();
    parser_->header_limit(shared_->limits.header_bytes);
    parser_->body_limit(shared_->limits.body_bytes);
    stream_.expires_after(shared_->limits.request);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const beast::error_code& error, std::size_t) { self->OnRead(error); });
  }
  /// Sends a refusal without reading a request.
  void Refuse(int status) { Send({.status = status, .type = "text/plain", .body = "refused\n"}, false); }

  // For a connection that has become a stream:
  [[nodiscard]] bool busy() const { return busy_; }
  [[nodiscard]] bool is_late(Clock::time_point now) const {
    return busy_ && now - busy_since_ > shared_->limits.response;
  }
  std::uint64_t* cursor() { return &cursor_; }
  void SendPart(std::string text) {
    part_ = std::move(text);
    busy_ = true;
    busy_since_ = Clock::now();
    asio::async_write(stream_.socket(), http::make_chunk(asio::const_buffer(part_.data(), part_.size())),
                      [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                        self->busy_ = false;
                        if (error) self->Close();
                      });
  }
  void Close() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_both, ignored);
    stream_.socket().close(ignored);
  }
  [[nodiscard]] bool open() const { return stream_.socket().is_open(); }

 private:
  void OnRead(const beast::error_code& error) {
    if (error == http::error::end_of_stream || error == beast::error::timeout) return Close();
    if (error) {
      // Only errors of the request itself get a response.
      if (error.category() == make_error_code(http::error::bad_target).category()) return Refuse(StatusOf(error));
      return Close();
    }
    const bool keep_alive = parser_->get().keep_alive();
    HttpResponse response = shared_->handler(Plain(parser_->release()));
    if (!response.stream) return Send(std::move(response), keep_alive);
    if (streams_->size() >= shared_->limits.streams) return Refuse(503);
    BeginStream(response);
  }

  void Send(HttpResponse from, bool keep_alive) {
    auto response = std::make_shared<http::response<http::string_body>>(Head<http::string_body>(from, keep_alive));
    response->body() = std::move(from.body);
    response->prepare_payload();
    stream_.expires_after(shared_->limits.response);
    http::async_write(stream_, *response,
                      [self = shared_from_this(), response](const beast::error_code& error, std::size_t) {
                        if (error || response->need_eof()) return self->Close();
                        self->Read();
                      });
  }

  void BeginStream(const HttpResponse& from) {
    auto response = std::make_shared<http::response<http::empty_body>>(Head<http::empty_body>(from, true));
    response->chunked(true);
    auto serializer = std::make_shared<http::response_serializer<http::empty_body>>(*response);
    // A stream has its own time limit: Feed closes a connection whose client does not read.
    stream_.expires_never();
    busy_ = true;
    busy_since_ = Clock::now();
    http::async_write_header(
        stream_, *serializer,
        [self = shared_from_this(), response, serializer](const beast::error_code& error, std::size_t) {
          self->busy_ = false;
          if (error) return self->Close();
        });
    streams_->push_back(weak_from_this());
    WatchForEnd();
  }

  /// Closes the stream at the next event on the socket: the client ends it, or sends bytes that are not allowed here.
  void WatchForEnd() {
    stream_.socket().async_read_some(
        asio::buffer(&last_word_, 1),
        [self = shared_from_this()](const beast::error_code&, std::size_t) { self->Close(); });
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{32 * 1024};
  std::optional<http::request_parser<http::string_body>> parser_;
  std::shared_ptr<Shared> shared_;
  std::list<std::weak_ptr<Connection>>* streams_;
  std::string part_;
  bool busy_ = false;  ///< A part is being sent.
  Clock::time_point busy_since_;
  std::uint64_t cursor_ = 0;
  char last_word_ = 0;
};

}  // namespace

struct HttpServer::Impl {
  Impl(const std::string& address, int port, Handler handler, const HttpLimits& limits)
      : shared(std::make_shared<Shared>(Shared{std::move(handler), limits, 0})) {
    beast::error_code error;
    const auto where = asio::ip::make_address(address, error);
    if (error) throw InputError("--bind " + address + ": must be a numeric address, for example 127.0.0.1");
    const tcp::endpoint endpoint(where, static_cast<unsigned short>(port));
    acceptor.open(endpoint.protocol());
    acceptor.set_option(asio::socket_base::reuse_address(true));
    acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      throw InputError("cannot listen on " + address + " port " + std::to_string(port) + ": " + error.message() +
                       "; is another console running? Take another port with --port");
    }
    Accept();
  }

  void Accept() {
    acceptor.async_accept([this](const beast::error_code& error, tcp::socket socket) {
      if (!error) {
        const bool full = shared->connections >= shared->limits.connections;
        const auto connection = std::make_shared<Connection>(std::move(socket), shared, &streams);
        if (full) {
          connection->Refuse(503);
        } else {
          connection->Read();
        }
      }
      Accept();
    });
  }

  std::shared_ptr<Shared> shared;
  std::list<std::weak_ptr<Connection>> streams;
  // Declared last, so that pending operations are destroyed before the members that they use.
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
};

HttpServer::HttpServer(const std::string& address, int port, Handler handler, const HttpLimits& limits)
    : impl_(std::make_unique<Impl>(address, port, std::move(handler), limits)) {}
HttpServer::~HttpServer() = default;

int HttpServer::port() const { return impl_->acceptor.local_endpoint().port(); }

void HttpServer::Turn(std::chrono::milliseconds time) { impl_->io.run_for(time); }

std::size_t HttpServer::stream_count() const { return impl_->streams.size(); }

void HttpServer::Feed(const std::function<std::string(std::uint64_t* cursor)>& part) {
  const Clock::time_point now = Clock::now();
  for (auto at = impl_->streams.begin(); at != impl_->streams.end();) {
    const std::shared_ptr<Connection> stream = at->lock();
    if (stream && stream->is_late(now)) stream->Close();
    if (!stream || !stream->open()) {
      at = impl_->streams.erase(at);
      continue;
    }
    if (!stream->busy()) {
      if (std::string text = part(stream->cursor()); !text.empty()) stream->SendPart(std::move(text));
    }
    ++at;
  }
}

}  // namespace fulcrum::console
