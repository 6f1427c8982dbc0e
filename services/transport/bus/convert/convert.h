// Conversion between our value types and the generated ones. Only this folder and services/transport/bus/dds include
// generated code. The conversions are made from the lists of fields (services/base/core/message_fields.h). The content
// is not checked here: enumerators and numbers pass unchanged, and the gate decides (services/transport/bus/gate.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "services/base/core/messages.h"
#include "services/transport/bus/convert/generated_types.h"

namespace fulcrum::bus {

/// False if a list or a name is longer than the wire type allows; texts for people are cut instead. Always false for
/// messages that are sent in loans.
template <class T>
[[nodiscard]] bool ToWire(const T& from, WireOf<T>* to);

/// Converts back. `to` keeps its buffers.
template <class T>
void FromWire(const WireOf<T>& from, T* to);

// The large topics are sent in loans. A loan is 4-byte aligned memory that contains the message's CDR. It is never
// accessed as a generated type: the header is copied in and out, the payload (blocks, bytes) is used in place.

/// Bytes of the largest message: of a TissueFrame with so many vertices.
[[nodiscard]] std::size_t LoanBytes(const TissueFrame*, std::size_t vertices);
[[nodiscard]] std::size_t LoanBytes(const TemperaturePatch*, std::size_t);
[[nodiscard]] std::size_t LoanBytes(const Picture*, std::size_t);
/// Bytes that the message of a loan says that it has: more than there are if it was cut short.
[[nodiscard]] std::size_t NeededBytes(TopicId topic, std::span<const std::byte> loan);
/// Makes a message that no gate accepts.
void SpoilLoan(std::span<std::byte> loan);

/// A view for the message's writer: its header, and with TissueFrame its positions, are `*draft`'s (reset here), other
/// payloads are in `loan`. CloseLoan completes the loan.
[[nodiscard]] TissueFrame::View OpenLoan(std::byte* loan, TissueFrame* draft);
[[nodiscard]] TemperaturePatch::View OpenLoan(std::byte* loan, TemperaturePatch* draft);
[[nodiscard]] Picture::View OpenLoan(std::byte* loan, Picture* draft);
/// False if the message does not fit, its header's counts are not those of the payload, or a position is not finite.
[[nodiscard]] bool CloseLoan(const TissueFrame& draft, std::span<std::byte> loan);
[[nodiscard]] bool CloseLoan(const TemperaturePatch& draft, std::span<std::byte> loan);
[[nodiscard]] bool CloseLoan(const Picture& draft, std::span<std::byte> loan);
/// Writes a complete message. False as for CloseLoan.
[[nodiscard]] bool ToLoan(const TissueFrame& from, std::span<std::byte> loan);
[[nodiscard]] bool ToLoan(const TemperaturePatch& from, std::span<std::byte> loan);
[[nodiscard]] bool ToLoan(const Picture& from, std::span<std::byte> loan);
/// Reads a complete message. False if the header's counts exceed the payload: then at most the header is read.
[[nodiscard]] bool FromLoan(std::span<const std::byte> loan, TissueFrame* to);
[[nodiscard]] bool FromLoan(std::span<const std::byte> loan, TemperaturePatch* to);
[[nodiscard]] bool FromLoan(std::span<const std::byte> loan, Picture* to);
// The session of a stamp exists on the wire only: ports set and check it.
void SetSessionOfLoan(std::uint64_t session, std::byte* loan);
/// Session of a serialised message: CDR without encapsulation, or a loan; 0: the bytes are too few.
[[nodiscard]] std::uint64_t SessionOf(std::span<const std::byte> message);

}  // namespace fulcrum::bus
