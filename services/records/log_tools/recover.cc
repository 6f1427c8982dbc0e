#include "services/base/core/error.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recording/mcap_writer.h"

namespace fulcrum::log_tools {
namespace {

/// Copies the records that a reader returns; numbers of schemas and channels may change.
class Copier {
 public:
  Copier(const recording::McapReader& reader, recording::McapWriter* writer) : reader_(reader), writer_(writer) {}

  void Copy(const recording::McapMessage& message) {
    const auto known = channels_.find(message.channel);
    const std::uint16_t channel = known != channels_.end() ? known->second : AddChannel(message.channel);
    writer_->Write(channel, message.sequence, message.log_time_ns, message.publish_time_ns,
                   std::as_bytes(message.data));
  }

 private:
  std::uint16_t AddChannel(std::uint16_t number) {
    const recording::McapChannel& channel = reader_.channels().at(number);
    const auto schema = reader_.schemas().find(channel.schema);
    std::uint16_t& copy = schemas_[channel.schema];
    if (copy == 0 && schema != reader_.schemas().end()) {
      copy = writer_->AddSchema(schema->second.name, schema->second.encoding, schema->second.text);
    }
    return channels_[number] = writer_->AddChannel(copy, channel.topic, channel.message_encoding, channel.metadata);
  }

  const recording::McapReader& reader_;
  recording::McapWriter* writer_;
  std::map<std::uint16_t, std::uint16_t> schemas_, channels_;
};

}  // namespace

std::vector<std::string> Recover(const std::filesystem::path& damaged, const std::filesystem::path& mended) {
  if (std::filesystem::exists(mended)) throw InputError(mended.string() + ": exists; choose another name (--out)");
  recording::McapReader reader(damaged);
  recording::McapMessage message;
  const bool any = reader.Next(&message);
  recording::McapWriter writer(mended, reader.profile(), reader.library());
  Copier copier(reader, &writer);
  if (any) copier.Copy(message);
  while (any && reader.Next(&message)) copier.Copy(message);
  for (const auto& [name, values] : reader.metadata()) writer.AddMetadata(name, values);
  std::vector<std::string> wrong;
  for (const recording::McapFault& fault : reader.faults()) {
    wrong.push_back("at byte " + std::to_string(fault.offset) + ": " + fault.what);
  }
  if (!reader.closed()) wrong.emplace_back("the recorder did not close the file");
  writer.Close();
  if (!writer.error().empty()) throw InputError(mended.string() + ": " + writer.error());
  return wrong;
}

}  // namespace fulcrum::log_tools
