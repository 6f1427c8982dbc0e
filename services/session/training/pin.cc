#include "services/session/training/pin.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "services/base/core/error.h"

namespace fulcrum::training {
namespace {

constexpr int kRounds = 100'000;
constexpr std::size_t kSaltBytes = 16, kHashBytes = 32;
constexpr std::size_t kShortest = 4, kLongest = 12;
constexpr std::string_view kKind = "pbkdf2-sha256$";

std::string Hex(const unsigned char* bytes, std::size_t count) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text.append({kDigits[bytes[i] >> 4], kDigits[bytes[i] & 15]});
  return text;
}

/// @param salt as it is stored; its characters are hashed.
std::string HashWith(std::string_view salt, std::string_view pin) {
  std::array<unsigned char, kHashBytes> hash{};
  if (PKCS5_PBKDF2_HMAC(pin.data(), static_cast<int>(pin.size()), reinterpret_cast<const unsigned char*>(salt.data()),
                        static_cast<int>(salt.size()), kRounds, EVP_sha256(), static_cast<int>(hash.size()),
                        hash.data()) != 1) {
    throw std::runtime_error("a PIN cannot be hashed");
  }
  return std::string(kKind).append(salt).append("$").append(Hex(hash.data(), hash.size()));
}

}  // namespace

bool IsPin(std::string_view text) {
  return text.size() >= kShortest && text.size() <= kLongest &&
         std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

std::string HashOfPin(std::string_view pin) {
  if (!IsPin(pin)) throw InputError("PIN: must be 4 to 12 digits");
  std::array<unsigned char, kSaltBytes> salt{};
  if (RAND_bytes(salt.data(), static_cast<int>(salt.size())) != 1) throw std::runtime_error("no random numbers");
  return HashWith(Hex(salt.data(), salt.size()), pin);
}

bool IsHashOf(std::string_view stored, std::string_view pin) {
  const std::size_t end = stored.rfind('$');
  if (!stored.starts_with(kKind) || end < kKind.size() || !IsPin(pin)) return false;
  const std::string hash = HashWith(stored.substr(kKind.size(), end - kKind.size()), pin);
  return hash.size() == stored.size() && CRYPTO_memcmp(hash.data(), stored.data(), hash.size()) == 0;
}

}  // namespace fulcrum::training
