// Who may talk to the console. Pure but for the token's file.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "services/session/console/http_message.h"

namespace fulcrum::console {

/// Compares without telling by its time how much was right.
[[nodiscard]] bool SameSecret(std::string_view given, std::string_view secret);

/// 256 random bits in hexadecimal.
[[nodiscard]] std::string MakeToken();

/// The token of a file that only its owner can read; 16 to 256 letters, digits, '-', '_'. Throws InputError.
[[nodiscard]] std::string ReadToken(const std::filesystem::path& file);
/// Writes the file anew, readable by its owner alone. Throws InputError.
void WriteToken(const std::filesystem::path& file, const std::string& token);

class Access {
 public:
  /// @param names host names under which this machine is reached, beside localhost and numeric addresses.
  Access(std::string token, std::vector<std::string> names);

  /// True when the Host is a numeric address, localhost or one of the names: a page of another site that has its own
  /// name lead here (DNS rebinding) always comes with that name.
  [[nodiscard]] bool IsOwnHost(std::string_view host) const;
  /// True unless the browser says that a page of another site asks.
  [[nodiscard]] static bool IsOwnSite(const HttpRequest& request);
  /// True when the request brings the token: `Authorization: Bearer TOKEN`.
  [[nodiscard]] bool HasToken(const HttpRequest& request) const;

 private:
  std::string token_;
  std::vector<std::string> names_;
};

}  // namespace fulcrum::console
