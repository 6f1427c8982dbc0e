// Properties that must hold for any request to the console: without the token, or from a page of another host or site,
// it is refused; an accepted request cannot name a file outside its folder.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "services/session/console/router.h"
#include "services/session/console/screen_text.h"

namespace fulcrum::console::testing {

inline const std::string kToken(64, 'a');

/// Lines: method, target, host, origin, site, authorization, type; the rest is the body. "TOKEN" stands for the token.
inline HttpRequest RequestFrom(std::string_view bytes) {
  HttpRequest request;
  std::string* const fields[] = {&request.method,     &request.target,        &request.host,        &request.origin,
                                 &request.fetch_site, &request.authorization, &request.content_type};
  for (std::string* field : fields) {
    const std::size_t end = std::min(bytes.find('\n'), bytes.size());
    *field = bytes.substr(0, end);
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
  }
  request.body = bytes;
  if (request.authorization == "TOKEN") request.authorization = "Bearer " + kToken;
  return request;
}

/// Name of the violated property; empty: all hold.
inline std::string Broken(const HttpRequest& request) {
  static const Access access(kToken, {"cart"});
  ScreenText screen;
  screen.Add(request.body);
  if (ValidUtf8(screen.Text()) != screen.Text()) return "a screen's text is no UTF-8";
  const RouteResult result = Route(access, request);
  if (!result.routed)
    return result.refusal.status >= 400 && !result.refusal.body.empty() ? "" : "a refusal says nothing";
  const Routed& routed = *result.routed;
  const bool by_ticket = routed.wanted == Wanted::kReport || routed.wanted == Wanted::kLive;
  const bool open = routed.wanted == Wanted::kPage || by_ticket;
  if (by_ticket && !routed.fields.contains("ticket")) return "no ticket";
  if (!open && request.authorization != "Bearer " + kToken) return "a call without the token";
  if (routed.wanted != Wanted::kPage && routed.wanted != Wanted::kReport && !request.origin.empty() &&
      request.origin != "http://" + request.host)
    return "a call from another site";
  if (request.host.find("evil") != std::string::npos) return "a call to another host";
  if (request.method != "GET" && request.method != "POST") return "another method";
  const std::filesystem::path folder = "/out";
  for (const auto& [name, value] : routed.fields) {
    if (name != "name" && name != "scene") continue;
    const std::string file = (folder / value).lexically_normal();
    if (!file.starts_with("/out/") || file.find('\0') != std::string::npos) return "a file elsewhere: " + value;
    for (const char c : value) {
      if (static_cast<unsigned char>(c) <= ' ') return "a name with control characters";
    }
  }
  if (routed.path.find("/.") != std::string::npos || routed.path.find("//") != std::string::npos)
    return "a path that climbs";
  return {};
}

}  // namespace fulcrum::console::testing
