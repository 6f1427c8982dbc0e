#include "services/recording/mcap_chunk.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>

#include "services/recording/byte_stream.h"

namespace fulcrum::recording {
namespace {

/// A recorder runs beside solvers: level 1 packs a tenth better, but takes two and a half times as long.
constexpr int kZstdLevel = -1;

}  // namespace

ChunkBuilder::ChunkBuilder() : zstd_(ZSTD_createCCtx()) {}

ChunkBuilder::~ChunkBuilder() { ZSTD_freeCCtx(zstd_); }

void ChunkBuilder::Add(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns,
                       std::uint64_t publish_time_ns, std::span<const std::byte> data) {
  first_ns_ = messages_.empty() ? log_time_ns : std::min(first_ns_, log_time_ns);
  last_ns_ = messages_.empty() ? log_time_ns : std::max(last_ns_, log_time_ns);
  if (index_.size() <= channel) {
    index_.resize(channel + std::size_t{1});
  }
  index_[channel].push_back({log_time_ns, messages_.size()});
  ByteWriter to(&messages_);
  to.Record(Opcode::kMessage, [&] {
    to.Number(channel);
    to.Number(sequence);
    to.Number(log_time_ns);
    to.Number(publish_time_ns);
    to.Bytes(data.data(), data.size());
  });
}

void ChunkBuilder::Pack(PackedChunk* chunk) {
  packed_.resize(std::max(packed_.size(), ZSTD_compressBound(messages_.size())));
  const std::size_t size =
      ZSTD_compressCCtx(zstd_, packed_.data(), packed_.size(), messages_.data(), messages_.size(), kZstdLevel);
  // It fails only without memory; then as it is.
  chunk->plain = ZSTD_isError(size) != 0;
  const std::span<const std::uint8_t> body = chunk->plain ? std::span(messages_) : std::span(packed_).first(size);
  chunk->first_ns = first_ns_;
  chunk->last_ns = last_ns_;
  chunk->packed = body.size();
  chunk->unpacked = messages_.size();
  chunk->bytes.clear();
  chunk->parts.clear();
  ByteWriter to(&chunk->bytes);
  to.Record(Opcode::kChunk, [&] {
    to.Number(first_ns_);
    to.Number(last_ns_);
    to.Number(std::uint64_t{messages_.size()});
    to.Number(static_cast<std::uint32_t>(crc32_z(0, messages_.data(), messages_.size())));
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
  messages_.clear();
}

}  // namespace fulcrum::recording
