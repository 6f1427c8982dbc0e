#include "services/recording/mcap_writer.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "services/core/error.h"
#include "services/recording/byte_stream.h"

namespace fulcrum::recording {
namespace {

/// The fastest that still packs: a recorder runs beside solvers.
constexpr int kZstdLevel = 1;

std::uint32_t Crc(std::span<const std::uint8_t> bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

void PutMetadata(ByteWriter* to, std::string_view name, const TextMap& values) {
  to->Record(Opcode::kMetadata, [&] {
    to->Text(name);
    to->Texts(values);
  });
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& file, std::string_view profile, std::string_view library)
    : file_(open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
  if (file_ < 0) {
    throw InputError(file.string() + ": cannot be written: " + std::strerror(errno) +
                     "; choose a folder that exists and is yours");
  }
  chunk_.reserve(2 * kChunkBytes);
  record_.assign(kMcapMagic.begin(), kMcapMagic.end());
  ByteWriter to(&record_);
  to.Record(Opcode::kHeader, [&] {
    to.Text(profile);
    to.Text(library);
  });
  Put(record_);
}

McapWriter::~McapWriter() { Close(); }

void McapWriter::Put(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty() && error_.empty()) {
    const ssize_t written = write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) {
      error_ = std::string("writing the recording failed: ") + std::strerror(errno);
    }
    if (written > 0) {
      offset_ += static_cast<std::uint64_t>(written);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }
}

std::uint16_t McapWriter::AddSchema(std::string_view name, std::string_view encoding, std::string_view text) {
  record_.clear();
  ByteWriter to(&record_);
  to.Record(Opcode::kSchema, [&] {
    to.Number(++schema_count_);
    to.Text(name);
    to.Text(encoding);
    to.Text(text);
  });
  schemas_.insert(schemas_.end(), record_.begin(), record_.end());
  Put(record_);
  return schema_count_;
}

std::uint16_t McapWriter::AddChannel(std::uint16_t schema, std::string_view topic, std::string_view message_encoding,
                                     const TextMap& metadata) {
  const auto number = static_cast<std::uint16_t>(channel_.size());
  channel_.emplace_back();
  record_.clear();
  ByteWriter to(&record_);
  to.Record(Opcode::kChannel, [&] {
    to.Number(number);
    to.Number(schema);
    to.Text(topic);
    to.Text(message_encoding);
    to.Texts(metadata);
  });
  channels_.insert(channels_.end(), record_.begin(), record_.end());
  Put(record_);
  return number;
}

void McapWriter::AddMetadata(std::string_view name, const TextMap& values) {
  EndChunk();
  record_.clear();
  ByteWriter to(&record_);
  PutMetadata(&to, name, values);
  metadata_.push_back({offset_, record_.size(), std::string(name)});
  Put(record_);
}

void McapWriter::Write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns,
                       std::uint64_t publish_time_ns, std::span<const std::byte> data) {
  if (file_ < 0 || !error_.empty() || channel >= channel_.size()) {
    return;
  }
  chunk_first_ns_ = chunk_.empty() ? log_time_ns : std::min(chunk_first_ns_, log_time_ns);
  chunk_last_ns_ = chunk_.empty() ? log_time_ns : std::max(chunk_last_ns_, log_time_ns);
  channel_[channel].index.push_back({log_time_ns, chunk_.size()});
  ++channel_[channel].count;
  ByteWriter to(&chunk_);
  to.Record(Opcode::kMessage, [&] {
    to.Number(channel);
    to.Number(sequence);
    to.Number(log_time_ns);
    to.Number(publish_time_ns);
    to.Bytes(data.data(), data.size());
  });
  first_ns_ = message_count_ == 0 ? log_time_ns : std::min(first_ns_, log_time_ns);
  last_ns_ = std::max(last_ns_, log_time_ns);
  ++message_count_;
  if (chunk_.size() >= kChunkBytes) {
    EndChunk();
  }
}

void McapWriter::EndChunk() {
  if (chunk_.empty()) {
    return;
  }
  packed_.resize(ZSTD_compressBound(chunk_.size()));
  const std::size_t packed = ZSTD_compress(packed_.data(), packed_.size(), chunk_.data(), chunk_.size(), kZstdLevel);
  // It fails only without memory; then as it is.
  const bool plain = ZSTD_isError(packed) != 0;
  const std::span<const std::uint8_t> body = plain ? std::span(chunk_) : std::span(packed_).first(packed);
  record_.clear();
  ByteWriter to(&record_);
  to.Record(Opcode::kChunk, [&] {
    to.Number(chunk_first_ns_);
    to.Number(chunk_last_ns_);
    to.Number(std::uint64_t{chunk_.size()});
    to.Number(Crc(chunk_));
    to.Text(plain ? "" : "zstd");
    to.Number(std::uint64_t{body.size()});
    to.Bytes(body.data(), body.size());
  });
  ChunkPlace place{chunk_first_ns_, chunk_last_ns_, offset_, record_.size(), 0, body.size(), chunk_.size(), plain, {}};
  for (std::size_t c = 0; c < channel_.size(); ++c) {
    ChannelState& channel = channel_[c];
    if (channel.index.empty()) {
      continue;
    }
    place.index_offset.emplace_back(static_cast<std::uint16_t>(c), offset_ + record_.size());
    to.Record(Opcode::kMessageIndex, [&] {
      to.Number(static_cast<std::uint16_t>(c));
      to.Sized<std::uint32_t>([&] { to.Bytes(channel.index.data(), channel.index.size() * sizeof(IndexEntry)); });
    });
    channel.index.clear();
  }
  place.index_length = record_.size() - place.length;
  chunks_.push_back(std::move(place));
  chunk_.clear();
  Put(record_);
}

std::vector<std::uint8_t> McapWriter::Statistics() const {
  std::vector<std::uint8_t> record;
  ByteWriter to(&record);
  to.Record(Opcode::kStatistics, [&] {
    to.Number(message_count_);
    to.Number(schema_count_);
    to.Number(static_cast<std::uint32_t>(channel_.size()));
    to.Number(std::uint32_t{0});  // Attachments.
    to.Number(static_cast<std::uint32_t>(metadata_.size()));
    to.Number(static_cast<std::uint32_t>(chunks_.size()));
    to.Number(first_ns_);
    to.Number(last_ns_);
    to.Sized<std::uint32_t>([&] {
      for (std::size_t c = 0; c < channel_.size(); ++c) {
        to.Number(static_cast<std::uint16_t>(c));
        to.Number(channel_[c].count);
      }
    });
  });
  return record;
}

/// Groups of records, where each group begins, and the footer.
void McapWriter::PutSummary() {
  const std::uint64_t start = offset_;
  std::vector<std::uint8_t> summary, offsets;
  ByteWriter to(&summary), to_offsets(&offsets);
  const auto group = [&](Opcode opcode, const auto& put) {
    const std::size_t at = summary.size();
    put();
    if (summary.size() > at) {
      to_offsets.Record(Opcode::kSummaryOffset, [&] {
        to_offsets.Number(static_cast<std::uint8_t>(opcode));
        to_offsets.Number(std::uint64_t{start + at});
        to_offsets.Number(std::uint64_t{summary.size() - at});
      });
    }
  };
  group(Opcode::kSchema, [&] { to.Bytes(schemas_.data(), schemas_.size()); });
  group(Opcode::kChannel, [&] { to.Bytes(channels_.data(), channels_.size()); });
  group(Opcode::kStatistics, [&] {
    const std::vector<std::uint8_t> statistics = Statistics();
    to.Bytes(statistics.data(), statistics.size());
  });
  group(Opcode::kChunkIndex, [&] {
    for (const ChunkPlace& chunk : chunks_) {
      to.Record(Opcode::kChunkIndex, [&] {
        to.Number(chunk.first_ns);
        to.Number(chunk.last_ns);
        to.Number(chunk.start);
        to.Number(chunk.length);
        to.Sized<std::uint32_t>([&] {
          for (const auto& [channel, offset] : chunk.index_offset) {
            to.Number(channel);
            to.Number(offset);
          }
        });
        to.Number(chunk.index_length);
        to.Text(chunk.plain ? "" : "zstd");
        to.Number(chunk.compressed);
        to.Number(chunk.uncompressed);
      });
    }
  });
  group(Opcode::kMetadataIndex, [&] {
    for (const MetadataPlace& place : metadata_) {
      to.Record(Opcode::kMetadataIndex, [&] {
        to.Number(place.start);
        to.Number(place.length);
        to.Text(place.name);
      });
    }
  });
  const std::uint64_t offset_start = start + summary.size();
  summary.insert(summary.end(), offsets.begin(), offsets.end());
  // The checksum covers the summary and the footer up to itself.
  to.Number(static_cast<std::uint8_t>(Opcode::kFooter));
  to.Number(std::uint64_t{20});
  to.Number(start);
  to.Number(offset_start);
  to.Number(Crc(summary));
  to.Bytes(kMcapMagic.data(), kMcapMagic.size());
  Put(summary);
}

void McapWriter::Close() {
  if (file_ < 0) {
    return;
  }
  EndChunk();
  record_.clear();
  ByteWriter to(&record_);
  to.Record(Opcode::kDataEnd, [&] { to.Number(std::uint32_t{0}); });  // 0: no checksum over all of it.
  Put(record_);
  PutSummary();
  close(file_);
  file_ = -1;
}

}  // namespace fulcrum::recording
