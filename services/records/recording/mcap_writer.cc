#include "services/records/recording/mcap_writer.h"

#include <fcntl.h>
#include <libdeflate.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <optional>

#include "services/base/core/byte_stream.h"
#include "services/base/core/error.h"
#include "services/records/recording/mcap_format.h"

namespace fulcrum::recording {
namespace {

/// Room for the fixed parts of the end of a file, and for metadata of some kilobytes that is added before it [B].
constexpr std::uint64_t kEnd_B = 64 << 10;
/// Lengths of records of the summary, names apart [B].
constexpr std::uint64_t kChunkIndex_B = 96, kChunkPart_B = 10, kChannelCount_B = 10, kMetadataIndex_B = 32;

void PutMetadata(ByteWriter* to, std::string_view name, const TextMap& values) {
  to->Record(Opcode::kMetadata, [&] {
    to->Text(name);
    to->Texts(values);
  });
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& file, std::string_view profile, std::string_view library)
    : file_(open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)) {
  if (file_ < 0) {
    throw InputError(file.string() + ": cannot be written: " + std::strerror(errno) +
                     "; choose an existing folder in which you may write");
  }
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
  if (is_torn_) return;
  std::span<const std::uint8_t> rest = bytes;
  while (!rest.empty()) {
    const ssize_t written = write(file_, rest.data(), rest.size());
    if (written > 0) rest = rest.subspan(static_cast<std::size_t>(written));
    if (written >= 0 || errno == EINTR) continue;
    if (error_.empty()) error_ = std::string("writing the recording failed: ") + std::strerror(errno);
    // Half a record would hide everything behind it from a reader.
    const auto end = static_cast<off_t>(offset_);
    is_torn_ = rest.size() < bytes.size() && (ftruncate(file_, end) != 0 || lseek(file_, end, SEEK_SET) < 0);
    return;
  }
  offset_ += bytes.size();
}

std::uint64_t McapWriter::BytesToLimit() const {
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  if (limit.rlim_cur == RLIM_INFINITY) return std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t used = offset_ + summary_B_ + kEnd_B;
  return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

std::uint16_t McapWriter::AddSchema(std::string_view name, std::string_view encoding, std::string_view text) {
  if (!error_.empty()) return 0;
  record_.clear();
  ByteWriter to(&record_);
  to.Record(Opcode::kSchema, [&] {
    to.Number(++schema_count_);
    to.Text(name);
    to.Text(encoding);
    to.Text(text);
  });
  schemas_.insert(schemas_.end(), record_.begin(), record_.end());
  summary_B_ += record_.size();
  Put(record_);
  return schema_count_;
}

std::uint16_t McapWriter::AddChannel(std::uint16_t schema, std::string_view topic, std::string_view message_encoding,
                                     const TextMap& metadata) {
  const auto number = static_cast<std::uint16_t>(counts_.size());
  if (!error_.empty()) return number;
  counts_.push_back(0);
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
  summary_B_ += record_.size() + kChannelCount_B;
  Put(record_);
  if (const std::optional<PointCoding> coding = FindPointCoding(metadata)) packer_.Code(number, *coding);
  return number;
}

void McapWriter::AddMetadata(std::string_view name, const TextMap& values) {
  EndChunk();
  record_.clear();
  ByteWriter to(&record_);
  PutMetadata(&to, name, values);
  const std::uint64_t start = offset_;
  Put(record_);
  if (offset_ == start) return;  // There was no room.
  metadata_.push_back({start, record_.size(), std::string(name)});
  summary_B_ += kMetadataIndex_B + name.size();
}

void McapWriter::Write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time_ns,
                       std::uint64_t publish_time_ns, std::span<const std::byte> data) {
  if (file_ < 0 || !error_.empty() || channel >= counts_.size()) {
    return;
  }
  const std::size_t at = chunk_.size();
  chunk_.resize(at + kMessageHead);
  PutMessageHead(channel, sequence, log_time_ns, publish_time_ns, data.size(), chunk_.data() + at);
  ByteWriter(&chunk_).Bytes(data.data(), data.size());
  if (chunk_.size() >= ChunkPacker::kChunkBytes) {
    EndChunk();
  }
}

void McapWriter::EndChunk() {
  if (!chunk_.empty()) {
    (void)packer_.Pack(chunk_, chunk_.size(), &packed_);
    chunk_.clear();
    Append(packed_);
  }
}

void McapWriter::Append(const PackedChunk& chunk) {
  if (!error_.empty()) return;
  if (chunk.bytes.size() > BytesToLimit()) {
    error_ = "writing the recording failed: the file has reached the limit of this process on the size of a file, " +
             std::to_string((offset_ + BytesToLimit()) / 1'000'000) + " MB (ulimit -f)";
    return;
  }
  const std::uint64_t start = offset_;
  Put(chunk.bytes);
  if (!error_.empty()) return;
  summary_B_ += kChunkIndex_B + kChunkPart_B * chunk.parts.size();
  first_ns_ = chunks_.empty() ? chunk.first_ns : std::min(first_ns_, chunk.first_ns);
  last_ns_ = std::max(last_ns_, chunk.last_ns);
  for (const PackedChunk::Part& part : chunk.parts) {
    counts_[part.channel] += part.messages;
    message_count_ += part.messages;
  }
  chunks_.push_back(
      {start,
       chunk.bytes.size() - chunk.length,
       {{}, chunk.first_ns, chunk.last_ns, chunk.length, chunk.packed, chunk.unpacked, chunk.plain, chunk.parts}});
}

std::vector<std::uint8_t> McapWriter::Statistics() const {
  std::vector<std::uint8_t> record;
  ByteWriter to(&record);
  to.Record(Opcode::kStatistics, [&] {
    to.Number(message_count_);
    to.Number(schema_count_);
    to.Number(static_cast<std::uint32_t>(counts_.size()));
    to.Number(std::uint32_t{0});  // Number of attachments.
    to.Number(static_cast<std::uint32_t>(metadata_.size()));
    to.Number(static_cast<std::uint32_t>(chunks_.size()));
    to.Number(first_ns_);
    to.Number(last_ns_);
    to.Sized<std::uint32_t>([&] {
      for (std::size_t c = 0; c < counts_.size(); ++c) {
        to.Number(static_cast<std::uint16_t>(c));
        to.Number(counts_[c]);
      }
    });
  });
  return record;
}

// The groups of records, the position of each group, and the footer.
void McapWriter::PutEnd() {
  record_.clear();
  ByteWriter end(&record_);
  end.Record(Opcode::kDataEnd, [&] { end.Number(std::uint32_t{0}); });  // 0: no checksum over the whole file.
  const std::uint64_t start = offset_ + record_.size();
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
    for (const ChunkPlace& place : chunks_) {
      const PackedChunk& chunk = place.chunk;
      to.Record(Opcode::kChunkIndex, [&] {
        to.Number(chunk.first_ns);
        to.Number(chunk.last_ns);
        to.Number(place.start);
        to.Number(chunk.length);
        to.Sized<std::uint32_t>([&] {
          for (const PackedChunk::Part& part : chunk.parts) {
            to.Number(part.channel);
            to.Number(std::uint64_t{place.start + part.index_offset});
          }
        });
        to.Number(place.index_B);
        to.Text(chunk.plain ? "" : "zstd");
        to.Number(chunk.packed);
        to.Number(chunk.unpacked);
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
  // The checksum covers the summary and the footer up to the checksum itself.
  to.Number(static_cast<std::uint8_t>(Opcode::kFooter));
  to.Number(std::uint64_t{20});
  to.Number(start);
  to.Number(offset_start);
  to.Number(libdeflate_crc32(0, summary.data(), summary.size()));
  to.Bytes(kMcapMagic.data(), kMcapMagic.size());
  end.Bytes(summary.data(), summary.size());
  Put(record_);
}

void McapWriter::Close() {
  if (file_ < 0) {
    return;
  }
  EndChunk();
  PutEnd();
  close(file_);
  file_ = -1;
}

}  // namespace fulcrum::recording
