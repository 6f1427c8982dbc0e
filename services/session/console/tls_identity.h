// Certificate and key of the console, made on its machine. No authority vouches for it: who opens the page compares the
// fingerprint once.
#pragma once

#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::console {

struct TlsIdentity {
  std::string certificate, key;     ///< PEM.
  std::string fingerprint;          ///< SHA-256 of the certificate, "AB:CD:…", as browsers show it.
  std::time_t from = 0, until = 0;  ///< Its validity, seconds since 1970.
};

/// Makes an identity for these host names and numeric addresses. @param now seconds since 1970.
[[nodiscard]] TlsIdentity MakeTlsIdentity(const std::vector<std::string>& names, std::time_t now);

/// The identity in `folder` (console.pem, console.key; mode 0600). A missing one is made and stored, and so is one that
/// ends within a month or that is not valid yet, which was made while the clock was ahead. Throws InputError when the
/// files are damaged, do not belong together, or other users can read the key.
/// @param made set to true when the identity, and so the fingerprint, is new.
[[nodiscard]] TlsIdentity LoadTlsIdentity(const std::filesystem::path& folder, const std::vector<std::string>& names,
                                          std::time_t now, bool* made);

}  // namespace fulcrum::console
