// PINs of people, kept as salted hashes: PBKDF2 with HMAC-SHA-256 (RFC 8018). A PIN of four digits resists no one who
// has the file; it keeps colleagues' names apart, and the file itself is its owner's alone.
#pragma once

#include <string>
#include <string_view>

namespace fulcrum::training {

/// 4 to 12 digits.
[[nodiscard]] bool IsPin(std::string_view text);

/// Text to store, with a new salt. Throws InputError unless IsPin.
[[nodiscard]] std::string HashOfPin(std::string_view pin);

/// Whether the stored text is the hash of this PIN; false also for a text that is none. Takes the same time for any
/// PIN.
[[nodiscard]] bool IsHashOf(std::string_view stored, std::string_view pin);

}  // namespace fulcrum::training
