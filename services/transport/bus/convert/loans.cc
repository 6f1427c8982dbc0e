// Conversion of TissueFrame, TemperaturePatch and Picture in loans.
#include <algorithm>
#include <cstring>

#include "services/base/core/tissue_blocks.h"
#include "services/transport/bus/convert/convert.h"
#include "services/transport/bus/convert/pieces.h"

namespace fulcrum::bus {

static_assert(idl::MAX_TISSUE_BLOCKS == BlocksFor(kMaxTissueVertices));
static_assert(idl::TISSUE_BLOCK_VERTICES == kBlockVertices && idl::TISSUE_BLOCK_OFFSETS == 3 * kBlockVertices);
static_assert(idl::PATCH_TEXELS == kPatchTexels && idl::ATLAS_TEXELS == kAtlasTexels);
static_assert(idl::PATCH_BYTES == 4 * kPatchTexels * kPatchTexels);
static_assert(idl::MAX_PICTURE_BYTES == kMaxPictureBytes);

// A loan is the header followed by the payload, without padding, so the payload begins at sizeof(header). That of a
// TissueFrame is a sequence: a number, and so many blocks as in memory.
static_assert(sizeof(idl::TissueBlock) == sizeof(TissueBlock));
static_assert(sizeof(idl::TemperaturePatch) == sizeof(idl::TemperaturePatchHeader) + idl::PATCH_BYTES);
static_assert(sizeof(idl::Picture) == sizeof(idl::PictureHeader) + idl::MAX_PICTURE_BYTES);

namespace {

constexpr std::size_t kBlockCountOffset = sizeof(idl::TissueFrameHeader);
constexpr std::size_t kBlocksOffset = kBlockCountOffset + sizeof(std::uint32_t);
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

std::uint32_t BlockCountOf(const std::byte* loan) {
  std::uint32_t blocks = 0;
  std::memcpy(&blocks, loan + kBlockCountOffset, sizeof blocks);
  return blocks;
}

std::size_t LoanBytes(const TissueFrame*, std::size_t vertices) {
  return kBlocksOffset + BlocksFor(vertices) * sizeof(TissueBlock);
}
std::size_t LoanBytes(const TemperaturePatch*, std::size_t) { return sizeof(idl::TemperaturePatch); }
std::size_t LoanBytes(const Picture*, std::size_t) { return sizeof(idl::Picture); }

std::size_t NeededBytes(TopicId topic, std::span<const std::byte> loan) {
  switch (topic) {
    case TopicId::kTemperaturePatch:
      return sizeof(idl::TemperaturePatch);
    case TopicId::kPicture:
      return sizeof(idl::Picture);
    default:
      return kBlocksOffset +
             (loan.size() < kBlocksOffset ? 0 : std::size_t{BlockCountOf(loan.data())} * sizeof(TissueBlock));
  }
}

void SpoilLoan(std::span<std::byte> loan) {
  std::memset(loan.data(), 0, loan.size());
  idl::Stamp none;
  none.stamp_ns(-1);
  std::memcpy(loan.data(), static_cast<const void*>(&none), std::min(sizeof none, loan.size()));
}

TissueFrame::View OpenLoan(std::byte*, TissueFrame* draft) {
  draft->header = {};
  draft->xyz.clear();
  return {draft->header, draft->xyz};
}

bool CloseLoan(const TissueFrame& draft, std::span<std::byte> loan) { return ToLoan(draft, loan); }

bool ToLoan(const TissueFrame& from, std::span<std::byte> loan) {
  const std::size_t count = from.header.vertex_count;
  if (count > kMaxTissueVertices || from.xyz.size() != 3 * count || LoanBytes(&from, count) > loan.size()) return false;
  const auto blocks = static_cast<std::uint32_t>(BlocksFor(count));
  std::memcpy(loan.data() + kBlockCountOffset, &blocks, sizeof blocks);
  return PutHeader<idl::TissueFrameHeader>(from.header, loan.data()) &&
         PackPositions(from.xyz, loan.data() + kBlocksOffset);
}

bool FromLoan(std::span<const std::byte> loan, TissueFrame* to) {
  if (loan.size() < kBlocksOffset) return false;
  GetHeader<idl::TissueFrameHeader>(loan.data(), &to->header);
  const std::size_t count = to->header.vertex_count;
  if (count > kMaxTissueVertices || BlockCountOf(loan.data()) != BlocksFor(count) ||
      LoanBytes(to, count) > loan.size()) {
    return false;
  }
  to->xyz.resize(3 * count);
  UnpackPositions(loan.data() + kBlocksOffset, to->xyz);
  return true;
}

TemperaturePatch::View OpenLoan(std::byte* loan, TemperaturePatch* draft) {
  draft->header = {};
  return {draft->header, {reinterpret_cast<std::uint8_t*>(loan + kPatchOffset), idl::PATCH_BYTES}};
}

bool CloseLoan(const TemperaturePatch& draft, std::span<std::byte> loan) {
  return PutHeader<idl::TemperaturePatchHeader>(draft.header, loan.data());
}

bool ToLoan(const TemperaturePatch& from, std::span<std::byte> loan) {
  if (from.texels.size() != idl::PATCH_BYTES || loan.size() < sizeof(idl::TemperaturePatch)) return false;
  std::memcpy(loan.data() + kPatchOffset, from.texels.data(), from.texels.size());
  return CloseLoan(from, loan);
}

bool FromLoan(std::span<const std::byte> loan, TemperaturePatch* to) {
  if (loan.size() < sizeof(idl::TemperaturePatch)) return false;
  GetHeader<idl::TemperaturePatchHeader>(loan.data(), &to->header);
  const auto* texels = reinterpret_cast<const std::uint8_t*>(loan.data() + kPatchOffset);
  to->texels.assign(texels, texels + idl::PATCH_BYTES);
  return true;
}

Picture::View OpenLoan(std::byte* loan, Picture* draft) {
  draft->header = {};
  return {draft->header, {reinterpret_cast<std::uint8_t*>(loan + kPictureOffset), idl::MAX_PICTURE_BYTES}};
}

bool CloseLoan(const Picture& draft, std::span<std::byte> loan) {
  return draft.header.size <= kMaxPictureBytes && PutHeader<idl::PictureHeader>(draft.header, loan.data());
}

bool ToLoan(const Picture& from, std::span<std::byte> loan) {
  if (from.jpeg.size() != from.header.size || loan.size() < sizeof(idl::Picture) || !CloseLoan(from, loan)) {
    return false;
  }
  if (!from.jpeg.empty()) std::memcpy(loan.data() + kPictureOffset, from.jpeg.data(), from.jpeg.size());
  return true;
}

bool FromLoan(std::span<const std::byte> loan, Picture* to) {
  if (loan.size() < sizeof(idl::Picture)) return false;
  GetHeader<idl::PictureHeader>(loan.data(), &to->header);
  if (to->header.size > kMaxPictureBytes) return false;
  const auto* jpeg = reinterpret_cast<const std::uint8_t*>(loan.data() + kPictureOffset);
  to->jpeg.assign(jpeg, jpeg + to->header.size);
  return true;
}

}  // namespace fulcrum::bus
