#include "services/records/recorder/dump_writer.h"

#include <utility>

#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"
#include "services/records/recording/free_name.h"

namespace fulcrum::recorder {

DumpWriter::DumpWriter(Recorder* recorder, std::filesystem::path folder)
    : recorder_(recorder), folder_(std::move(folder)) {}

std::string DumpWriter::Ask(std::string reason) {
  const std::lock_guard lock(mutex_);
  reason_ = std::move(reason);
  return "writing the last seconds into " + folder_.string();
}

void DumpWriter::WriteIfAsked(std::int64_t now_ns) {
  const std::optional<std::string> reason = TakeReason();
  if (!reason) return;
  const std::filesystem::path file = recording::FreeName(folder_ / "dump.mcap");
  try {
    recorder_->Dump(file, *reason, now_ns);
    runtime::Log(runtime::LogLevel::kInfo, "dumped into " + file.string() + ": " + *reason);
  } catch (const InputError& error) {
    runtime::Log(runtime::LogLevel::kError, error.what());
  }
}

std::optional<std::string> DumpWriter::TakeReason() {
  const std::lock_guard lock(mutex_);
  return std::exchange(reason_, std::nullopt);
}

}  // namespace fulcrum::recorder
