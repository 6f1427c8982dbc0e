#include "services/records/recording/mcap_chunk.h"

#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "services/base/core/byte_stream.h"
#include "services/records/recording/mcap_format.h"

namespace fulcrum::recording {
namespace {

/// Leaves a fifth of the small topics' bytes and a fiftieth of the patches', whose texels seldom change, for 0.3 % of a
/// core. Frames are coded before, so that a fifth of their bytes reaches it: 2 % of a core.
constexpr int kZstdLevel = 1;

}  // namespace

void PutMessageHead(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns,
                    std::uint64_t publish_time_ns, std::size_t data_B, std::uint8_t* to) {
  const auto put = [&to](auto value) {
    std::memcpy(to, &value, sizeof value);
    to += sizeof value;
  };
  put(static_cast<std::uint8_t>(Opcode::kMessage));
  put(std::uint64_t{kMessageHead - kRecordHead + data_B});
  put(channel);
  put(sequence);
  put(log_time_ns);
  put(publish_time_ns);
}

ChunkPacker::ChunkPacker() : zstd_(ZSTD_createCCtx()) {}

ChunkPacker::~ChunkPacker() { ZSTD_freeCCtx(zstd_); }

void ChunkPacker::Code(std::uint16_t channel, const PointCoding& coding) { coders_.Add(channel, coding); }

std::size_t ChunkPacker::Pack(std::span<const std::uint8_t> records, std::size_t most, PackedChunk* chunk) {
  std::size_t length = 0;
  coded_.clear();
  coders_.BeginChunk();
  chunk->first_ns = std::numeric_limits<std::uint64_t>::max();
  chunk->last_ns = 0;
  while (length < records.size()) {
    ByteReader from(records.subspan(length));
    (void)from.Number<std::uint8_t>();
    const std::size_t next = length + kRecordHead + from.Number<std::uint64_t>();
    if (length > 0 && next > most) break;
    const std::span<const std::uint8_t> record = records.subspan(length, next - length);
    const auto channel = from.Number<std::uint16_t>();
    const auto sequence = from.Number<std::uint32_t>();
    const auto log_time_ns = from.Number<std::uint64_t>();
    const auto publish_time_ns = from.Number<std::uint64_t>();
    if (index_.size() <= channel) index_.resize(channel + std::size_t{1});
    index_[channel].push_back({log_time_ns, coders_.empty() ? length : coded_.size()});
    chunk->first_ns = std::min(chunk->first_ns, log_time_ns);
    chunk->last_ns = std::max(chunk->last_ns, log_time_ns);
    if (coders_.Has(channel)) {
      const std::size_t at = coded_.size();
      coded_.resize(at + kMessageHead);
      coders_.Of(channel).Encode(record.subspan(kMessageHead), &coded_);
      PutMessageHead(channel, sequence, log_time_ns, publish_time_ns, coded_.size() - at - kMessageHead,
                     coded_.data() + at);
    } else if (!coders_.empty()) {
      coded_.insert(coded_.end(), record.begin(), record.end());
    }
    length = next;
  }
  Compress(coders_.empty() ? records.first(length) : std::span<const std::uint8_t>(coded_), chunk);
  return length;
}

void ChunkPacker::Compress(std::span<const std::uint8_t> messages, PackedChunk* chunk) {
  packed_.resize(std::max(packed_.size(), ZSTD_compressBound(messages.size())));
  const std::size_t size =
      ZSTD_compressCCtx(zstd_, packed_.data(), packed_.size(), messages.data(), messages.size(), kZstdLevel);
  // Compression fails only for lack of memory; the chunk is then stored uncompressed.
  chunk->plain = ZSTD_isError(size) != 0;
  const std::span<const std::uint8_t> body = chunk->plain ? messages : std::span(packed_).first(size);
  chunk->packed = body.size();
  chunk->unpacked = messages.size();
  chunk->bytes.clear();
  chunk->parts.clear();
  ByteWriter to(&chunk->bytes);
  to.Record(Opcode::kChunk, [&] {
    to.Number(chunk->first_ns);
    to.Number(chunk->last_ns);
    to.Number(std::uint64_t{messages.size()});
    to.Number(libdeflate_crc32(0, messages.data(), messages.size()));
    to.Text(chunk->plain ? "" : "zstd");
    to.Number(std::uint64_t{body.size()});
    to.Bytes(body.data(), body.size());
  });
  chunk->length = chunk->bytes.size();
  for (std::size_t c = 0; c < index_.size(); ++c) {
    if (index_[c].empty()) {
      continue;
    }
    const auto channel = static_cast<std::uint16_t>(c);
    chunk->parts.push_back({channel, chunk->bytes.size(), index_[c].size()});
    to.Record(Opcode::kMessageIndex, [&] {
      to.Number(channel);
      to.Sized<std::uint32_t>([&] { to.Bytes(index_[c].data(), index_[c].size() * sizeof(IndexEntry)); });
    });
    index_[c].clear();
  }
}

}  // namespace fulcrum::recording
