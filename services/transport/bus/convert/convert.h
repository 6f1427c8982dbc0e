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

// The large topics are sent in loans. A loan is 4-byte aligned memory of sizeof(idl::T) bytes, so it is never accessed
// as an idl::T: the header is copied in and out, the payload (floats, bytes) is used in place.

/// A view whose payload is in `loan` and whose header is `*header` (reset here); CloseLoan copies the header into the
/// loan.
[[nodiscard]] TissueFrame::View OpenLoan(std::byte* loan, TissueFrameHeader* header);
[[nodiscard]] TemperaturePatch::View OpenLoan(std::byte* loan, TemperaturePatchHeader* header);
[[nodiscard]] Picture::View OpenLoan(std::byte* loan, PictureHeader* header);
/// False if the header's counts exceed the payload.
[[nodiscard]] bool CloseLoan(const TissueFrameHeader& header, std::byte* loan);
[[nodiscard]] bool CloseLoan(const TemperaturePatchHeader& header, std::byte* loan);
[[nodiscard]] bool CloseLoan(const PictureHeader& header, std::byte* loan);
/// Writes a complete message. False if it does not fit.
[[nodiscard]] bool ToLoan(const TissueFrame& from, std::byte* loan);
[[nodiscard]] bool ToLoan(const TemperaturePatch& from, std::byte* loan);
[[nodiscard]] bool ToLoan(const Picture& from, std::byte* loan);
/// Reads a complete message. False if the header's counts exceed the payload: then only the header is read.
[[nodiscard]] bool FromLoan(const std::byte* loan, TissueFrame* to);
[[nodiscard]] bool FromLoan(const std::byte* loan, TemperaturePatch* to);
[[nodiscard]] bool FromLoan(const std::byte* loan, Picture* to);
// The session of a stamp exists on the wire only: ports set and check it.
void SetSessionOfLoan(std::uint64_t session, std::byte* loan);
/// Session of a serialised message: CDR without encapsulation, or a loan; 0: the bytes are too few.
[[nodiscard]] std::uint64_t SessionOf(std::span<const std::byte> message);
/// Reads only the stamp, for samples that are skipped.
[[nodiscard]] Stamp StampOfLoan(const std::byte* loan, const TissueFrame*);
[[nodiscard]] Stamp StampOfLoan(const std::byte* loan, const TemperaturePatch*);
[[nodiscard]] Stamp StampOfLoan(const std::byte* loan, const Picture*);

}  // namespace fulcrum::bus
