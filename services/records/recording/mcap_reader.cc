#include "services/records/recording/mcap_reader.h"

#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "services/base/core/error.h"
#include "services/records/recording/mcap_format.h"

namespace fulcrum::recording {
namespace {

/// Size of the first and last time at the beginning of a chunk [B].
constexpr std::uint64_t kChunkTimes = 2 * sizeof(std::uint64_t);

}  // namespace

McapReader::McapReader(const std::filesystem::path& file, Depth depth)
    : file_(file), depth_(depth), in_(file, std::ios::binary) {
  if (!in_) {
    throw InputError(file.string() + ": cannot be read: " + std::strerror(errno));
  }
  std::error_code error;
  size_ = std::filesystem::file_size(file, error);
  if (error) {
    throw InputError(file.string() + ": cannot be read: " + error.message());
  }
  std::array<std::uint8_t, kMcapMagic.size()> magic{};
  in_.read(reinterpret_cast<char*>(magic.data()), magic.size());
  if (!in_ || magic != kMcapMagic) {
    throw InputError(file.string() + ": is not a recording: it does not begin with the eight bytes of an MCAP file");
  }
  next_ = magic.size();
}

void McapReader::Reopen() {
  in_ = std::ifstream(file_, std::ios::binary);
  in_.seekg(static_cast<std::streamoff>(next_));
  if (!in_) {
    throw InputError(file_.string() + ": can no longer be read: " + std::strerror(errno));
  }
}

void McapReader::Fault(std::string what) {
  if (faults_.size() < kMostFaults) {
    faults_.push_back({at_, std::move(what)});
  }
}

std::optional<McapReader::Record> McapReader::ReadFromFile() {
  at_ = next_;
  if (next_ == size_) {
    return std::nullopt;
  }
  std::array<std::uint8_t, kRecordHead> head{};
  const auto read = [&](std::uint8_t* to, std::uint64_t count) {
    in_.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count));
    return static_cast<bool>(in_);
  };
  if (size_ - next_ < head.size() || !read(head.data(), head.size())) {
    Fault("the file ends within a record");
    return std::nullopt;
  }
  std::uint64_t length = 0;
  std::memcpy(&length, head.data() + 1, sizeof length);
  if (length > size_ - next_ - head.size()) {
    Fault("the file ends within a record of " + std::to_string(length) + " bytes");
    return std::nullopt;
  }
  next_ += head.size() + length;
  const bool passed_over = head[0] == static_cast<std::uint8_t>(Opcode::kChunk) &&
                           (depth_ == Depth::kChunkHeads || (wanted_ && !HoldsWanted(next_)));
  content_.resize(passed_over ? std::min<std::uint64_t>(length, kChunkTimes) : length);
  if (!read(content_.data(), content_.size())) {
    Fault("reading the file failed");
    return std::nullopt;
  }
  if (passed_over) {
    in_.seekg(static_cast<std::streamoff>(next_));
  }
  return Record{head[0], content_, passed_over};
}

bool McapReader::HoldsWanted(std::uint64_t indexes) {
  const std::streampos here = in_.tellg();
  bool told = false, wanted = false;
  std::array<std::uint8_t, kRecordHead + sizeof(std::uint16_t)> head{};
  while (!wanted && size_ - indexes >= head.size()) {
    in_.seekg(static_cast<std::streamoff>(indexes));
    in_.read(reinterpret_cast<char*>(head.data()), head.size());
    ByteReader from(head);
    if (!in_ || from.Number<std::uint8_t>() != static_cast<std::uint8_t>(Opcode::kMessageIndex)) {
      break;
    }
    const auto length = from.Number<std::uint64_t>();
    const auto channel = channels_.find(from.Number<std::uint16_t>());
    if (length > size_ - indexes - kRecordHead) {
      break;
    }
    told = true;
    wanted = channel == channels_.end() || wanted_(channel->second);
    indexes += kRecordHead + length;
  }
  in_.clear();
  in_.seekg(here);
  return wanted || !told;
}

std::optional<McapReader::Record> McapReader::TakeFromChunk() {
  ByteReader from(left_);
  const auto opcode = from.Number<std::uint8_t>();
  const auto length = from.Number<std::uint64_t>();
  const std::span<const std::uint8_t> content = from.Take(length);
  if (!from.good()) {
    Fault("a record reaches beyond its chunk");
    left_ = {};
    return std::nullopt;
  }
  left_ = left_.subspan(kRecordHead + length);
  return Record{opcode, content};
}

void McapReader::OpenChunk(const Record& record) {
  ByteReader from(record.content);
  const auto first_ns = from.Number<std::uint64_t>();
  const auto last_ns = from.Number<std::uint64_t>();
  if (from.good()) {
    first_ns_ = first_ns_ == 0 ? first_ns : std::min(first_ns_, first_ns);
    last_ns_ = std::max(last_ns_, last_ns);
  }
  if (record.passed_over) {
    return;
  }
  const auto size = from.Number<std::uint64_t>();
  const auto crc = from.Number<std::uint32_t>();
  const std::string packing = from.Text();
  const std::span<const std::uint8_t> body = from.Take(from.Number<std::uint64_t>());
  if (!from.good() || size > kMostChunkBytes) {
    Fault("a chunk's head is damaged");
    return;
  }
  if (packing.empty()) {
    chunk_.assign(body.begin(), body.end());
  } else if (packing == "zstd") {
    chunk_.resize(size);
    const std::size_t got = ZSTD_decompress(chunk_.data(), chunk_.size(), body.data(), body.size());
    if (ZSTD_isError(got) != 0 || got != size) {
      Fault("a chunk cannot be unpacked");
      return;
    }
  } else {
    Fault("a chunk is packed with \"" + packing.substr(0, 16) + "\"; valid: zstd or none");
    return;
  }
  if (chunk_.size() != size || (crc != 0 && libdeflate_crc32(0, chunk_.data(), chunk_.size()) != crc)) {
    Fault("a chunk's checksum does not match its content");
    return;
  }
  left_ = chunk_;
  coders_.BeginChunk();
  chunk_decoded_ = 0;
}

