// HTTP/1.1 server on Boost.Beast with one thread, few connections and hard limits. It contains no routes.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "services/session/console/admission.h"
#include "services/session/console/http_message.h"
#include "services/session/console/tls_identity.h"

namespace fulcrum::console {

struct HttpLimits {
  Admission::Limits slots;
  std::size_t streams = 6;    ///< Connections that may be streams.
  std::size_t sockets = 8;    ///< Connections that may be WebSockets.
  std::size_t message = 256;  ///< Longest message of a WebSocket's client [B].
  std::uint32_t header_bytes = 8 * 1024;
  std::uint64_t body_bytes = 8 * 1024;
  /// From the start of a guest's connection, or its last response, to the last byte of its request, TLS handshake
  /// included, also for a slow sender.
  std::chrono::seconds guest_request{2};
  /// The same for a client with the token: from its last response, and from its header to the end of its body.
  std::chrono::seconds request{10};
  std::chrono::seconds response{10};
};

struct HttpService {
  std::function<HttpResponse(const HttpRequest&)> handle;
  /// True when the header of this request, without its body, has the token.
  std::function<bool(const HttpRequest&)> knows;
};

struct ListenAddress {
  std::string address;             ///< Numeric.
  int port = 0;                    ///< 0: any free port.
  std::optional<TlsIdentity> tls;  ///< Empty: plain HTTP.
};

class HttpServer {
 public:
  /// Binds and listens. Throws InputError.
  HttpServer(const ListenAddress& where, HttpService service, const HttpLimits& limits = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;

  /// Serves for `time`.
  void Turn(std::chrono::milliseconds time);

  /// Calls `work` on the server's thread. From any thread.
  void Post(std::function<void()> work);

  /// Number of open streams.
  [[nodiscard]] std::size_t stream_count() const;
  /// Calls `part` for each stream that has sent its last part and sends the result unless it is empty. Each stream has
  /// its own `cursor`, which begins at 0. A stream whose client has not taken a part within the limit `response` is
  /// closed.
  void Feed(const std::function<std::string(std::uint64_t* cursor)>& part);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// True when only this machine can reach the numeric address. Throws InputError when it is no address.
[[nodiscard]] bool IsLoopback(const std::string& address);

}  // namespace fulcrum::console
