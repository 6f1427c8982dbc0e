// Messages as the bytes that travel: CDR with its four bytes of encapsulation, as a recording holds them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

/// False when the bytes are not such a message: too short, or a list longer than its type holds. Content is not
/// judged: see PassesGate. `message` keeps its buffers.
template <class T>
[[nodiscard]] bool DecodeCdr(std::span<const std::uint8_t> bytes, T* message);

/// False when the message does not fit its type.
template <class T>
[[nodiscard]] bool EncodeCdr(const T& message, std::vector<std::uint8_t>* bytes);

}  // namespace fulcrum::bus