void McapReader::TakeChannel(std::uint16_t number, const McapChannel& channel) {
  if (const auto known = channels_.find(number); known != channels_.end()) {
    if (known->second != channel) Fault("another channel " + std::to_string(number));
    return;
  }
  channels_.emplace(number, channel);
  if (const std::optional<PointCoding> coding = FindPointCoding(channel.metadata)) coders_.Add(number, *coding);
}

void McapReader::TakeIndex(ByteReader* from) {
  const auto channel = from->Number<std::uint16_t>();
  const auto bytes = from->Number<std::uint32_t>();
  constexpr std::size_t kEntry = 2 * sizeof(std::uint64_t);  // Log time, place in the chunk.
  for (std::size_t k = 0; k < bytes / kEntry && from->good(); ++k) {
    const auto time_ns = from->Number<std::uint64_t>();
    (void)from->Number<std::uint64_t>();
    if (!from->good()) break;
    Span& span = spans_.try_emplace(channel, Span{time_ns, time_ns}).first->second;
    span = {std::min(span.first_ns, time_ns), std::max(span.last_ns, time_ns)};
  }
}

bool McapReader::Decode(McapMessage* message) {
  if (!coders_.Has(message->channel)) return true;
  const bool has_room = chunk_decoded_ <= kMostChunkBytes;
  if (!has_room || !coders_.Of(message->channel).Decode(message->data, &decoded_)) {
    Fault("a message of " + channels_.at(message->channel).topic.substr(0, 64) + " cannot be decoded");
    return false;
  }
  chunk_decoded_ += decoded_.size();
  message->data = decoded_;
  return true;
}

bool McapReader::Take(const Record& record, McapMessage* message) {
  ByteReader from(record.content);
  switch (static_cast<Opcode>(record.opcode)) {
    case Opcode::kHeader:
      profile_ = from.Text();
      library_ = from.Text();
      break;
    case Opcode::kSchema: {
      const auto number = from.Number<std::uint16_t>();
      McapSchema schema{from.Text(), from.Text(), from.Text()};
      if (from.good() && number != 0 && schemas_.try_emplace(number, schema).first->second != schema) {
        Fault("another schema " + std::to_string(number));
      }
      break;
    }
    case Opcode::kChannel: {
      const auto number = from.Number<std::uint16_t>();
      const McapChannel channel{from.Number<std::uint16_t>(), from.Text(), from.Text(), from.Texts()};
      if (from.good()) TakeChannel(number, channel);
      break;
    }
    case Opcode::kMessage: {
      *message = {from.Number<std::uint16_t>(), from.Number<std::uint32_t>(), from.Number<std::uint64_t>(),
                  from.Number<std::uint64_t>(), from.Rest()};
      if (from.good() && !channels_.contains(message->channel)) {
        Fault("a message of an undefined channel: " + std::to_string(message->channel));
        return false;
      }
      if (from.good()) return Decode(message);
      break;
    }
    case Opcode::kMetadata: {
      std::string name = from.Text();
      metadata_[std::move(name)] = from.Texts();
      break;
    }
    case Opcode::kMessageIndex:
      if (depth_ == Depth::kChunkHeads) TakeIndex(&from);
      break;
    default:
      break;
  }
  if (!from.good()) {
    Fault("a record of kind " + std::to_string(record.opcode) + " is too short");
  }
  return false;
}

bool McapReader::Next(McapMessage* message) {
  while (!done_) {
    if (!left_.empty()) {
      const std::optional<Record> record = TakeFromChunk();
      // Chunks contain schemas, channels and messages only.
      if (record && record->opcode >= static_cast<std::uint8_t>(Opcode::kSchema) &&
          record->opcode <= static_cast<std::uint8_t>(Opcode::kMessage) && Take(*record, message)) {
        return true;
      }
      continue;
    }
    const std::optional<Record> record = ReadFromFile();
    done_ = !record;
    if (!record) {
      break;
    }
    if (record->opcode == static_cast<std::uint8_t>(Opcode::kChunk)) {
      chunked_ = true;
      OpenChunk(*record);
    } else if (record->opcode == static_cast<std::uint8_t>(Opcode::kDataEnd)) {
      // The rest repeats records that were read already; only the magic at the end is new.
      std::array<std::uint8_t, kMcapMagic.size()> end{};
      in_.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
      in_.read(reinterpret_cast<char*>(end.data()), end.size());
      closed_ = in_ && end == kMcapMagic;
      done_ = true;
    } else if (chunked_ && record->opcode == static_cast<std::uint8_t>(Opcode::kMessage)) {
      // Records outside of chunks have no checksum, and a single wrong bit turns a message index into a message.
      Fault("a message outside of the chunks, where this file has its messages");
    } else if (Take(*record, message)) {
      return true;
    }
  }
  return false;
}

}  // namespace fulcrum::recording
