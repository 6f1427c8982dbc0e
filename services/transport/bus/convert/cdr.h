// Messages as the bytes that are sent: CDR with its encapsulation of four bytes, as stored in a recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

/// Decodes a message. False if the bytes are no such message: too short, or a list longer than its type allows. The
/// content is not checked: see PassesGate. `message` keeps its buffers.
template <class T>
[[nodiscard]] bool DecodeCdr(std::span<const std::uint8_t> bytes, T* message);

/// Encodes a message. False if it does not fit its type.
template <class T>
[[nodiscard]] bool EncodeCdr(const T& message, std::vector<std::uint8_t>* bytes);

}  // namespace fulcrum::bus
