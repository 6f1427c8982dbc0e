// HTTP/1.1 on Boost.Beast: one thread, few connections, hard limits. Knows no route.
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
  std::size_t streams = 6;  ///< Of them.
  std::uint32_t header_bytes = 8 * 1024;
  std::uint64_t body_bytes = 8 * 1024;
  std::chrono::seconds request{10};  ///< From the first wait for a request to its last byte, however slowly it comes.
  std::chrono::seconds response{10};
};

class HttpServer {
 public:
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  /// Listens. @param address numeric; @param port 0: any that is free. Throws InputError.
  HttpServer(const std::string& address, int port, Handler handler, const HttpLimits& limits = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;

  /// Serves for this long.
  void Turn(std::chrono::milliseconds time);

  /// Open streams.
  [[nodiscard]] std::size_t stream_count() const;
  /// Calls `part` for each stream that can take more and sends what it returns, unless that is empty. `cursor` is the
  /// stream's own and begins at 0. One that has not taken its last part for `response` is closed.
  void Feed(const std::function<std::string(std::uint64_t* cursor)>& part);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::console
