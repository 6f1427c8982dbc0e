// Conversion of TissueFrame, TemperaturePatch and Picture in loans.
#include <algorithm>
#include <cstring>

#include "services/transport/bus/convert/convert.h"
#include "services/transport/bus/convert/pieces.h"

namespace fulcrum::bus {

static_assert(idl::MAX_TISSUE_VERTICES == kMaxTissueVertices && idl::MAX_TISSUE_FLOATS == 3 * kMaxTissueVertices);
static_assert(idl::PATCH_TEXELS == kPatchTexels && idl::ATLAS_TEXELS == kAtlasTexels);
static_assert(idl::PATCH_BYTES == 4 * kPatchTexels * kPatchTexels);
static_assert(idl::MAX_PICTURE_BYTES == kMaxPictureBytes);

// A plain type is its header followed by its payload, without padding, so the payload begins at sizeof(header).
static_assert(sizeof(idl::TissueFrame) == sizeof(idl::TissueFrameHeader) + idl::MAX_TISSUE_FLOATS * sizeof(float));
static_assert(sizeof(idl::TemperaturePatch) == sizeof(idl::TemperaturePatchHeader) + idl::PATCH_BYTES);
static_assert(sizeof(idl::Picture) == sizeof(idl::PictureHeader) + idl::MAX_PICTURE_BYTES);

namespace {

constexpr std::size_t kFrameOffset = sizeof(idl::TissueFrameHeader);
constexpr std::size_t kPatchOffset = sizeof(idl::TemperaturePatchHeader);
constexpr std::size_t kPictureOffset = sizeof(idl::PictureHeader);

// Headers are copied byte by byte: a loan need not be aligned for their 8-byte members.
template <class WireHeader, class Header>
bool PutHeader(const Header& header, std::byte* loan) {
  WireHeader wire;
  if (!convert::Put(header, &wire)) return false;
  std::memcpy(loan, static_cast<const void*>(&wire), sizeof wire);
  return true;
}
template <class WireHeader, class Header>
void GetHeader(const std::byte* loan, Header* header) {
  WireHeader wire;
  std::memcpy(static_cast<void*>(&wire), loan, sizeof wire);
  convert::Get(wire, header);
}
template <class WireHeader>
Stamp StampOfHeader(const std::byte* loan) {
  WireHeader wire;
  std::memcpy(static_cast<void*>(&wire), loan, sizeof wire);
  Stamp stamp;
  convert::Get(wire.stamp(), &stamp);
  return stamp;
}

}  // namespace

// Every message begins with its stamp, and the stamp ends with the session: its place is the same in all of them, in a
// loan and in CDR (idl/common.idl; bus_convert_test).
constexpr std::size_t kSessionOffset = sizeof(idl::Stamp) - sizeof(std::uint64_t);

void SetSessionOfLoan(std::uint64_t session, std::byte* loan) {
  std::memcpy(loan + kSessionOffset, &session, sizeof session);
}

std::uint64_t SessionOf(std::span<const std::byte> message) {
  std::uint64_t session = 0;
  if (message.size() >= sizeof(idl::Stamp)) std::memcpy(&session, message.data() + kSessionOffset, sizeof session);
  return session;
}

TissueFrame::View OpenLoan(std::byte* loan, TissueFrameHeader* header) {
  *header = {};
  return {*header, {reinterpret_cast<float*>(loan + kFrameOffset), idl::MAX_TISSUE_FLOATS}};
}

bool CloseLoan(const TissueFrameHeader& header, std::byte* loan) {
  if (header.vertex_count > kMaxTissueVertices) return false;
  return PutHeader<idl::TissueFrameHeader>(header, loan);
}

bool ToLoan(const TissueFrame& from, std::byte* loan) {
  if (from.xyz.size() != std::size_t{3} * from.header.vertex_count) return false;
  if (!CloseLoan(from.header, loan)) return false;
  if (!from.xyz.empty()) std::memcpy(loan + kFrameOffset, from.xyz.data(), from.xyz.size() * sizeof(float));
  return true;
}

bool FromLoan(const std::byte* loan, TissueFrame* to) {
  GetHeader<idl::TissueFrameHeader>(loan, &to->header);
  if (to->header.vertex_count > kMaxTissueVertices) return false;
  const auto* xyz = reinterpret_cast<const float*>(loan + kFrameOffset);
  to->xyz.assign(xyz, xyz + std::size_t{3} * to->header.vertex_count);
  return true;
}

Stamp StampOfLoan(const std::byte* loan, const TissueFrame*) { return StampOfHeader<idl::TissueFrameHeader>(loan); }

TemperaturePatch::View OpenLoan(std::byte* loan, TemperaturePatchHeader* header) {
  *header = {};
  return {*header, {reinterpret_cast<std::uint8_t*>(loan + kPatchOffset), idl::PATCH_BYTES}};
}

bool CloseLoan(const TemperaturePatchHeader& header, std::byte* loan) {
  return PutHeader<idl::TemperaturePatchHeader>(header, loan);
}

bool ToLoan(const TemperaturePatch& from, std::byte* loan) {
  if (from.texels.size() != idl::PATCH_BYTES || !CloseLoan(from.header, loan)) return false;
  std::memcpy(loan + kPatchOffset, from.texels.data(), from.texels.size());
  return true;
}

bool FromLoan(const std::byte* loan, TemperaturePatch* to) {
  GetHeader<idl::TemperaturePatchHeader>(loan, &to->header);
  const auto* texels = reinterpret_cast<const std::uint8_t*>(loan + kPatchOffset);
  to->texels.assign(texels, texels + idl::PATCH_BYTES);
  return true;
}

Stamp StampOfLoan(const std::byte* loan, const TemperaturePatch*) {
  return StampOfHeader<idl::TemperaturePatchHeader>(loan);
}

Picture::View OpenLoan(std::byte* loan, PictureHeader* header) {
  *header = {};
  return {*header, {reinterpret_cast<std::uint8_t*>(loan + kPictureOffset), idl::MAX_PICTURE_BYTES}};
}

bool CloseLoan(const PictureHeader& header, std::byte* loan) {
  return header.size <= kMaxPictureBytes && PutHeader<idl::PictureHeader>(header, loan);
}

bool ToLoan(const Picture& from, std::byte* loan) {
  if (from.jpeg.size() != from.header.size || !CloseLoan(from.header, loan)) return false;
  if (!from.jpeg.empty()) std::memcpy(loan + kPictureOffset, from.jpeg.data(), from.jpeg.size());
  return true;
}

bool FromLoan(const std::byte* loan, Picture* to) {
  GetHeader<idl::PictureHeader>(loan, &to->header);
  if (to->header.size > kMaxPictureBytes) return false;
  const auto* jpeg = reinterpret_cast<const std::uint8_t*>(loan + kPictureOffset);
  to->jpeg.assign(jpeg, jpeg + to->header.size);
  return true;
}

Stamp StampOfLoan(const std::byte* loan, const Picture*) { return StampOfHeader<idl::PictureHeader>(loan); }

}  // namespace fulcrum::bus
