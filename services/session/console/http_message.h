// HTTP requests and responses as plain texts, so that the console's routes need no HTTP library.
#pragma once

#include <string>

namespace fulcrum::console {

struct SocketService;

struct HttpRequest {
  std::string method, target;
  std::string host, origin, fetch_site, authorization, content_type;  ///< Header fields; empty: missing.
  std::string body;
  bool secure = false;  ///< Sent over TLS.
};

struct HttpResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::string policy = {};  ///< Content-Security-Policy; empty: that of the page.
  bool stream = false;      ///< True: the body is the first of many parts, and the connection stays open.
  /// Not null: the connection becomes a WebSocket of this service, which outlives the server.
  const SocketService* socket = nullptr;
};

}  // namespace fulcrum::console
