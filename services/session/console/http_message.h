// What the console's routes see of HTTP: plain texts, no library. Pure.
#pragma once

#include <string>

namespace fulcrum::console {

struct HttpRequest {
  std::string method, target;
  std::string host, origin, fetch_site, authorization, content_type;  ///< Header fields; empty: not there.
  std::string body;
};

struct HttpResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::string policy = {};  ///< Content-Security-Policy; empty: the page's own.
  bool stream = false;      ///< The body is the first of many parts, and the connection stays.
};

}  // namespace fulcrum::console
