// HTTP/1.1 server on Boost.Beast with one thread, few connections and hard limits. It contains no routes.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "services/session/console/http_message.h"

namespace fulcrum::console {

struct HttpLimits {
  std::size_t connections = 24;
  std::size_t streams = 6;  ///< Connections that may be streams.
  std::uint32_t header_bytes = 8 * 1024;
  std::uint64_t body_bytes = 8 * 1024;
  std::chrono::seconds request{10};  ///< From the first wait for a request to its last byte, also for a slow sender.
  std::chrono::seconds response{10};
};

class HttpServer {
 public:
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  /// Binds and listens. @param address numeric. @param port 0: any free port. Throws InputError.
  HttpServer(const std::string& address, int port, Handler handler, const HttpLimits& limits = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;

  /// Serves for `time`.
  void Turn(std::chrono::milliseconds time);

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

}  // namespace fulcrum::console
