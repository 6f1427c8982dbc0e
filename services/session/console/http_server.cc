#include "services/session/console/http_server.h"

#include <openssl/ssl.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <utility>

#include "services/base/core/error.h"
#include "services/session/console/connection.h"

namespace fulcrum::console {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using tcp = asio::ip::tcp;
using Clock = std::chrono::steady_clock;

// Pause before the next attempt when the system has no descriptor for a connection: without it the loop would spin.
constexpr auto kAcceptPause = std::chrono::milliseconds(5);
// Descriptors that guests give up then: one for the next connection, the others for files and sessions of the console.
constexpr int kGivenBack = 8;

asio::ip::address AddressOf(const std::string& text) {
  error_code error;
  auto address = asio::ip::make_address(text, error);
  if (error) throw InputError("--bind " + text + ": must be a numeric address, for example 127.0.0.1");
  return address;
}

/// Whose slots a connection takes. One host has all addresses of a /64 of IPv6.
std::string OriginOf(const tcp::socket& socket) {
  error_code error;
  const tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return {};
  if (peer.address().is_v4()) return peer.address().to_string();
  asio::ip::address_v6 address = peer.address().to_v6();
  if (address.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, address).to_string();
  asio::ip::address_v6::bytes_type bytes = address.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
  return asio::ip::address_v6(bytes).to_string();
}

std::unique_ptr<asio::ssl::context> TlsContext(const TlsIdentity& identity) {
  auto context = std::make_unique<asio::ssl::context>(asio::ssl::context::tls_server);
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                       asio::ssl::context::no_tlsv1_1 | SSL_OP_NO_RENEGOTIATION);
  // A cache would grow with each handshake of a stranger.
  SSL_CTX_set_session_cache_mode(context->native_handle(), SSL_SESS_CACHE_OFF);
  context->use_certificate(asio::buffer(identity.certificate), asio::ssl::context::pem);
  context->use_private_key(asio::buffer(identity.key), asio::ssl::context::pem);
  return context;
}

}  // namespace

bool IsLoopback(const std::string& address) { return AddressOf(address).is_loopback(); }

struct HttpServer::Impl {
  Impl(const ListenAddress& where, HttpService service, const HttpLimits& limits)
      : state(std::make_shared<ServerState>(std::move(service), limits)) {
    if (where.tls) tls = TlsContext(*where.tls);
    const tcp::endpoint endpoint(AddressOf(where.address), static_cast<unsigned short>(where.port));
    error_code error;
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      throw InputError("cannot listen on " + where.address + " port " + std::to_string(where.port) + ": " +
                       error.message() + "; is another console running? Take another port with --port");
    }
    Accept();
  }

  void Accept() {
    acceptor.async_accept([this](const error_code& error, tcp::socket socket) {
      if (error) return AcceptLater();
      auto held = std::make_shared<tcp::socket>(std::move(socket));
      std::string origin = OriginOf(*held);
      const Clock::time_point now = Clock::now(), earliest = state->admission.Earliest(origin, now);
      if (earliest <= now) return Admit(held, origin);
      wait.expires_at(earliest);
      wait.async_wait([this, held, origin = std::move(origin)](const error_code& stopped) {
        if (!stopped) Admit(held, origin);
      });
    });
  }

  void Admit(const std::shared_ptr<tcp::socket>& socket, const std::string& origin) {
    // Else the end of a picture waits for the browser's acknowledgement of its begin, 40 ms.
    error_code ignored;
    socket->set_option(tcp::no_delay(true), ignored);
    const Admission::Id id = ++last_id;
    const std::optional<Admission::Id> loser = state->admission.Enter(id, origin, Clock::now());
    if (loser) state->Close(*loser);
    const auto connection = MakeConnection(std::move(*socket), id, state, tls.get());
    state->open.emplace(id, connection);
    connection->Begin();
    Accept();
  }

  /// After a failure to accept, which in general is a lack of descriptors: the oldest guests give up theirs.
  void AcceptLater() {
    for (int i = 0; i < kGivenBack; ++i) {
      if (const auto oldest = state->admission.TakeOldest()) state->Close(*oldest);
    }
    wait.expires_after(kAcceptPause);
    wait.async_wait([this](const error_code& stopped) {
      if (!stopped) Accept();
    });
  }

  std::shared_ptr<ServerState> state;
  std::unique_ptr<asio::ssl::context> tls;  ///< Null: plain HTTP.
  Admission::Id last_id = 0;
  // Declared last, so that pending operations are destroyed before the members that they use.
  asio::io_context io{1};
  tcp::acceptor acceptor{io};
  asio::steady_timer wait{io};
};

HttpServer::HttpServer(const ListenAddress& where, HttpService service, const HttpLimits& limits)
    : impl_(std::make_unique<Impl>(where, std::move(service), limits)) {}
HttpServer::~HttpServer() = default;

int HttpServer::port() const { return impl_->acceptor.local_endpoint().port(); }

void HttpServer::Turn(std::chrono::milliseconds time) { impl_->io.run_for(time); }

void HttpServer::Post(std::function<void()> work) { asio::post(impl_->io, std::move(work)); }

std::size_t HttpServer::stream_count() const { return impl_->state->streams.size(); }

void HttpServer::Feed(const std::function<std::string(std::uint64_t* cursor)>& part) {
  const Clock::time_point now = Clock::now();
  std::list<std::weak_ptr<Connection>>& streams = impl_->state->streams;
  for (auto at = streams.begin(); at != streams.end();) {
    const std::shared_ptr<Connection> stream = at->lock();
    if (stream && stream->is_late(now)) stream->Close();
    if (!stream || !stream->open()) {
      at = streams.erase(at);
      continue;
    }
    if (!stream->busy()) {
      if (std::string text = part(stream->cursor()); !text.empty()) stream->SendPart(std::move(text));
    }
    ++at;
  }
}

}  // namespace fulcrum::console
