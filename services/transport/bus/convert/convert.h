// Our value types to the generated ones and back: the only place, with services/transport/bus/dds, that sees generated
// code. The conversions are made from the lists of fields (services/base/core/message_fields.h). Nothing here judges
// content: enumerators and numbers pass as they are and the gate decides (services/transport/bus/gate.h).
#pragma once

#include <cstddef>

#include "services/base/core/messages.h"
#include "services/transport/bus/convert/generated_types.h"

namespace fulcrum::bus {

/// False when a list or a name is longer than the wire type holds; texts for people are cut instead. Always false for
/// messages that travel in loans.
template <class T>
[[nodiscard]] bool ToWire(const T& from, WireOf<T>* to);

/// `to` keeps its buffers.
template <class T>
void FromWire(const WireOf<T>& from, T* to);

// The large topics live in loans. A loan is 4-byte aligned memory of sizeof(idl::T) bytes, so it is never touched as an
// idl::T: the header is copied in and out, the payload (floats, bytes) is used in place.

/// A view whose payload lies in `loan` and whose header is `*header` (reset here); CloseLoan copies that in.
[[nodiscard]] TissueFrame::View OpenLoan(std::byte* loan, TissueFrameHeader* header);
[[nodiscard]] TemperaturePatch::View OpenLoan(std::byte* loan, TemperaturePatchHeader* header);
/// False when the header claims more payload than there is.
[[nodiscard]] bool CloseLoan(const TissueFrameHeader& header, std::byte* loan);
[[nodiscard]] bool CloseLoan(const TemperaturePatchHeader& header, std::byte* loan);
/// Writes a whole message. False when it does not fit.
[[nodiscard]] bool ToLoan(const TissueFrame& from, std::byte* loan);
[[nodiscard]] bool ToLoan(const TemperaturePatch& from, std::byte* loan);
/// False when the header claims more payload than there is: then only the header is read.
[[nodiscard]] bool FromLoan(const std::byte* loan, TissueFrame* to);
[[nodiscard]] bool FromLoan(const std::byte* loan, TemperaturePatch* to);
/// Only the stamp, for samples that are passed over.
[[nodiscard]] Stamp StampOfLoan(const std::byte* loan, const TissueFrame*);
[[nodiscard]] Stamp StampOfLoan(const std::byte* loan, const TemperaturePatch*);

}  // namespace fulcrum::bus
