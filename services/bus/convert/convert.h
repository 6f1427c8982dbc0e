// Our value types to the generated ones and back: the only place, with services/bus/dds, that sees generated code.
// Nothing here judges content: enumerators and numbers pass as they are and the gate decides (services/bus/gate.h).
#pragma once

#include <cstddef>

#include "cautery.h"
#include "contact.h"
#include "generator.h"
#include "handle.h"
#include "health.h"
#include "services/core/messages.h"
#include "session.h"
#include "temperature.h"
#include "thermal_event.h"
#include "tissue.h"
#include "tool.h"
#include "topology.h"

namespace fulcrum::bus {

/// False when a list or a name is longer than the wire type holds; texts for people are cut instead.
[[nodiscard]] bool ToWire(const HandleState& from, idl::HandleState* to);
[[nodiscard]] bool ToWire(const GeneratorSetting& from, idl::GeneratorSetting* to);
[[nodiscard]] bool ToWire(const ToolState& from, idl::ToolState* to);
[[nodiscard]] bool ToWire(const ContactModel& from, idl::ContactModel* to);
[[nodiscard]] bool ToWire(const CauteryContact& from, idl::CauteryContact* to);
[[nodiscard]] bool ToWire(const TopologyState& from, idl::TopologyState* to);
[[nodiscard]] bool ToWire(const TearState& from, idl::TearState* to);
[[nodiscard]] bool ToWire(const OpenCells& from, idl::OpenCells* to);
[[nodiscard]] bool ToWire(const ThermalEvent& from, idl::ThermalEvent* to);
[[nodiscard]] bool ToWire(const SceneManifest& from, idl::SceneManifest* to);
[[nodiscard]] bool ToWire(const Command& from, idl::Command* to);
[[nodiscard]] bool ToWire(const CommandReply& from, idl::CommandReply* to);
[[nodiscard]] bool ToWire(const TickManifest& from, idl::TickManifest* to);
[[nodiscard]] bool ToWire(const Health& from, idl::Health* to);

/// `to` keeps its buffers.
void FromWire(const idl::HandleState& from, HandleState* to);
void FromWire(const idl::GeneratorSetting& from, GeneratorSetting* to);
void FromWire(const idl::ToolState& from, ToolState* to);
void FromWire(const idl::ContactModel& from, ContactModel* to);
void FromWire(const idl::CauteryContact& from, CauteryContact* to);
void FromWire(const idl::TopologyState& from, TopologyState* to);
void FromWire(const idl::TearState& from, TearState* to);
void FromWire(const idl::OpenCells& from, OpenCells* to);
void FromWire(const idl::ThermalEvent& from, ThermalEvent* to);
void FromWire(const idl::SceneManifest& from, SceneManifest* to);
void FromWire(const idl::Command& from, Command* to);
void FromWire(const idl::CommandReply& from, CommandReply* to);
void FromWire(const idl::TickManifest& from, TickManifest* to);
void FromWire(const idl::Health& from, Health* to);

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
