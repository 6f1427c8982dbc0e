#include "services/session/console/access.h"

#include <arpa/inet.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/private_file.h"

namespace fulcrum::console {
namespace {

constexpr std::int64_t kTicketLife = 60 * kSecond_ns;
constexpr std::size_t kShortestToken = 16, kLongestToken = 256;

bool IsTokenText(std::string_view text) {
  const auto plain = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  };
  return text.size() >= kShortestToken && text.size() <= kLongestToken && std::all_of(text.begin(), text.end(), plain);
}

/// Host name without its port; nullopt when it has other than printable characters or the port is malformed.
std::optional<std::string> HostName(std::string_view host) {
  const std::size_t bracket = host.starts_with('[') ? host.find(']') : 0;
  if (bracket == std::string_view::npos || host.size() > 256) return {};
  // The system's parser of addresses would read up to a NUL only.
  if (std::any_of(host.begin(), host.end(), [](char c) { return c <= ' ' || c > '~'; })) return {};
  const std::size_t colon = host.find(':', bracket);
  if (colon != std::string_view::npos) {
    const std::string_view port = host.substr(colon + 1);
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    if (port.empty() || port.size() > 5 || !std::all_of(port.begin(), port.end(), digit)) return {};
  }
  std::string name(host.substr(0, colon));
  std::transform(name.begin(), name.end(), name.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return name;
}

}  // namespace

bool SameSecret(std::string_view given, std::string_view secret) {
  // The length is not secret. Every byte is compared, so that the time does not depend on the number of equal bytes.
  unsigned difference = given.size() == secret.size() ? 0u : 1u;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    const char c = i < given.size() ? given[i] : '\0';
    difference |= static_cast<unsigned char>(c) ^ static_cast<unsigned char>(secret[i]);
  }
  return difference == 0;
}

std::string MakeToken() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw InputError(std::string("no random numbers for a token: ") + ::strerror(errno));
  }
  std::string token;
  for (const unsigned char byte : bytes) {
    token += "0123456789abcdef"[byte >> 4];
    token += "0123456789abcdef"[byte & 15u];
  }
  return token;
}

std::string ReadToken(const std::filesystem::path& file) {
  const std::string line = runtime::ReadPrivateFile(file, kLongestToken + 2, "token file");
  std::string_view text = line;
  if (text.ends_with('\n')) text.remove_suffix(1);
  if (!IsTokenText(text)) {
    throw InputError("token file " + file.string() +
                     ": must contain one line of 16 to 256 letters, digits, '-' or '_'; remove it to get a new token");
  }
  return std::string(text);
}

void WriteToken(const std::filesystem::path& file, const std::string& token) {
  runtime::WritePrivateFile(file, token + "\n", "token file");
}

std::string Tickets::Issue(std::int64_t now_ns) {
  if (tickets_.size() == kMost) tickets_.pop_front();
  tickets_.push_back({MakeToken(), now_ns + kTicketLife});
  return tickets_.back().text;
}

bool Tickets::Use(std::string_view ticket, std::int64_t now_ns) {
  std::erase_if(tickets_, [&](const Ticket& one) { return one.end_ns <= now_ns; });
  return std::erase_if(tickets_, [&](const Ticket& one) { return SameSecret(ticket, one.text); }) > 0;
}

Access::Access(std::string token, std::vector<std::string> names)
    : token_(std::move(token)), names_(std::move(names)) {}

bool Access::IsOwnHost(std::string_view host) const {
  const std::optional<std::string> name = HostName(host);
  if (!name || name->empty()) return false;
  std::array<unsigned char, sizeof(in6_addr)> address{};
  if (*name == "localhost" || ::inet_pton(AF_INET, name->c_str(), address.data()) == 1) return true;
  if (name->size() > 2 && name->front() == '[' && name->back() == ']' &&
      ::inet_pton(AF_INET6, name->substr(1, name->size() - 2).c_str(), address.data()) == 1) {
    return true;
  }
  return std::find(names_.begin(), names_.end(), *name) != names_.end();
}

bool Access::IsOwnSite(const HttpRequest& request) {
  const bool same_origin =
      request.origin.empty() || request.origin == (request.secure ? "https://" : "http://") + request.host;
  const bool same_site =
      request.fetch_site.empty() || request.fetch_site == "same-origin" || request.fetch_site == "none";
  return same_origin && same_site;
}

bool Access::HasToken(const HttpRequest& request) const {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view given = request.authorization;
  return given.starts_with(kScheme) && SameSecret(given.substr(kScheme.size()), token_);
}

}  // namespace fulcrum::console
