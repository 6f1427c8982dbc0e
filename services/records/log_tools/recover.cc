#include "services/base/core/error.h"
#include "services/records/log_tools/copier.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recording/mcap_writer.h"

namespace fulcrum::log_tools {

std::vector<std::string> Recover(const std::filesystem::path& damaged, const std::filesystem::path& mended) {
  if (std::filesystem::exists(mended)) throw InputError(mended.string() + ": exists; choose another name (--out)");
  recording::McapReader reader(damaged);
  recording::McapMessage message;
  const bool any = reader.Next(&message);
  recording::McapWriter writer(mended, reader.profile(), reader.library());
  Copier copier(&writer);
  if (any) copier.Copy(reader, message);
  while (any && reader.Next(&message)) copier.Copy(reader, message);
  copier.Finish();
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
