#include "services/records/log_tools/copier.h"

#include <cstring>

#include "services/transport/bus/topics.h"

namespace fulcrum::log_tools {
namespace {

/// As in the file of a recorder: TimeOrder relies on less than a second.
constexpr std::uint64_t kLongestChunk_ns = 500'000'000;

bool IsLarge(const std::string& topic) {
  const bus::TopicRole* role = bus::RoleNamed(topic);
  return role != nullptr && role->quality.path == bus::Path::kSharedMemory;
}

}  // namespace

std::uint16_t Copier::ChannelOf(const recording::McapReader& reader, std::uint16_t number) {
  const auto [at, is_new] = channels_.try_emplace({&reader, number}, 0);
  if (!is_new) return at->second;
  const recording::McapChannel& channel = reader.channels().at(number);
  const auto writer = channel.metadata.find("writer");
  if (writer == channel.metadata.end()) return at->second = AddChannel(reader, channel);
  const auto [known, is_first] = writers_.try_emplace({channel.topic, writer->second}, 0);
  if (is_first) known->second = AddChannel(reader, channel);
  return at->second = known->second;
}

std::uint16_t Copier::AddChannel(const recording::McapReader& reader, const recording::McapChannel& channel) {
  std::uint16_t schema_number = 0;
  if (const auto schema = reader.schemas().find(channel.schema); schema != reader.schemas().end()) {
    std::uint16_t& copy = schemas_[schema->second.name + '\0' + schema->second.text];
    if (copy == 0) copy = writer_->AddSchema(schema->second.name, schema->second.encoding, schema->second.text);
    schema_number = copy;
  }
  const std::uint16_t number =
      writer_->AddChannel(schema_number, channel.topic, channel.message_encoding, channel.metadata);
  if (const auto coding = recording::FindPointCoding(channel.metadata)) packer_.Code(number, *coding);
  is_large_[number] = IsLarge(channel.topic);
  return number;
}

void Copier::Copy(const recording::McapReader& reader, const recording::McapMessage& message, std::int64_t shift_ns) {
  const std::uint16_t channel = ChannelOf(reader, message.channel);
  const std::uint64_t log_time_ns = message.log_time_ns + static_cast<std::uint64_t>(shift_ns);
  for (Part& part : parts_) {
    const std::size_t most =
        &part == &parts_[1] ? recording::ChunkPacker::kLargeChunkBytes : recording::ChunkPacker::kChunkBytes;
    if (part.records.size() >= most ||
        (log_time_ns > part.first_ns && log_time_ns - part.first_ns >= kLongestChunk_ns)) {
      EndChunk(&part);
    }
  }
  Part& part = parts_[is_large_[channel] ? 1 : 0];
  if (part.records.empty()) part.first_ns = log_time_ns;
  const std::size_t at = part.records.size();
  part.records.resize(at + recording::kMessageHead + message.data.size());
  recording::PutMessageHead(channel, message.sequence, log_time_ns, message.publish_time_ns, message.data.size(),
                            part.records.data() + at);
  if (!message.data.empty()) {
    std::memcpy(part.records.data() + at + recording::kMessageHead, message.data.data(), message.data.size());
  }
}

void Copier::EndChunk(Part* part) {
  if (part->records.empty()) return;
  (void)packer_.Pack(part->records, part->records.size(), &packed_);
  part->records.clear();
  writer_->Append(packed_);
}

void Copier::Finish() {
  for (Part& part : parts_) EndChunk(&part);
}

}  // namespace fulcrum::log_tools
