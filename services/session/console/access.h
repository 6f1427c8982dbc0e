// Access control of the console.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "services/session/console/http_message.h"

namespace fulcrum::console {

/// Compares two secrets in constant time.
[[nodiscard]] bool SameSecret(std::string_view given, std::string_view secret);

/// A new token: 256 random bits in hexadecimal. Throws InputError when the system has no random numbers.
[[nodiscard]] std::string MakeToken();

/// Reads the token of a file that only its owner can read: 16 to 256 letters, digits, '-', '_'. Throws InputError.
[[nodiscard]] std::string ReadToken(const std::filesystem::path& file);
/// Replaces the file by one that only its owner can read. Throws InputError.
void WriteToken(const std::filesystem::path& file, const std::string& token);

/// Tickets for addresses that a browser opens without the token: each is valid once and for a minute.
class Tickets {
 public:
  /// Throws InputError as MakeToken(). The oldest of more than kMost is void.
  [[nodiscard]] std::string Issue(std::int64_t now_ns);
  /// True when the ticket is valid.
  [[nodiscard]] bool Use(std::string_view ticket, std::int64_t now_ns);
  static constexpr std::size_t kMost = 16;

 private:
  struct Ticket {
    std::string text;
    std::int64_t end_ns;
  };
  std::deque<Ticket> tickets_;  ///< Oldest first.
};

class Access {
 public:
  /// @param names host names of this machine, in addition to localhost and numeric addresses.
  Access(std::string token, std::vector<std::string> names);

  /// True when the Host is a numeric address, localhost or one of the names. In DNS rebinding, a page of another site
  /// resolves its own name to this machine, and its requests have that name as Host.
  [[nodiscard]] bool IsOwnHost(std::string_view host) const;
  /// True unless the browser marks the request as sent by a page of another site.
  [[nodiscard]] static bool IsOwnSite(const HttpRequest& request);
  /// True when the request contains the token: `Authorization: Bearer TOKEN`.
  [[nodiscard]] bool HasToken(const HttpRequest& request) const;

 private:
  std::string token_;
  std::vector<std::string> names_;
};

}  // namespace fulcrum::console
