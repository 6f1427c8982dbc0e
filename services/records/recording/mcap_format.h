// Constants of the MCAP container format, version 0 (specification: mcap.dev/spec). All numbers are little endian; a
// string is its length as 32 bits and its bytes; a record is an opcode, the length of its content as 64 bits and the
// content.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace fulcrum::recording {

inline constexpr std::array<std::uint8_t, 8> kMcapMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
/// Size of opcode and length in front of the content [B].
inline constexpr std::size_t kRecordHead = 9;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0a,
  kStatistics = 0x0b,
  kMetadata = 0x0c,
  kMetadataIndex = 0x0d,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f,
};

}  // namespace fulcrum::recording
