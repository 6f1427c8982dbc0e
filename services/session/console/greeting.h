// What `fulcrum console` prints when it has begun to listen.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::console {

struct GreetingFacts {
  std::string address;  ///< Of the page, without the token: "https://cart-3:8480/".
  std::string token;
  std::filesystem::path token_file;
  std::string fingerprint;       ///< Empty: no TLS.
  bool new_fingerprint = false;  ///< It differs from that of the last start.
};

/// @param terminal false: the text may be kept (journal, file, pipe), and has the token's file instead of the token.
[[nodiscard]] std::string Greeting(const GreetingFacts& facts, bool terminal);

/// The text as a QR code in half blocks, dark on light; empty when it is too long for one.
[[nodiscard]] std::string QrCode(const std::string& text);

}  // namespace fulcrum::console
